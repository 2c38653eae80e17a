// TestMesh: a mesh in memory. Functions write it with a Writer, read it back with a Reader, and
// create the families of meshes that the tests of the library use.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <numeric>
#include <random>
#include <string>
#include <unordered_map>
#include <vector>

#include "shm/mesh.h"
#include "shm/reader.h"
#include "shm/recorded_order.h"
#include "shm/writer.h"

namespace shm {

/// Appends one scalar to packed values.
template <class T>
void append(std::vector<std::byte>& to, T value) {
  const std::size_t at = to.size();
  to.resize(at + sizeof value);
  std::memcpy(to.data() + at, &value, sizeof value);
}

struct TestCell {
  std::uint32_t block = 0;
  std::vector<std::uint64_t> corners;
};

struct TestMesh {
  Schema schema;
  std::vector<std::byte> xyz;  // coordinates of all vertices, packed
  std::uint64_t vertices = 0;
  std::vector<TestCell> cells;
  // Packed values of each static array. Elements are in the order of the source.
  std::vector<std::vector<std::byte>> arrays;

  void set_points(const std::vector<std::array<double, 3>>& points) {
    xyz.clear();
    vertices = points.size();
    for (const auto& p : points)
      for (double v : p) {
        if (schema.coordinate_type == ScalarType::float32)
          append(xyz, static_cast<float>(v));
        else
          append(xyz, v);
      }
  }
  std::size_t stride(std::size_t a) const {
    return scalar_bytes(schema.arrays[a].type) * schema.arrays[a].components;
  }
};

/// Returns the schema, the vertices and the cells of `from`, without the values of its arrays.
inline Mesh mesh_from(const TestMesh& from) {
  Mesh mesh;
  mesh.schema = from.schema;
  mesh.xyz = from.xyz;
  for (const TestCell& cell : from.cells) {
    mesh.cell_blocks.push_back(cell.block);
    mesh.corners.insert(mesh.corners.end(), cell.corners.begin(), cell.corners.end());
    mesh.corner_begin.push_back(mesh.corners.size());
  }
  return mesh;
}

/// The contents of a file as a Reader returns them. Vertices and cells are in coding order.
struct ReadBack {
  Schema schema;
  MeshBlock mesh;  // all blocks joined
  std::vector<Extra> extras;
  std::vector<double> times;
  std::vector<StepPiece> steps;
  Totals totals;
};

inline void join(MeshBlock& all, const MeshBlock& more) {
  const auto add = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  const std::uint64_t corner_base = all.corners.size(), vertex_base = all.vertex_count();
  add(all.vertex_numbers, more.vertex_numbers);
  add(all.xyz, more.xyz);
  add(all.cell_numbers, more.cell_numbers);
  add(all.cell_blocks, more.cell_blocks);
  add(all.corners, more.corners);
  for (const OtherLastUse& use : more.other_last_uses)
    all.other_last_uses.push_back({use.cell + all.last_use.size(), use.vertex});
  add(all.last_use, more.last_use);
  if (all.corner_begin.empty()) all.corner_begin.push_back(0);
  for (std::size_t i = 1; i < more.corner_begin.size(); ++i)
    all.corner_begin.push_back(more.corner_begin[i] + corner_base);
  for (std::uint64_t v : more.vertices_before_cell)
    all.vertices_before_cell.push_back(v + vertex_base);
  all.arrays.resize(more.arrays.size());
  for (std::size_t a = 0; a < more.arrays.size(); ++a) add(all.arrays[a], more.arrays[a]);
}

/// Number of threads of a Writer in write_mesh(), unless the options set another number. The number
/// of threads must not affect the bytes of the file; determinism_tests sets this variable to check
/// that.
inline unsigned writer_threads = 1;

/// Options of a Writer that writes no digests. Tests use files without digests if they change the
/// coded contents of a file: the digests of these contents would no longer match.
inline WriteOptions without_digests(WriteOptions options = {}) {
  options.digest = false;
  return options;
}
/// If false, write_mesh() and the feature files (feature_files.h) have no digests.
inline bool writer_digests = true;
inline WriteOptions with_writer_digests(WriteOptions options = {}) {
  options.digest = options.digest && writer_digests;
  return options;
}

/// Writes `mesh` in the same order as a converter: each vertex immediately before the first cell
/// that uses it. Marks the last use of each vertex. After the mesh, calls `after_mesh`, which may
/// write step values.
inline Result<SizeReport> write_mesh(const TestMesh& mesh, ByteSink& sink,
                                     WriteOptions options = {},
                                     const std::function<Result<void>(Writer&)>& after_mesh = {}) {
  if (options.threads == 1) options.threads = writer_threads;
  auto writer = Writer::create(sink, mesh.schema, with_writer_digests(options));
  if (!writer) return writer.error();
  std::vector<std::uint64_t> last(mesh.vertices, ~std::uint64_t{0});
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c)
    for (std::uint64_t v : mesh.cells[c].corners) last[v] = c;
  std::vector<char> added(mesh.vertices);
  const std::size_t xyz_bytes = 3 * scalar_bytes(mesh.schema.coordinate_type);
  const auto add = [&](std::uint64_t v) -> Result<void> {
    if (added[v] != 0) return {};
    added[v] = 1;
    std::vector<std::byte> data;
    for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a) {
      if (mesh.schema.arrays[a].location != Location::point || mesh.schema.arrays[a].per_step)
        continue;
      const auto* from = mesh.arrays[a].data() + v * mesh.stride(a);
      data.insert(data.end(), from, from + mesh.stride(a));
    }
    const auto xyz = std::span(mesh.xyz).subspan(v * xyz_bytes, xyz_bytes);
    return last[v] == ~std::uint64_t{0} && v % 2 == 0 ? writer->add_unused_vertex(v, xyz, data)
                                                      : writer->add_vertex(v, xyz, data);
  };
  // Writes some of the unused vertices between cells, and the other unused vertices at the end.
  std::uint64_t next_unused = 0;
  std::vector<std::uint64_t> next(mesh.schema.arrays.size());
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c) {
    const TestCell& cell = mesh.cells[c];
    std::uint64_t last_use = 0;
    std::vector<std::uint64_t> other;
    for (std::size_t i = 0; i < cell.corners.size(); ++i) {
      if (auto status = add(cell.corners[i]); !status) return status.error();
      if (last[cell.corners[i]] != c) continue;
      if (i < 64)
        last_use |= std::uint64_t{1} << i;
      else
        other.push_back(cell.corners[i]);
    }
    std::vector<std::byte> data;
    for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a) {
      if (mesh.schema.arrays[a].location != Location::cell || mesh.schema.arrays[a].per_step ||
          !mesh.schema.array_covers(a, cell.block))
        continue;
      const auto* from = mesh.arrays[a].data() + next[a]++ * mesh.stride(a);
      data.insert(data.end(), from, from + mesh.stride(a));
    }
    if (auto status = writer->add_cell(cell.block, cell.corners, last_use, data, other); !status)
      return status.error();
    for (; c % 16 == 15 && next_unused < mesh.vertices && next_unused < c * 4; ++next_unused)
      if (last[next_unused] == ~std::uint64_t{0} && next_unused % 2 == 0)
        if (auto status = add(next_unused); !status) return status.error();
  }
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    if (auto status = add(v); !status) return status.error();
  if (auto status = writer->end_mesh(); !status) return status.error();
  if (after_mesh)
    if (auto status = after_mesh(*writer); !status) return status.error();
  return writer->finish();
}

inline Result<ReadBack> read_mesh(std::span<const std::byte> bytes, const ReadLimits& limits = {}) {
  MemorySource source(bytes);
  auto reader = Reader::open(source, limits);
  if (!reader) return reader.error();
  ReadBack back;
  back.schema = reader->schema();
  back.mesh.arrays.resize(back.schema.arrays.size());
  while (true) {
    auto item = reader->next();
    if (!item) return item.error();
    if (*item == nullptr) return back;
    if (auto* block = std::get_if<MeshBlock>(*item)) {
      EXPECT_EQ(block->first_vertex, back.mesh.vertex_count());
      EXPECT_EQ(block->first_cell, back.mesh.cell_count());
      join(back.mesh, *block);
    }
    if (auto* extra = std::get_if<Extra>(*item)) back.extras.push_back(*extra);
    if (const auto* times = std::get_if<StepTimes>(*item))
      back.times.insert(back.times.end(), times->times.begin(), times->times.end());
    if (auto* piece = std::get_if<StepPiece>(*item)) back.steps.push_back(*piece);
    if (auto* totals = std::get_if<Totals>(*item)) back.totals = *totals;
  }
}

/// Returns true if the corners of two hexahedra differ only by a rotation. A reflection counts as a
/// difference.
inline bool same_up_to_rotation(std::span<const std::uint64_t> a,
                                std::span<const std::uint64_t> b) {
  constexpr std::array<int, 8> bits = {0, 1, 3, 2, 4, 5, 7, 6};
  for (int origin = 0; origin < 8; ++origin)
    for (int x = 0; x < 3; ++x)
      for (int y = 0; y < 3; ++y) {
        if (x == y) continue;
        const int z = 3 - x - y;
        const bool odd =
            ((y - x + 3) % 3 == 2) != (__builtin_popcount(static_cast<unsigned>(origin)) % 2 == 1);
        if (odd) continue;
        bool same = true;
        for (std::size_t i = 0; i < 8 && same; ++i) {
          const int at = bits[i];
          const int moved = origin ^ ((at & 1) << x) ^ ((at >> 1 & 1) << y) ^ ((at >> 2 & 1) << z);
          same = b[i] == a[static_cast<std::size_t>(bits[static_cast<std::size_t>(moved)])];
        }
        if (same) return true;
      }
  return false;
}

/// Writes the mesh, reads it back, and compares all data except rounded values. In Order::stream,
/// vertices and cells may be in another order. Returns the bytes of the file.
inline std::vector<std::byte> expect_round_trip(const TestMesh& mesh, WriteOptions options = {},
                                                SizeReport* report_out = nullptr) {
  MemorySink sink;
  RecordedOrder order;
  options.coding_order = &order;
  auto report = write_mesh(mesh, sink, options);
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  if (!report) return {};
  if (report_out != nullptr) *report_out = *report;
  std::uint64_t sum = 0;
  for (const auto& [name, bytes] : report->streams) sum += bytes;
  EXPECT_EQ(sum, sink.bytes.size());

  auto back = read_mesh(sink.bytes);
  EXPECT_TRUE(back) << (back ? "" : back.error().message());
  if (!back) return {};
  EXPECT_EQ(back->schema, mesh.schema);
  EXPECT_EQ(back->totals.streams, report->streams);
  EXPECT_EQ(back->totals.total_bytes, sink.bytes.size());
  EXPECT_EQ(back->mesh.vertex_count(), mesh.vertices);
  EXPECT_EQ(back->mesh.cell_count(), mesh.cells.size());
  EXPECT_EQ(order.vertices.size(), mesh.vertices);
  if (back->mesh.vertex_count() != mesh.vertices || back->mesh.cell_count() != mesh.cells.size())
    return {};

  const auto is_exact = [&](std::size_t array) {
    return !mesh.schema.arrays[array].per_step && !mesh.schema.arrays[array].quantization.lossy();
  };
  // order.vertices and order.cells contain the source number for each position in coding order.
  const bool keep = mesh.schema.order == Order::keep;
  const std::size_t xyz_bytes = 3 * scalar_bytes(mesh.schema.coordinate_type);
  std::vector<std::uint64_t> first_element(mesh.cells.size() + 1);
  int bad = 0;
  for (std::size_t i = 0; i < mesh.vertices; ++i) {
    const std::uint64_t source = order.vertices[i];
    bad += back->mesh.vertex_numbers[i] != (keep ? source : i);
    if (mesh.schema.coordinate_quantization.bits == 0)
      bad += std::memcmp(&back->mesh.xyz[i * xyz_bytes], &mesh.xyz[source * xyz_bytes],
                         xyz_bytes) != 0;
    for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a)
      if (mesh.schema.arrays[a].location == Location::point && is_exact(a))
        bad += std::memcmp(&back->mesh.arrays[a][i * mesh.stride(a)],
                           &mesh.arrays[a][source * mesh.stride(a)], mesh.stride(a)) != 0;
  }
  EXPECT_EQ(bad, 0) << "vertices differ";
  bad = 0;
  std::unordered_map<std::uint64_t, std::uint64_t> stream_number;
  for (std::size_t i = 0; i < mesh.vertices; ++i) stream_number[order.vertices[i]] = i;
  std::vector<char> finalized(mesh.vertices);
  const std::vector<OtherLastUse>& ended = back->mesh.other_last_uses;
  std::size_t other = 0;
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) {
    const TestCell& cell = mesh.cells[order.cells[i]];
    bad += back->mesh.cell_numbers[i] != (keep ? order.cells[i] : i);
    bad += back->mesh.cell_blocks[i] != cell.block;
    std::vector<std::uint64_t> expected = cell.corners;
    if (!keep)
      for (auto& v : expected) v = stream_number.at(v);
    const auto corners = std::span(back->mesh.corners)
                             .subspan(back->mesh.corner_begin[i],
                                      back->mesh.corner_begin[i + 1] - back->mesh.corner_begin[i]);
    const bool same = std::equal(expected.begin(), expected.end(), corners.begin(), corners.end());
    const bool may_turn = !mesh.schema.corner_order && corners.size() == 8 &&
                          mesh.schema.blocks[cell.block].shape == CellShape::hexahedron;
    bad += !(same || (may_turn && same_up_to_rotation(expected, corners)));
    for (std::size_t c = 0; c < corners.size(); ++c) {
      bad += finalized[corners[c]] != 0;
    }
    for (std::size_t c = 0; c < corners.size() && c < 64; ++c)
      if (back->mesh.last_use[i] >> c & 1) finalized[corners[c]] = 1;
    for (; other < ended.size() && ended[other].cell == i; ++other) {
      bad += finalized[ended[other].vertex] != 0;
      finalized[ended[other].vertex] = 1;
    }
  }
  EXPECT_EQ(bad, 0) << "cells differ";
  // In every order, value e of a cell array belongs to the e-th covered cell, i.e. the e-th cell of
  // the blocks on which the array is defined.
  for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a) {
    if (mesh.schema.arrays[a].location != Location::cell || !is_exact(a)) continue;
    std::vector<std::uint64_t> element(mesh.cells.size());
    std::uint64_t count = 0;
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
      if (mesh.schema.array_covers(a, mesh.cells[c].block)) element[c] = count++;
    bad = 0;
    std::uint64_t e = 0;
    for (std::uint64_t c : order.cells) {
      if (!mesh.schema.array_covers(a, mesh.cells[c].block)) continue;
      bad += std::memcmp(&back->mesh.arrays[a][e++ * mesh.stride(a)],
                         &mesh.arrays[a][element[c] * mesh.stride(a)], mesh.stride(a)) != 0;
    }
    EXPECT_EQ(bad, 0) << "array " << mesh.schema.arrays[a].name;
  }
  return std::move(sink.bytes);
}

// --- families of meshes

inline Schema hexahedra_schema(ScalarType type = ScalarType::float32) {
  Schema schema;
  schema.coordinate_type = type;
  schema.blocks.push_back({1, "hexahedra", CellShape::hexahedron, 8});
  return schema;
}

using Warp = std::array<double, 3> (*)(double, double, double);
inline std::array<double, 3> straight(double x, double y, double z) { return {x, y, z}; }
inline std::array<double, 3> warped(double x, double y, double z) {
  return {x + .05 * std::sin(5 * y + 3 * z), y + .06 * std::sin(4 * x + 2 * z) * std::cos(3 * y),
          z + .04 * std::cos(3 * x + 5 * y)};
}

/// Returns a grid of nx * ny * nz hexahedra that fills the unit cube, in scanline order. Cells for
/// which `skip(i, j, k)` returns true are omitted. Their vertices stay in the mesh, even if no
/// other cell uses them.
inline TestMesh grid(std::uint64_t nx, std::uint64_t ny, std::uint64_t nz,
                     ScalarType type = ScalarType::float32, Warp warp = straight,
                     bool (*skip)(std::uint64_t, std::uint64_t, std::uint64_t) = nullptr) {
  TestMesh mesh;
  mesh.schema = hexahedra_schema(type);
  std::vector<std::array<double, 3>> points;
  for (std::uint64_t k = 0; k <= nz; ++k)
    for (std::uint64_t j = 0; j <= ny; ++j)
      for (std::uint64_t i = 0; i <= nx; ++i)
        points.push_back(warp(static_cast<double>(i) / static_cast<double>(nx),
                              static_cast<double>(j) / static_cast<double>(ny),
                              static_cast<double>(k) / static_cast<double>(nz)));
  mesh.set_points(points);
  const auto v = [&](std::uint64_t i, std::uint64_t j, std::uint64_t k) {
    return i + (nx + 1) * (j + (ny + 1) * k);
  };
  for (std::uint64_t k = 0; k < nz; ++k)
    for (std::uint64_t j = 0; j < ny; ++j)
      for (std::uint64_t i = 0; i < nx; ++i) {
        if (skip != nullptr && skip(i, j, k)) continue;
        mesh.cells.push_back(
            {0,
             {v(i, j, k), v(i + 1, j, k), v(i + 1, j + 1, k), v(i, j + 1, k), v(i, j, k + 1),
              v(i + 1, j, k + 1), v(i + 1, j + 1, k + 1), v(i, j + 1, k + 1)}});
      }
  return mesh;
}

inline bool porous(std::uint64_t i, std::uint64_t j, std::uint64_t k) {
  return (i * 7 + j * 13 + k * 29) % 11 < 3;
}

/// Returns a cube of n * n * n hexahedra. Those that the function porous() selects are divided into
/// eight cells, and some of the resulting cells are divided again. A divided cell is removed, and
/// its eight parts are appended at the end. The new vertices in the middle of its edges, of its
/// faces and of the cell are not shared with other divided cells.
inline TestMesh cut_into_eight(std::uint64_t n, ScalarType type = ScalarType::float32) {
  constexpr std::array<std::array<std::size_t, 3>, 8> kCorners = {
      {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
  struct Piece {
    std::array<std::uint64_t, 3> place{};
    std::uint64_t size = 0;
    std::vector<std::uint64_t> corners;
    bool cut = false;
  };
  const std::uint64_t finest = 4;
  TestMesh mesh = grid(n, n, n, type);
  std::vector<std::array<std::uint64_t, 3>> places;
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    places.push_back(
        {v % (n + 1) * finest, v / (n + 1) % (n + 1) * finest, v / (n + 1) / (n + 1) * finest});
  std::vector<Piece> pieces;
  for (const TestCell& cell : mesh.cells)
    pieces.push_back({places[cell.corners[0]], finest, cell.corners});
  for (std::uint64_t size = finest; size > 1; size /= 2) {
    const std::size_t count = pieces.size();
    for (std::size_t p = 0; p < count; ++p) {
      const Piece whole = pieces[p];
      const auto& at = whole.place;
      if (whole.size != size || !porous(at[0] / size, at[1] / size, at[2] / size)) continue;
      pieces[p].cut = true;
      std::array<std::array<std::array<std::uint64_t, 3>, 3>, 3> vertex{};  // indexed by z, y and x
      for (std::size_t c = 0; c < 8; ++c)
        vertex[2 * kCorners[c][2]][2 * kCorners[c][1]][2 * kCorners[c][0]] = whole.corners[c];
      for (std::size_t z = 0; z < 3; ++z)
        for (std::size_t y = 0; y < 3; ++y)
          for (std::size_t x = 0; x < 3; ++x)
            if (x == 1 || y == 1 || z == 1) {
              vertex[z][y][x] = places.size();
              places.push_back({at[0] + x * size / 2, at[1] + y * size / 2, at[2] + z * size / 2});
            }
      for (std::size_t child = 0; child < 8; ++child) {
        const std::size_t x = child & 1, y = child >> 1 & 1, z = child >> 2;
        Piece piece{
            {at[0] + x * size / 2, at[1] + y * size / 2, at[2] + z * size / 2}, size / 2, {}};
        for (const auto& corner : kCorners)
          piece.corners.push_back(vertex[z + corner[2]][y + corner[1]][x + corner[0]]);
        pieces.push_back(std::move(piece));
      }
    }
  }
  mesh.cells.clear();
  for (Piece& piece : pieces)
    if (!piece.cut) mesh.cells.push_back({0, std::move(piece.corners)});
  std::vector<std::array<double, 3>> points;
  for (const auto& place : places)
    points.push_back({static_cast<double>(place[0]), static_cast<double>(place[1]),
                      static_cast<double>(place[2])});
  mesh.set_points(points);
  return mesh;
}

/// Returns a grid that is wrapped around an axis to form a ring. Its last layer meets its first
/// layer.
inline TestMesh ring(std::uint64_t around, std::uint64_t out, std::uint64_t up, ScalarType type) {
  TestMesh mesh;
  mesh.schema = hexahedra_schema(type);
  std::vector<std::array<double, 3>> points;
  for (std::uint64_t k = 0; k <= up; ++k)
    for (std::uint64_t j = 0; j <= out; ++j)
      for (std::uint64_t i = 0; i < around; ++i) {
        const double a = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(around);
        const double r = 1 + static_cast<double>(j) / static_cast<double>(out);
        points.push_back({r * std::cos(a), r * std::sin(a), static_cast<double>(k) * .1});
      }
  mesh.set_points(points);
  const auto v = [&](std::uint64_t i, std::uint64_t j, std::uint64_t k) {
    return i % around + around * (j + (out + 1) * k);
  };
  for (std::uint64_t k = 0; k < up; ++k)
    for (std::uint64_t j = 0; j < out; ++j)
      for (std::uint64_t i = 0; i < around; ++i)
        mesh.cells.push_back(
            {0,
             {v(i, j, k), v(i + 1, j, k), v(i + 1, j + 1, k), v(i, j + 1, k), v(i, j, k + 1),
              v(i + 1, j, k + 1), v(i + 1, j + 1, k + 1), v(i, j + 1, k + 1)}});
  return mesh;
}

inline void shuffle_cells(TestMesh& mesh, std::mt19937_64& random) {
  std::shuffle(mesh.cells.begin(), mesh.cells.end(), random);
}
/// Renumbers vertices at random.
inline void shuffle_vertices(TestMesh& mesh, std::mt19937_64& random) {
  std::vector<std::uint64_t> to(mesh.vertices);
  std::iota(to.begin(), to.end(), 0);
  std::shuffle(to.begin(), to.end(), random);
  const std::size_t bytes = 3 * scalar_bytes(mesh.schema.coordinate_type);
  std::vector<std::byte> moved(mesh.xyz.size());
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    std::memcpy(&moved[to[v] * bytes], &mesh.xyz[v * bytes], bytes);
  mesh.xyz = std::move(moved);
  for (TestCell& cell : mesh.cells)
    for (auto& v : cell.corners) v = to[v];
}
/// Rotates every hexahedron at random. If `mirror` is true, also reflects some of them.
inline void rotate_corners(TestMesh& mesh, std::mt19937_64& random, bool mirror) {
  constexpr std::array<std::array<std::size_t, 8>, 3> turns = {
      {{1, 2, 3, 0, 5, 6, 7, 4}, {4, 5, 1, 0, 7, 6, 2, 3}, {1, 5, 6, 2, 0, 4, 7, 3}}};
  for (TestCell& cell : mesh.cells) {
    if (cell.corners.size() != 8) continue;
    for (int n = static_cast<int>(random() % 6); n > 0; --n) {
      const auto old = cell.corners;
      const auto& turn = turns[random() % 3];
      for (std::size_t i = 0; i < 8; ++i) cell.corners[i] = old[turn[i]];
    }
    if (mirror && random() % 3 == 0)
      for (std::size_t i = 0; i < 4; ++i) std::swap(cell.corners[i], cell.corners[i + 4]);
  }
}

}  // namespace shm
