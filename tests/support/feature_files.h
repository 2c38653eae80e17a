// Feature files: small .shm files that together use every feature of the format. Their data is
// computed with integers and exact floating-point operations only, so the files are identical on
// every machine.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "shm/archive.h"
#include "shm/mesh.h"
#include "support/second_order_mesh.h"
#include "support/test_mesh.h"

namespace shm {

struct FeatureFile {
  std::string name;
  std::vector<std::byte> bytes;
};

/// Maps a point of the unit cube to a bent cube. The polynomials round identically on every
/// machine.
inline std::array<double, 3> bent(double x, double y, double z) {
  return {x + .125 * y * z, y + .25 * x * (1 - z), z - .0625 * x * y};
}

/// A random number generator whose results do not depend on the standard library.
class PlainRandom {
 public:
  explicit PlainRandom(std::uint64_t seed) : engine_(seed) {}
  std::uint64_t below(std::uint64_t end) { return engine_() % end; }
  std::uint64_t bits() { return engine_(); }
  template <class T>
  void shuffle(std::vector<T>& values) {
    for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[below(i)]);
  }

 private:
  std::mt19937_64 engine_;
};

inline ArrayInfo array_of(std::string name, Location location, ScalarType type,
                          std::uint32_t components = 1, std::vector<std::uint32_t> blocks = {}) {
  ArrayInfo info;
  info.name = std::move(name);
  info.location = location;
  info.type = type;
  info.components = components;
  info.blocks = std::move(blocks);
  return info;
}

inline void append_scalar(std::vector<std::byte>& to, ScalarType type, std::int64_t value) {
  if (type == ScalarType::float32) return append(to, static_cast<float>(value) * .25f);
  if (type == ScalarType::float64) return append(to, static_cast<double>(value) * .125);
  const std::size_t width = scalar_bytes(type);
  if (width == 1) return append(to, static_cast<std::int8_t>(value));
  if (width == 2) return append(to, static_cast<std::int16_t>(value));
  if (width == 4) return append(to, static_cast<std::int32_t>(value));
  append(to, value);
}

/// Adds a static array whose values vary slowly, with occasional jumps.
inline void add_array(TestMesh& mesh, ArrayInfo info, std::uint64_t elements) {
  PlainRandom random(mesh.schema.arrays.size() + 1);
  std::vector<std::byte> values;
  for (std::uint64_t i = 0; i < elements * info.components; ++i) {
    const bool leap = random.below(16) == 0;
    append_scalar(values, info.type,
                  static_cast<std::int64_t>(leap ? random.below(1000000) : i / 3));
  }
  mesh.schema.arrays.push_back(std::move(info));
  mesh.arrays.push_back(std::move(values));
}

inline TestMesh bent_grid(std::uint64_t nx, std::uint64_t ny, std::uint64_t nz,
                          ScalarType type = ScalarType::float32) {
  return grid(nx, ny, nz, type, bent);
}

inline TestMesh with_order(TestMesh mesh, Order order, bool corner_order, std::uint32_t delay) {
  mesh.schema.order = order;
  mesh.schema.corner_order = corner_order;
  mesh.schema.delay = delay;
  return mesh;
}

inline TestMesh shuffled(TestMesh mesh) {
  PlainRandom random(3);
  random.shuffle(mesh.cells);
  for (TestCell& cell : mesh.cells)  // rotates cells by multiples of 90 degrees around one axis
    for (std::uint64_t n = random.below(4); n > 0; --n) {
      std::rotate(cell.corners.begin(), cell.corners.begin() + 1, cell.corners.begin() + 4);
      std::rotate(cell.corners.begin() + 4, cell.corners.begin() + 5, cell.corners.begin() + 8);
    }
  return mesh;
}

inline void append_point(TestMesh& mesh, const std::array<double, 3>& point) {
  for (double v : point) {
    if (mesh.schema.coordinate_type == ScalarType::float32)
      append(mesh.xyz, static_cast<float>(v));
    else
      append(mesh.xyz, v);
  }
  ++mesh.vertices;
}

/// Returns a copy of `from` in which each cell has separate vertices. Several vertices are
/// therefore at the same point. At most points, these vertices have equal values in the array.
inline TestMesh broken(const TestMesh& from) {
  TestMesh mesh;
  mesh.schema = from.schema;
  mesh.schema.arrays = {array_of("velocity", Location::point, ScalarType::float32)};
  mesh.schema.arrays[0].components = 3;
  mesh.arrays.resize(1);
  const std::size_t bytes = from.xyz.size() / static_cast<std::size_t>(from.vertices);
  for (TestCell cell : from.cells) {
    for (std::uint64_t& corner : cell.corners) {
      const std::byte* xyz = &from.xyz[static_cast<std::size_t>(corner) * bytes];
      mesh.xyz.insert(mesh.xyz.end(), xyz, xyz + bytes);
      PlainRandom random(corner % 7 == 0 ? 1000 + mesh.vertices : corner);
      for (int c = 0; c < 3; ++c) append(mesh.arrays[0], static_cast<float>(random.below(1 << 20)));
      corner = mesh.vertices++;
    }
    mesh.cells.push_back(std::move(cell));
  }
  return mesh;
}

/// Returns a mesh whose cells share no vertices, and an array with few different values. Most
/// vertices therefore have the same values as an earlier vertex.
inline TestMesh copied_vertices() {
  TestMesh mesh = broken(bent_grid(6, 4, 3, ScalarType::float64));
  mesh.schema.arrays.push_back(array_of("few values", Location::point, ScalarType::float64, 2));
  mesh.arrays.emplace_back();
  PlainRandom random(11);
  std::array<double, 12> values;
  for (double& value : values) value = static_cast<double>(random.below(1 << 30)) / 3;
  for (std::uint64_t i = 0; i < 2 * mesh.vertices; ++i)
    append(mesh.arrays.back(), values[random.below(values.size())]);
  return mesh;
}

/// Returns a ring of hexahedra around an axis, whose last layer meets its first layer. All
/// coordinates are computed exactly.
inline TestMesh exact_ring(std::uint64_t around, std::uint64_t out, std::uint64_t up) {
  TestMesh mesh = ring(around, out, up, ScalarType::float64);
  std::vector<std::array<double, 3>> points;
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    points.push_back({static_cast<double>(v % around), static_cast<double>(v / around % (out + 1)),
                      static_cast<double>(v / around / (out + 1)) * .5});
  mesh.set_points(points);
  return mesh;
}

inline TestMesh mixed_cells() {
  TestMesh mesh;
  mesh.schema = hexahedra_schema(ScalarType::float64);
  mesh.schema.blocks.push_back({20, "quadratic", CellShape::hexahedron, 20});
  mesh.schema.blocks.push_back({-27, "triquadratic", CellShape::hexahedron, 27});
  mesh.schema.blocks.push_back({4, "tetrahedra", CellShape::tetrahedron, 4});
  mesh.schema.blocks.push_back({0, "polygons", CellShape::polygon, 0});
  mesh.schema.blocks.push_back({6, "no cells", CellShape::wedge, 6});
  PlainRandom random(4);
  std::vector<std::array<double, 3>> points(120);
  for (auto& p : points)
    p = {static_cast<double>(random.below(64)), static_cast<double>(random.below(64)), .5};
  mesh.set_points(points);
  constexpr std::array<std::size_t, 5> kNodes = {8, 20, 27, 4, 0};
  for (std::uint64_t c = 0; c < 24; ++c) {
    TestCell cell;
    cell.block = static_cast<std::uint32_t>(random.below(5));
    const std::size_t nodes = cell.block == 4 ? random.below(7) : kNodes[cell.block];
    for (std::size_t i = 0; i < nodes; ++i)
      cell.corners.push_back(random.below(8) == 0 ? random.below(120) : (c * 4 + i) % 120);
    mesh.cells.push_back(std::move(cell));
  }
  return mesh;
}

/// Returns connected cells of every shape: hexahedra, wedges on top of them, pyramids and
/// tetrahedra on top of the wedges, and polygons and lines on all of these. Some cells are
/// degenerate, and some have more nodes than corners.
inline TestMesh every_shape() {
  TestMesh mesh = grid(3, 3, 4, ScalarType::float64, bent);
  auto& blocks = mesh.schema.blocks;
  for (const auto& [shape, nodes] :
       std::initializer_list<std::pair<CellShape, std::uint32_t>>{{CellShape::wedge, 6},
                                                                  {CellShape::pyramid, 5},
                                                                  {CellShape::tetrahedron, 4},
                                                                  {CellShape::quad, 4},
                                                                  {CellShape::triangle, 3},
                                                                  {CellShape::line, 2},
                                                                  {CellShape::polygon, 0},
                                                                  {CellShape::tetrahedron, 10},
                                                                  {CellShape::other, 0}})
    blocks.push_back({static_cast<std::int64_t>(blocks.size()), "", shape, nodes});
  std::vector<TestCell> cells, flat;
  const auto part = [](std::uint32_t block, const std::vector<std::uint64_t>& v,
                       std::initializer_list<std::size_t> at) {
    TestCell cell{block, {}};
    for (std::size_t i : at) cell.corners.push_back(v[i]);
    return cell;
  };
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    const auto v = mesh.cells[c].corners;
    if (c < 9) {
      cells.push_back(mesh.cells[c]);
      flat.push_back(part(4, v, {0, 3, 2, 1}));
    } else if (c < 18) {
      cells.push_back(part(1, v, {0, 1, 2, 4, 5, 6}));
      cells.push_back(part(1, v, {0, 2, 3, 4, 6, 7}));
    } else if (c < 27) {
      cells.push_back(part(2, v, {0, 1, 2, 3, 6}));
      cells.push_back(part(2, v, {0, 4, 5, 1, 6}));
      cells.push_back(part(2, v, {0, 3, 7, 4, 6}));
    } else {
      for (const auto& at : std::initializer_list<std::initializer_list<std::size_t>>{
               {0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}})
        cells.push_back(part(3, v, at));
      flat.push_back(part(5, v, {4, 5, 6}));
      flat.push_back(part(6, v, {6, 7}));
    }
  }
  cells.insert(cells.end(), flat.begin(), flat.end());
  cells.push_back(part(1, cells[20].corners, {0, 1, 1, 3, 0, 4}));
  cells.push_back(part(3, cells[9].corners, {2, 2, 2, 2}));
  cells.push_back(cells[40]);
  TestCell many{7, {}}, quadratic{8, {}}, none{7, {}}, other{9, {1, 2, 1}};
  for (std::uint64_t i = 0; i < 90; ++i) many.corners.push_back((i * 7) % mesh.vertices);
  for (std::uint64_t i = 0; i < 10; ++i) quadratic.corners.push_back(70 + i);
  for (TestCell* cell : {&many, &quadratic, &none, &other}) cells.push_back(*cell);
  cells.push_back({7, {70, 71, 75, 74, 73}});
  mesh.cells = std::move(cells);
  return mesh;
}

/// Returns the node list of a polyhedron with these faces. In the list, each face ends by repeating
/// its first node.
inline std::vector<std::uint64_t> closed_faces(
    const std::vector<std::vector<std::uint64_t>>& faces) {
  std::vector<std::uint64_t> nodes;
  for (const auto& face : faces) {
    nodes.insert(nodes.end(), face.begin(), face.end());
    nodes.push_back(face.front());
  }
  return nodes;
}

/// For each face of a hexahedron: its four corners.
inline constexpr std::array<std::array<std::uint8_t, 4>, 6> kSixFaces = {
    {{0, 3, 2, 1}, {0, 4, 7, 3}, {0, 1, 5, 4}, {1, 2, 6, 5}, {3, 7, 6, 2}, {4, 5, 6, 7}}};

/// Returns the faces of a hexahedron, each with a random first corner and a random direction.
inline std::vector<std::vector<std::uint64_t>> hexahedron_faces(const std::vector<std::uint64_t>& v,
                                                                PlainRandom& random) {
  std::vector<std::vector<std::uint64_t>> faces;
  for (const auto& at : kSixFaces) {
    std::vector<std::uint64_t>& face = faces.emplace_back();
    for (const std::uint8_t i : at) face.push_back(v[i]);
    std::rotate(face.begin(), face.begin() + static_cast<std::ptrdiff_t>(random.below(4)),
                face.end());
    if (random.below(2) == 0) std::reverse(face.begin(), face.end());
  }
  random.shuffle(faces);
  return faces;
}

/// Returns a mesh with four kinds of cells: hexahedra stored as polyhedra in two blocks, polyhedra
/// that join two hexahedra, ordinary hexahedra, and cells whose node list does not describe faces.
inline TestMesh polyhedra() {
  TestMesh mesh = grid(4, 3, 4, ScalarType::float64, bent);
  auto& blocks = mesh.schema.blocks;
  blocks.push_back({1, "faces", CellShape::faces, 0});
  blocks.push_back({2, "six faces", CellShape::faces, 30});
  blocks.push_back({3, "vertices of faces", CellShape::polyhedron, 0});
  PlainRandom random(11);
  std::vector<TestCell> cells;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    const auto& v = mesh.cells[c].corners;
    if (c < 12) {
      cells.push_back(mesh.cells[c]);
    } else if (c < 24 && c % 2 == 0) {  // joins this cell and the next cell along x
      const auto faces = hexahedron_faces(v, random);
      const auto next = hexahedron_faces(mesh.cells[c + 1].corners, random);
      const auto same = [](std::vector<std::uint64_t> a, std::vector<std::uint64_t> b) {
        std::sort(a.begin(), a.end());
        std::sort(b.begin(), b.end());
        return a == b;
      };
      std::vector<std::vector<std::uint64_t>> all;
      for (const auto* some : {&faces, &next})
        for (const auto& face : *some)
          if (std::none_of(some == &faces ? next.begin() : faces.begin(),
                           some == &faces ? next.end() : faces.end(),
                           [&](const auto& other) { return same(face, other); }))
            all.push_back(face);
      cells.push_back({1, closed_faces(all)});
    } else if (c >= 24) {
      cells.push_back({c % 3 == 0 ? 2u : 1u, closed_faces(hexahedron_faces(v, random))});
    }
  }
  const std::vector<std::uint64_t> hexahedron = mesh.cells[0].corners;
  cells.push_back({1, {}});
  cells.push_back({1, hexahedron});
  cells.push_back({1, {3, 4, 3, 5, 5}});
  cells.push_back({1, {7, 8, 9, 8, 7}});
  cells.push_back({1, closed_faces({{3, 4, 5}, {90, 91, 92, 93, 94}})});
  cells.push_back({1, closed_faces({{3, 4, 5}, {5, 4, 3}, {4, 5, 3}})});
  cells.push_back({2, std::vector<std::uint64_t>(30, 6)});
  cells.push_back({3, hexahedron});
  mesh.cells = std::move(cells);
  return mesh;
}

inline TestMesh degenerate_hexahedra() {
  TestMesh mesh = bent_grid(3, 2, 2);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    auto& v = mesh.cells[c].corners;
    if (c % 5 == 0) v[3] = v[2], v[7] = v[6];                 // a wedge
    if (c % 5 == 1) v[5] = v[6] = v[7] = v[4];                // a pyramid
    if (c % 5 == 2) std::fill(v.begin() + 1, v.end(), v[0]);  // a point
    if (c % 5 == 3) std::swap(v[5], v[6]);                    // twisted
  }
  mesh.cells.push_back(mesh.cells[4]);  // the same cell again
  mesh.cells.push_back(mesh.cells[4]);
  return mesh;
}

/// Returns a mesh that exercises all cases of the replay codec: a grid with a hole, a second grid
/// whose cells are in the opposite order, degenerate cells, and cells of other shapes.
inline TestMesh replayed(Order order) {
  TestMesh mesh = mixed_cells();
  std::vector<TestCell> cells;
  const auto add = [&](TestMesh grid, std::uint64_t first) {
    for (TestCell& cell : grid.cells) {
      for (std::uint64_t& corner : cell.corners) corner = (corner + first) % mesh.vertices;
      cells.push_back(std::move(cell));
    }
  };
  add(grid(5, 3, 3, ScalarType::float64, straight, porous), 0);
  TestMesh turned = grid(4, 3, 2);
  std::reverse(turned.cells.begin(), turned.cells.end());
  add(turned, 40);
  add(degenerate_hexahedra(), 80);
  cells.insert(cells.end(), mesh.cells.begin(), mesh.cells.end());
  mesh.cells = std::move(cells);
  mesh = with_order(std::move(mesh), order, true, order == Order::keep ? 0 : 7);
  add_array(mesh, array_of("a", Location::cell, ScalarType::float32, 1, {0}),
            static_cast<std::uint64_t>(
                std::count_if(mesh.cells.begin(), mesh.cells.end(),
                              [](const TestCell& cell) { return cell.block == 0; })));
  return mesh;
}

/// Adds arrays of 17, 16, 16, 16, 16 and 13 components. The number of components with match tables
/// is limited, both for each array and for the whole mesh. Only the first three arrays of 16
/// components and the last array therefore use match tables.
inline TestMesh with_tables_for_some(TestMesh mesh) {
  for (const std::uint32_t components : {17, 16, 16, 16, 16, 13}) {
    std::string name = "a";
    name += std::to_string(mesh.schema.arrays.size());
    add_array(mesh, array_of(name, Location::point, ScalarType::uint8, components), mesh.vertices);
  }
  return mesh;
}

inline TestMesh with_arrays_of_every_type(TestMesh mesh) {
  for (int t = 1; t <= 10; ++t) {
    const auto type = static_cast<ScalarType>(t);
    const std::string name(scalar_name(type));
    add_array(mesh, array_of(name, Location::point, type, t % 3 + 1), mesh.vertices);
    add_array(mesh, array_of(name, Location::cell, type, t % 2 + 1), mesh.cells.size());
  }
  return mesh;
}

inline TestMesh arrays_on_some_blocks() {
  TestMesh mesh = bent_grid(3, 3, 1);
  mesh.schema.blocks.push_back({2, "others", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); c += 2) mesh.cells[c].block = 1;
  add_array(mesh, array_of("a", Location::cell, ScalarType::float32, 1, {1}),
            (mesh.cells.size() + 1) / 2);
  add_array(mesh, array_of("a", Location::cell, ScalarType::int16, 1, {0}), mesh.cells.size() / 2);
  ArrayInfo tags = array_of("tag", Location::point, ScalarType::int64);
  tags.role = "test:tag";
  add_array(mesh, tags, mesh.vertices);
  return mesh;
}

inline TestMesh quantized() {
  TestMesh mesh = bent_grid(3, 3, 2);
  mesh.schema.coordinate_quantization = {10, {0, 0, -.0625}, {1.125, 1.25, 1}};
  ArrayInfo info = array_of("q", Location::point, ScalarType::float64, 2);
  info.quantization = {
      7, {0, 0}, {20, 16}};  // the jumps are outside this box and are therefore stored exactly
  add_array(mesh, info, mesh.vertices);
  return mesh;
}

/// Returns a file with error bounds on its coordinates, on a point array with special values, and
/// on a stepped cell array.
inline std::vector<std::byte> bounded_file() {
  const TestMesh from = bent_grid(3, 2, 2, ScalarType::float64);
  Mesh mesh = mesh_from(from);
  mesh.schema.coordinate_quantization = Quantization::absolute(.015625, 3);
  mesh.schema.arrays.push_back(array_of("p", Location::point, ScalarType::float32, 2));
  mesh.schema.arrays.push_back(array_of("c", Location::cell, ScalarType::float64));
  for (ArrayInfo& info : mesh.schema.arrays)
    info.quantization = Quantization::absolute(.25, info.components);
  mesh.schema.arrays[1].quantization.spacing = .375;
  mesh.schema.arrays[1].quantization.minimum[0] = -1;
  mesh.schema.arrays[1].per_step = true;
  constexpr std::array<std::uint32_t, 5> kOdd = {0x80000000, 0x7fc00123, 0x7f800000, 0xff800000,
                                                 0x7f7fffff};
  mesh.arrays.resize(2);
  mesh.steps.resize(2);
  for (std::uint32_t i = 0; i < 2 * from.vertices; ++i)
    append(mesh.arrays[0],
           i % 10 == 3 ? std::bit_cast<float>(kOdd[i / 10 % 5]) : static_cast<float>(i * i) / 16);
  for (int step = 0; step < 2; ++step) {
    mesh.steps[1].emplace_back();
    for (std::size_t c = 0; c < from.cells.size(); ++c)
      append(mesh.steps[1].back(), static_cast<double>(c) * .7 + step);
  }
  mesh.step_times = {0, 1};
  MemorySink sink;
  EXPECT_TRUE(write_mesh(sink, mesh, with_writer_digests()));
  return std::move(sink.bytes);
}

inline TestMesh special_values() {
  TestMesh mesh = bent_grid(2, 2, 2, ScalarType::float64);
  constexpr std::array<std::uint64_t, 7> kOdd = {
      0x8000000000000000, 0x7ff8000000000000, 0xfff4000000000123, 0x7ff0000000000000,
      0xfff0000000000000, 0x0000000000000001, 0x7fefffffffffffff};
  for (std::size_t i = 0; i < kOdd.size(); ++i) std::memcpy(&mesh.xyz[i * 40], &kOdd[i], 8);
  return mesh;
}

/// Returns random values for the vertices or cells of a grid that is 5 cells wide. On opposite
/// sides of a mirror plane, values differ only in sign and in their last bits.
inline std::vector<std::byte> mirrored_noise(std::uint64_t count, bool of_cells,
                                             std::uint64_t seed) {
  const std::uint64_t row = of_cells ? 5 : 6;
  std::vector<std::byte> bytes;
  for (std::uint64_t v = 0; v < count; ++v) {
    const std::uint64_t x = v % row;
    const bool behind = 2 * x >= row;
    PlainRandom random(1000 * seed + 6 * (v / row) + (behind ? row - 1 - x : x));
    const double size = 1 + static_cast<double>(random.below(1 << 30)) / (1 << 30) / 3;
    const double value = behind ? -size * (1 + static_cast<double>(v % 3) * 0x1p-50) : size;
    if (of_cells)
      append(bytes, static_cast<float>(value));
    else
      append(bytes, value);
  }
  return bytes;
}

/// Returns a file with a static array that repeats earlier values, and with stepped arrays in which
/// elements have partners. The partner of an element is an earlier element whose value at the
/// reference step has about the same magnitude.
inline std::vector<std::byte> mirrored_file(Level level) {
  TestMesh mesh = bent_grid(5, 4, 3);
  mesh.schema.arrays.push_back(array_of("s", Location::point, ScalarType::float64));
  mesh.arrays.push_back(mirrored_noise(mesh.vertices, false, 0));
  for (const auto& [name, where, type] : {std::tuple("u", Location::point, ScalarType::float64),
                                          std::tuple("q", Location::cell, ScalarType::float32)}) {
    ArrayInfo info = array_of(name, where, type);
    info.per_step = true;
    mesh.schema.arrays.push_back(info);
  }
  MemorySink sink;
  WriteOptions options;
  options.level = level;
  options.group_cells = 40;
  EXPECT_TRUE(write_mesh(mesh, sink, options, [&](Writer& writer) -> Result<void> {
    for (std::uint64_t step = 0; step < 3; ++step)
      for (const bool of_cells : {false, true})
        if (auto status = writer.add_step_values(
                of_cells ? 2 : 1, step,
                mirrored_noise(of_cells ? mesh.cells.size() : mesh.vertices, of_cells, step + 1));
            !status)
          return status;
    return {};
  }));
  return std::move(sink.bytes);
}

/// Returns a file with an extra that lists faces of four vertices each. The extra is large enough
/// to be split into byte planes.
inline std::vector<std::byte> large_extras_file() {
  TestMesh mesh = bent_grid(2, 2, 2);
  MemorySink sink;
  auto writer = Writer::create(sink, mesh.schema, with_writer_digests());
  EXPECT_TRUE(writer);
  Extra faces{"test/faces", ScalarType::int64, Reference::vertex, {2100, 4}, {}};
  for (std::int64_t i = 0; i < 8400; ++i) append(faces.data, i / 4 * 7 % 27 - i % 4 / 3);
  EXPECT_TRUE(writer->add_extra(faces));
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    EXPECT_TRUE(writer->add_vertex(v, std::span(mesh.xyz).subspan(v * 12, 12)));
  for (const TestCell& cell : mesh.cells) EXPECT_TRUE(writer->add_cell(0, cell.corners));
  EXPECT_TRUE(writer->end_mesh());
  EXPECT_TRUE(writer->finish());
  return std::move(sink.bytes);
}

/// Returns a file of a grid with stepped arrays, step times and extras.
inline std::vector<std::byte> steps_and_extras_file(Order order, std::uint32_t key_steps = 8) {
  TestMesh mesh = with_order(bent_grid(2, 2, 3), order, true, 0);
  for (const auto& [name, where, type] : {std::tuple("u", Location::point, ScalarType::float64),
                                          std::tuple("p", Location::cell, ScalarType::float32),
                                          std::tuple("n", Location::cell, ScalarType::uint16)}) {
    ArrayInfo info = array_of(name, where, type, where == Location::point ? 3 : 1);
    info.per_step = true;
    mesh.schema.arrays.push_back(info);
  }
  MemorySink sink;
  WriteOptions options;
  options.key_steps = key_steps;
  options.waiting_bytes = 0;  // no bundles
  auto writer = Writer::create(sink, mesh.schema, with_writer_digests(options));
  EXPECT_TRUE(writer);
  const auto text = std::as_bytes(std::span("a name", 6));
  EXPECT_TRUE(writer->add_extra(
      {"test/text", ScalarType::uint8, Reference::nothing, {6}, {text.begin(), text.end()}}));
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    EXPECT_TRUE(writer->add_vertex(v, std::span(mesh.xyz).subspan(v * 12, 12)));
  for (const TestCell& cell : mesh.cells) EXPECT_TRUE(writer->add_cell(0, cell.corners));
  EXPECT_TRUE(writer->end_mesh());
  PlainRandom random(6);
  for (std::uint64_t step : {0u, 1u, 3u})
    for (std::uint32_t a = 0; a < 3; ++a) {
      const ArrayInfo& info = mesh.schema.arrays[a];
      const std::uint64_t elements = a == 0 ? mesh.vertices : mesh.cells.size();
      std::vector<std::byte> values;
      for (std::uint64_t i = 0; i < elements * info.components; ++i)
        append_scalar(values, info.type,
                      static_cast<std::int64_t>(a == 1 ? random.below(1 << 20) : i * step));
      EXPECT_TRUE(writer->add_step_values(a, step, values));
    }
  const std::vector<double> times = {0, .5, 1, 2};
  EXPECT_TRUE(writer->set_step_times(times));
  Extra set{"test/set", ScalarType::int64, Reference::vertex, {2, 2}, {}};
  for (std::int64_t v : {0, 5, 7, -1}) append(set.data, v);
  EXPECT_TRUE(writer->add_extra(set));
  EXPECT_TRUE(
      writer->add_extra({"test/nothing", ScalarType::float32, Reference::nothing, {3, 0}, {}}));
  std::vector<std::byte> long_text(300, std::byte{'x'});
  EXPECT_TRUE(
      writer->add_extra({"test/long", ScalarType::uint8, Reference::nothing, {300}, long_text}));
  EXPECT_TRUE(writer->finish());
  return std::move(sink.bytes);
}

/// Returns a file in which some vertices are never marked as finalized, and other vertices are not
/// used by any cell.
inline std::vector<std::byte> unmarked_file() {
  const TestMesh mesh = grid(2, 2, 1, ScalarType::float64, bent);
  MemorySink sink;
  auto writer = Writer::create(sink, mesh.schema, with_writer_digests());
  EXPECT_TRUE(writer);
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    EXPECT_TRUE(writer->add_vertex(v * 1000, std::span(mesh.xyz).subspan(v * 24, 24)));
  for (std::size_t c = 0; c < 2; ++c) {
    auto corners = mesh.cells[c].corners;
    for (auto& corner : corners) corner *= 1000;
    EXPECT_TRUE(writer->add_cell(0, corners));
  }
  EXPECT_TRUE(writer->end_mesh());
  EXPECT_TRUE(writer->finish());
  return std::move(sink.bytes);
}

inline std::vector<std::byte> written(const TestMesh& mesh, std::uint32_t group_cells = 65536,
                                      ConnectivityCodec codec = ConnectivityCodec::rows,
                                      Level level = Level::standard) {
  MemorySink sink;
  WriteOptions options;
  options.level = level;
  options.group_cells = group_cells;
  options.connectivity = codec;
  const auto report = write_mesh(mesh, sink, options);
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return std::move(sink.bytes);
}

/// Returns a file with values at vertices and cells. It is divided into segments of `cells` cells,
/// each of which has several groups.
inline std::vector<std::byte> segments_file(Order order, bool corner_order, std::uint32_t delay,
                                            std::uint64_t cells) {
  TestMesh mesh =
      with_order(grid(3, 4, 3, ScalarType::float32, bent, porous), order, corner_order, delay);
  add_array(mesh, array_of("u", Location::point, ScalarType::int16, 2), mesh.vertices);
  add_array(mesh, array_of("p", Location::cell, ScalarType::float32), mesh.cells.size());
  MemorySink sink;
  WriteOptions options;
  options.group_cells = 4;
  options.segment_cells = cells;
  options.segment_connectivity = {ConnectivityCodec::rows, ConnectivityCodec::rows,
                                  ConnectivityCodec::replay, ConnectivityCodec::paper};
  EXPECT_TRUE(write_mesh(mesh, sink, options));
  return std::move(sink.bytes);
}

/// Returns a file of two segments with stepped arrays at vertices and cells. The cells are coded
/// with `codec`.
inline std::vector<std::byte> steps_over(ConnectivityCodec codec, Level level) {
  TestMesh mesh = bent_grid(4, 3, 4);
  for (const Location location : {Location::point, Location::cell}) {
    ArrayInfo info = array_of("w", location, ScalarType::float32);
    info.per_step = true;
    mesh.schema.arrays.push_back(info);
    mesh.arrays.emplace_back();
  }
  MemorySink sink;
  WriteOptions options;
  options.group_cells = 12;
  options.segment_cells = 24;
  options.connectivity = codec;
  options.level = level;
  const auto steps = [&](Writer& writer) -> Result<void> {
    for (const std::uint32_t array : {0u, 1u})
      for (std::uint64_t step = 0; step < 3; ++step) {
        std::vector<std::byte> values;
        const std::uint64_t elements = array == 0 ? mesh.vertices : mesh.cells.size();
        for (std::uint64_t e = 0; e < elements; ++e)
          append(values, static_cast<float>(e * e % 100 + 3 * step));
        if (auto status = writer.add_step_values(array, step, values); !status) return status;
      }
    return {};
  };
  EXPECT_TRUE(write_mesh(mesh, sink, options, steps));
  return std::move(sink.bytes);
}

/// Returns a file with digests: several segments and groups, static and stepped arrays at vertices
/// and cells, a bundle, bounded arrays, and step times.
inline std::vector<std::byte> digests_file(Order order, Level level) {
  TestMesh mesh = with_order(shuffled(grid(3, 4, 3, ScalarType::float32, bent, porous)), order,
                             true, order == Order::free ? 0 : 3);
  add_array(mesh, array_of("u", Location::point, ScalarType::int16, 2), mesh.vertices);
  add_array(mesh, array_of("p", Location::cell, ScalarType::float32), mesh.cells.size());
  mesh.schema.arrays[1].quantization = Quantization::absolute(.01, 1);
  const auto add_stepped = [&](ArrayInfo info) {
    info.per_step = true;
    mesh.schema.arrays.push_back(std::move(info));
    mesh.arrays.emplace_back();
  };
  add_stepped(array_of("v", Location::point, ScalarType::float64, 2));
  add_stepped(array_of("w", Location::cell, ScalarType::float32));
  mesh.schema.arrays.back().quantization = Quantization::relative(.001, ScalarType::float32);
  add_stepped(array_of("energy", Location::global, ScalarType::float64));
  mesh.schema.arrays.back().elements = 1;
  const auto value = [](std::uint64_t array, std::uint64_t i, std::uint64_t step) {
    if (i % 11 == 3) return -0.0;
    if (i % 11 == 7) return std::bit_cast<double>(0x7ff8000000000000u + i + step);
    return 1.5 * static_cast<double>(i % 17) + .25 * static_cast<double>(step * step + array);
  };
  WriteOptions options;
  options.level = level;
  options.group_cells = 5;
  options.segment_cells = 13;
  MemorySink sink;
  const bool digests = std::exchange(writer_digests, true);
  EXPECT_TRUE(write_mesh(mesh, sink, options, [&](Writer& writer) -> Result<void> {
    const std::uint64_t elements[] = {mesh.vertices, mesh.cells.size(), 1};
    for (std::uint64_t step = 0; step < 5; ++step)
      for (std::uint32_t array = 2; array < 5; ++array) {
        const ArrayInfo& info = mesh.schema.arrays[array];
        std::vector<std::byte> values;
        for (std::uint64_t i = 0; i < elements[array - 2] * info.components; ++i)
          if (info.type == ScalarType::float64)
            append(values, value(array, i, step));
          else
            append(values, static_cast<float>(value(array, i, step)));
        if (auto status = writer.add_step_values(array, step, values); !status) return status;
      }
    const std::array<double, 5> times{0, .25, .5, 1, 4};
    return writer.set_step_times(times);
  }));
  writer_digests = digests;
  return std::move(sink.bytes);
}

/// Returns a file whose values change if a decoder rounds predictions in another way: doubles with
/// all their digits, in a mesh with enough cells for fitted weights.
inline std::vector<std::byte> rounding_file(Level level) {
  TestMesh mesh =
      level == Level::fast ? second_order_cells() : bent_grid(8, 6, 5, ScalarType::float64);
  const auto wave = [](std::uint64_t i, std::uint64_t step) {
    const double x = static_cast<double>(i % 9) / 7, y = static_cast<double>(i / 9 % 7) / 9;
    const double z = static_cast<double>(i / 63) / 11, t = static_cast<double>(step) / 13;
    return ((x - t) * (y + 1.1) - z * z) / (1.3 + x * y + z * t) + .01 * t;
  };
  ArrayInfo info = array_of("v", Location::point, ScalarType::float64);
  mesh.schema.arrays.push_back(info);
  std::vector<std::byte>& values = mesh.arrays.emplace_back();
  for (std::uint64_t i = 0; i < mesh.vertices; ++i) append(values, wave(i, 3));
  info.name = "w";
  info.per_step = true;
  mesh.schema.arrays.push_back(info);
  mesh.arrays.emplace_back();
  WriteOptions options;
  options.level = level;
  options.waiting_bytes = 0;
  options.slow_step_values = level == Level::best ? options.slow_step_values : 0;
  MemorySink sink;
  EXPECT_TRUE(write_mesh(mesh, sink, options, [&](Writer& writer) -> Result<void> {
    for (std::uint64_t step = 0; step < 4; ++step) {
      std::vector<std::byte> of_step;
      for (std::uint64_t i = 0; i < mesh.vertices; ++i) append(of_step, wave(i, step));
      if (auto status = writer.add_step_values(1, step, of_step); !status) return status;
    }
    return {};
  }));
  return std::move(sink.bytes);
}

/// Appends a number as a scalar of this type.
inline void append_number(std::vector<std::byte>& values, ScalarType type, double number) {
  if (type == ScalarType::float64)
    append(values, number);
  else if (type == ScalarType::float32)
    append(values, static_cast<float>(number));
  else
    append_scalar(values, type, static_cast<std::int64_t>(number));
}

/// Returns a file of `mesh` with stepped arrays at the steps 0 to `steps` - 1.
/// value(array, scalar, step) returns a value; `scalar` counts the components of all elements. If
/// it returns nullopt for the first scalar, the array has no values at this step.
inline std::vector<std::byte> written_with_steps(
    TestMesh mesh, const std::vector<ArrayInfo>& arrays, const WriteOptions& options,
    std::uint64_t steps,
    const std::function<std::optional<double>(std::uint32_t, std::uint64_t, std::uint64_t)>&
        value) {
  for (const ArrayInfo& info : arrays) {
    mesh.schema.arrays.push_back(info);
    mesh.schema.arrays.back().per_step = true;
    mesh.arrays.emplace_back();
  }
  const auto add_step = [&](Writer& writer, std::uint32_t array, std::uint64_t step) {
    const ArrayInfo& info = arrays[array];
    std::uint64_t elements = info.location == Location::point ? mesh.vertices : mesh.cells.size();
    if (!is_on_mesh(info.location))
      elements = info.elements;
    else if (!info.blocks.empty())
      elements = static_cast<std::uint64_t>(
          std::count_if(mesh.cells.begin(), mesh.cells.end(), [&](const TestCell& cell) {
            return std::binary_search(info.blocks.begin(), info.blocks.end(), cell.block);
          }));
    std::vector<std::byte> values;
    for (std::uint64_t i = 0; i < elements * info.components; ++i) {
      const auto number = value(array, i, step);
      if (!number) return Result<void>();
      append_number(values, info.type, *number);
    }
    return writer.add_step_values(array, step, values);
  };
  MemorySink sink;
  EXPECT_TRUE(write_mesh(mesh, sink, options, [&](Writer& writer) -> Result<void> {
    for (std::uint64_t step = 0; step < steps; ++step)
      for (std::uint32_t array = 0; array < arrays.size(); ++array)
        if (auto status = add_step(writer, array, step); !status) return status;
    return {};
  }));
  return std::move(sink.bytes);
}

/// Returns a file of a small mesh with many arrays at twelve steps, all in bundles. The columns of
/// these arrays have every form, every shape, and every kind of values. One array lacks some steps,
/// so it has parts of its own.
inline std::vector<std::byte> bundles_file(Order order, Level level) {
  const auto wave = [](std::uint64_t e, std::uint64_t step) {
    return 3.0 + .25 * static_cast<double>(e) + .125 * static_cast<double>(step * step);
  };
  const auto noise = [](std::uint64_t e, std::uint64_t step) {
    return static_cast<double>((e * 7919 + step * 104729 + 17) * 2654435761u % 1000003) * 0x1p-10;
  };
  struct Made {
    ArrayInfo info;
    std::function<double(std::uint64_t element, std::uint64_t component, std::uint64_t step)> value;
  };
  using enum Location;
  using enum ScalarType;
  ArrayInfo bounded = array_of("bounded", point, float64);
  bounded.quantization = Quantization::absolute(.01, 1);
  const std::vector<Made> all = {
      {array_of("zero", point, float64), [](auto, auto, auto) { return 0.0; }},
      {array_of("constant", cell, float32, 2), [](auto, auto c, auto) { return 1.5 + double(c); }},
      {array_of("wave", point, float64), [&](auto e, auto, auto s) { return wave(e, s); }},
      {array_of("equal", point, float64), [&](auto e, auto, auto s) { return wave(e, s); }},
      {array_of("fixed", cell, float64), [&](auto e, auto, auto) { return noise(e, 0); }},
      {array_of("uniform", cell, float32), [&](auto, auto, auto s) { return noise(0, s); }},
      {array_of("tensor", cell, float32, 9),
       [&](auto e, auto c, auto s) { return noise(e, s) * double(c / 3 + c % 3); }},
      {array_of("decimal", point, float64, 3),
       [](auto e, auto c, auto s) { return double((e * 31 + s * 7 + c) % 199) / 100; }},
      {array_of("whole", cell, int32), [](auto e, auto, auto s) { return double(e * s) - 20; }},
      {array_of("bytes", point, uint8, 2),
       [](auto e, auto c, auto s) { return double((e + s * c) % 251); }},
      {array_of("noise", point, float64), [&](auto e, auto, auto s) { return noise(e, s) / 3; }},
      {bounded, [&](auto e, auto, auto s) { return noise(e, s) / 7; }},
      {array_of("sometimes", cell, float64), [&](auto e, auto, auto s) { return wave(e, s); }},
  };
  std::vector<ArrayInfo> arrays;
  for (const Made& it : all) arrays.push_back(it.info);
  WriteOptions options;
  options.level = level;
  const auto value = [&](std::uint32_t array, std::uint64_t scalar,
                         std::uint64_t step) -> std::optional<double> {
    if (array + 1 == all.size() && step % 3 == 1) return std::nullopt;
    const std::uint32_t components = arrays[array].components;
    return all[array].value(scalar / components, scalar % components, step);
  };
  return written_with_steps(with_order(bent_grid(2, 2, 1), order, true, 0), arrays, options, 12,
                            value);
}

/// Returns a file of a small mesh with arrays at six steps, in a bundle. Most columns are multiples
/// of other columns. One array contains NaN.
inline std::vector<std::byte> scaled_bundle_file() {
  const auto noise = [](std::uint64_t scalar, std::uint64_t step) {
    return static_cast<double>((scalar * 7919 + step * 104729 + 17) * 2654435761u % 1000003) / 3;
  };
  const std::vector<double> factors = {1, -1, 1.5, -1e-3, 0x1p-40, 1};
  std::vector<ArrayInfo> arrays;
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (std::size_t a = 0; a < factors.size(); ++a)
      arrays.push_back(array_of("a" + std::to_string(arrays.size()), Location::point, type));
  const auto value = [&](std::uint32_t array, std::uint64_t scalar,
                         std::uint64_t step) -> std::optional<double> {
    const double own = noise(scalar, step);
    // The factors apply to the values that are stored.
    const double stored =
        array < factors.size() ? static_cast<double>(static_cast<float>(own)) : own;
    if (array % factors.size() == 5 && scalar == 3) return std::nan("");
    return stored * factors[array % factors.size()];
  };
  return written_with_steps(bent_grid(2, 2, 1), arrays, {}, 6, value);
}

/// Returns a file with random step values that all change by the same amount from one step to the
/// next. The values are coded as differences between steps, with the codec `terms`.
inline std::vector<std::byte> steps_that_rise() {
  WriteOptions options;
  options.group_cells = 80;
  options.connectivity = ConnectivityCodec::patterns;
  options.level = Level::fast;
  std::uint32_t noise = 7;
  const auto value = [&](std::uint32_t array, std::uint64_t scalar, std::uint64_t step) {
    noise = (scalar == 0 ? 7 : noise) * 1664525 + 1013904223;
    // All values are between 64 and 100. In this range, the spacing of floating-point numbers is
    // constant.
    const double rising = 64 + static_cast<double>(noise) * 0x1p-27 +
                          static_cast<double>(step) * 1.375 +
                          static_cast<double>(scalar / 7) * 0x1p-16;
    return array == 0 ? rising : rising / 3;
  };
  return written_with_steps(bent_grid(6, 5, 4),
                            {array_of("p", Location::point, ScalarType::float32),
                             array_of("c", Location::cell, ScalarType::float64, 3)},
                            options, 3, value);
}

/// Returns a file with quantized stepped arrays in several groups. Their values change slowly, so
/// the steps refer to earlier steps. Some values are not finite, and some are too large to be
/// quantized.
inline std::vector<std::byte> bounded_steps_file(Level level) {
  const TestMesh mesh = bent_grid(6, 5, 4);
  ArrayInfo points = array_of("p", Location::point, ScalarType::float32, 2);
  ArrayInfo cells = array_of("c", Location::cell, ScalarType::float64);
  points.quantization = Quantization::absolute(.125, 2);
  cells.quantization = Quantization::absolute(.015625, 1);
  WriteOptions options;
  options.group_cells = 80;
  options.level = level;
  options.waiting_bytes = 0;  // no bundles
  PlainRandom random(8);
  std::vector<double> start(2 * mesh.vertices + mesh.cells.size());
  for (double& value : start) value = static_cast<double>(random.below(1 << 16)) * .03125;
  const auto value = [&](std::uint32_t, std::uint64_t scalar, std::uint64_t step) {
    const double noise = static_cast<double>(random.below(64)) * .00390625;
    if (scalar % 71 == 3) return 0x1p100;
    if (scalar % 67 == 9) return -0.0;
    if (scalar % 61 == 7) return std::numeric_limits<double>::quiet_NaN();
    return start[scalar] + 1.4375 * static_cast<double>(step * (scalar % 3)) + noise;
  };
  return written_with_steps(mesh, {points, cells}, options, 4, value);
}

/// Returns a random number from 0 to 1 for an element and a step.
inline double random_share(std::uint64_t element, std::uint64_t step) {
  std::uint64_t mixed = (element + 1000 * step + 1) * 0x9e3779b97f4a7c15u;
  mixed = (mixed ^ mixed >> 30) * 0xbf58476d1ce4e5b9u;
  return static_cast<double>((mixed ^ mixed >> 31) >> 52) * 0x1p-12;
}

/// Returns a file with stepped arrays that have error bounds relative to each value: values of both
/// signs and all magnitudes, zeros, denormals, infinities and NaN.
inline std::vector<std::byte> relative_bounds_file(Level level, std::uint64_t waiting_bytes = 0) {
  ArrayInfo points = array_of("p", Location::point, ScalarType::float32, 2);
  ArrayInfo cells = array_of("c", Location::cell, ScalarType::float64);
  ArrayInfo fine = array_of("fine", Location::point, ScalarType::float64);
  points.quantization = Quantization::relative(.0009765625, points.type);
  cells.quantization = Quantization::relative(.25, cells.type);
  fine.quantization = Quantization::relative(1e-10, fine.type);
  WriteOptions options;
  options.group_cells = waiting_bytes > 0 ? 65536 : 50;
  options.segment_cells = 80;
  options.level = level;
  options.waiting_bytes = waiting_bytes;
  options.slow_step_values = 0;
  const auto value = [](std::uint32_t array, std::uint64_t scalar,
                        std::uint64_t step) -> std::optional<double> {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    const double v = (1 + random_share(scalar, 0)) * (1 + .125 * double(step)) +
                     .00048828125 * random_share(scalar, step + 1);
    if (scalar % 71 == 3) return array == 0 ? 0x1p-140 * v : 0x1p-1060 * v;
    if (scalar % 67 == 9) return scalar % 2 == 0 ? 0.0 : -0.0;
    if (scalar % 61 == 7) return step % 2 == 0 ? -kInfinity : kInfinity;
    if (scalar % 53 == 5) return 0x1p100 * v;
    return scalar % 5 == 4 ? -v : v;
  };
  return written_with_steps(bent_grid(6, 5, 4), {points, cells, fine}, options, 4, value);
}

/// Returns a grid with static arrays that have error bounds relative to each value.
inline TestMesh relative_bounds() {
  TestMesh mesh = bent_grid(6, 4, 3);
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (const Location location : {Location::point, Location::cell}) {
      ArrayInfo info = array_of("r" + std::to_string(mesh.schema.arrays.size()), location, type, 2);
      info.quantization = Quantization::relative(.001, type);
      add_array(mesh, info, location == Location::point ? mesh.vertices : mesh.cells.size());
    }
  return mesh;
}

/// Returns a grid with arrays in which fill values, NaN and infinities are in runs, scattered, in
/// all components of an element or in some, and in all elements. Some of the arrays are quantized.
inline TestMesh filled(int rows, int layers) {
  TestMesh mesh = bent_grid(rows, 4, layers);
  const auto add = [&](const char* name, Location location, ScalarType type,
                       std::uint32_t components, std::vector<double> fills, double bound,
                       const std::function<double(std::uint64_t, double)>& value) {
    ArrayInfo info = array_of(name, location, type, components);
    info.fills = std::move(fills);
    if (bound > 0) info.quantization = Quantization::absolute(bound, components);
    std::vector<std::byte> values;
    const std::uint64_t count = location == Location::point ? mesh.vertices : mesh.cells.size();
    for (std::uint64_t i = 0; i < count * components; ++i) {
      const double v = value(i, 300 + .03125 * static_cast<double>(i % 97) * double(i / 97));
      append_number(values, type, v);
    }
    mesh.schema.arrays.push_back(std::move(info));
    mesh.arrays.push_back(std::move(values));
  };
  using enum Location;
  using enum ScalarType;
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double nan = std::bit_cast<double>(std::uint64_t{0x7ff8000000000001});
  add("runs", point, float64, 1, {0x1p122, -9999}, .0625, [](std::uint64_t i, double v) {
    return i % 29 < 7 ? 0x1p122 : i % 29 == 20 ? -9999 : v;
  });
  add("scattered", point, float32, 3, {}, 0, [&](std::uint64_t i, double v) {
    return i % 11 == 4 ? nan : i % 31 == 5 ? -kInfinity : v;
  });
  add("whole elements", cell, float64, 2, {-1}, 0, [&](std::uint64_t i, double v) {
    return i / 2 % 5 == 2 ? -1 : i % 37 == 0 ? kInfinity : v;
  });
  add("nothing else", cell, float32, 1, {}, .5, [&](auto, auto) { return nan; });
  return mesh;
}

/// Returns a file with stepped arrays that have special values. Some are at the same elements at
/// all steps, others move. Some arrays are quantized.
inline std::vector<std::byte> filled_steps(Level level, std::uint64_t waiting_bytes = 0) {
  ArrayInfo fixed = array_of("fixed", Location::point, ScalarType::float32, 2);
  ArrayInfo moving = array_of("moving", Location::cell, ScalarType::float64);
  ArrayInfo exact = array_of("exact", Location::point, ScalarType::float64);
  fixed.fills = {-9999};
  fixed.quantization = Quantization::absolute(.125, 2);
  moving.quantization = Quantization::absolute(.015625, 1);
  WriteOptions options;
  options.group_cells = waiting_bytes > 0 ? 65536 : 60;  // bundles need a single group
  options.level = level;
  options.waiting_bytes = waiting_bytes;
  const auto value = [](std::uint32_t array, std::uint64_t scalar, std::uint64_t step) {
    const double v = 20 + .0078125 * static_cast<double>(scalar * scalar % 8191 + 77 * step);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    if (array == 0) return scalar % 23 < 8 ? -9999 : v;
    if (array == 1) return (scalar + 5 * step) % 31 < 6 ? kInfinity : v;
    return step == 2 || scalar % 13 == 6 ? -kInfinity : v;
  };
  return written_with_steps(bent_grid(5, 4, 4), {fixed, moving, exact}, options, 5, value);
}

/// Returns a file with stepped arrays that are coded with the codec `weighted`. There are several
/// groups and segments, arrays of every kind of domain, an array that covers one block, and rounded
/// values with exceptions.
inline std::vector<std::byte> weighted_steps() {
  using enum Location;
  using enum ScalarType;
  TestMesh mesh = bent_grid(8, 6, 5);
  mesh.schema.blocks.push_back({2, "", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    if (c % 8 >= 4) mesh.cells[c].block = 1;
  ArrayInfo bounded = array_of("bounded", point, float32);
  bounded.quantization = Quantization::absolute(.25, 1);
  ArrayInfo in_part = array_of("in part", cell, float64);
  in_part.blocks = {1};
  const auto rising = [](std::uint64_t i, std::uint64_t s) {
    return 3 * random_share(i, 0) + double(s) * random_share(i, 1) + random_share(i, s) / 64;
  };
  using Value = std::function<double(std::uint64_t scalar, std::uint64_t step)>;
  const std::vector<std::pair<ArrayInfo, Value>> all = {
      {array_of("rising", point, float64), rising},
      {array_of("floats", cell, float32, 2),
       [](auto i, auto s) { return 1 / (2 + random_share(i, s)); }},
      {bounded, [](auto i, auto s) { return i % 61 == 5 ? 1e30 : 100 * random_share(i, s); }},
      {array_of("integers", cell, int16),
       [](auto i, auto s) { return 2000 * random_share(i, s) - 99; }},
      {array_of("decimals", point, float64),
       [](auto i, auto s) { return double(int(9000 * random_share(i, s))) / 1000; }},
      {in_part, rising},
  };
  std::vector<ArrayInfo> arrays;
  for (const auto& [info, value] : all) arrays.push_back(info);
  WriteOptions options;
  options.waiting_bytes = 0;  // no bundles
  options.slow_step_values = 0;
  options.group_cells = 140;
  options.segment_cells = 200;
  options.connectivity = ConnectivityCodec::rows;
  return written_with_steps(
      mesh, arrays, options, 3,
      [&](std::uint32_t array, std::uint64_t scalar, std::uint64_t step) -> std::optional<double> {
        return all[array].second(scalar, step);
      });
}

/// Returns a file whose stepped arrays have a history: they are coded with the codec `weighted`,
/// and each value is predicted from the values around it at earlier steps. There are several
/// groups, and arrays with special values, with a relative error bound, and with blocks that they
/// do not cover.
inline std::vector<std::byte> weighted_history() {
  using enum Location;
  using enum ScalarType;
  constexpr std::uint64_t kWidth = 12;
  TestMesh mesh = bent_grid(kWidth - 1, 8, 7);
  mesh.schema.blocks.push_back({2, "", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    if (c % 11 >= 2) mesh.cells[c].block = 1;
  ArrayInfo holes = array_of("holes", point, float64);
  holes.fills = {-1e30};
  ArrayInfo relative = array_of("relative", point, float32);
  relative.quantization = Quantization::relative(.0001, float32);
  ArrayInfo in_part = array_of("in part", cell, float32, 2);
  in_part.blocks = {1};
  // Noise that moves through the mesh in one direction, and less noise in the other direction
  const auto moving = [](std::uint64_t i, std::uint64_t s) {
    return std::floor(4096 * random_share(i + 100 - s, 0)) +
           std::floor(64 * random_share(i + 100 + s, 1));
  };
  WriteOptions options;
  options.waiting_bytes = 0;  // no bundles
  options.slow_step_values = 0;
  options.group_cells = 260;
  options.connectivity = ConnectivityCodec::rows;
  return written_with_steps(
      mesh, {array_of("moving", point, float64), holes, relative, in_part}, options, 4,
      [&](std::uint32_t array, std::uint64_t i, std::uint64_t s) -> std::optional<double> {
        if (array == 1 && i % 19 == 3) return -1e30;
        if (array == 2) return 1000 + moving(i, s);
        return array == 3 ? moving(i / 2 + i % 2 * 5000, s) : moving(i, s);
      });
}

/// Returns a file with step times of all kinds: multiples of a number, sums of a number, times that
/// decrease, and numbers that are not finite.
inline std::vector<std::byte> step_times() {
  MemorySink sink;
  EXPECT_TRUE(write_mesh(bent_grid(1, 1, 1), sink, {}, [&](Writer& writer) {
    std::vector<double> times;
    for (int i = 0; i < 20; ++i) times.push_back(i * .1);
    for (int i = 0; i < 20; ++i) times.push_back(times.back() + .1);
    for (const double time :
         {-0.0, -1.5, 1e308, -1e308, 1e308, std::numeric_limits<double>::infinity(), 1.0,
          std::numeric_limits<double>::quiet_NaN(), 2.0, 5e-324})
      times.push_back(time);
    return writer.set_step_times(times);
  }));
  return std::move(sink.bytes);
}

/// Returns a live file with `commits` commits, one for each step, and an extra between them. If
/// `finishes` is false, it ends with the last commit.
inline std::vector<std::byte> live_file(std::uint64_t commits, bool finishes) {
  TestMesh mesh = bent_grid(3, 2, 2);
  mesh.schema.arrays = {array_of("p", Location::point, ScalarType::float64),
                        array_of("c", Location::cell, ScalarType::float32)};
  for (ArrayInfo& array : mesh.schema.arrays) array.per_step = true;
  mesh.arrays.assign(2, {});
  MemorySink sink;
  std::size_t committed = 0;  // size of the file at the last commit
  EXPECT_TRUE(write_mesh(mesh, sink, {}, [&](Writer& writer) -> Result<void> {
    std::vector<double> times;
    for (std::uint64_t step = 0; step < commits; ++step) {
      std::vector<std::byte> on_points, on_cells;
      for (std::uint64_t v = 0; v < mesh.vertices; ++v)
        append(on_points, std::sqrt(static_cast<double>(v + step)));
      for (std::size_t c = 0; c < mesh.cells.size(); ++c)
        append(on_cells, static_cast<float>(c * step));
      times.push_back(.5 * static_cast<double>(step));
      if (auto status = writer.add_step_values(0, step, on_points); !status) return status;
      if (auto status = writer.add_step_values(1, step, on_cells); !status) return status;
      if (auto status = writer.set_step_times(times); !status) return status;
      if (step == 2)
        if (auto status = writer.add_extra(
                {"note", ScalarType::uint8, Reference::nothing, {2}, std::vector<std::byte>(2)});
            !status)
          return status;
      if (auto status = writer.commit(); !status) return status;
    }
    committed = sink.bytes.size();
    return {};
  }));
  if (!finishes) sink.bytes.resize(committed);
  return std::move(sink.bytes);
}

/// Returns a file whose key steps refer to their bases: random values that do not change, random
/// values that change once, and values that grow. There are several groups and segments.
inline std::vector<std::byte> steps_on_bases(Level level) {
  using enum Location;
  using enum ScalarType;
  WriteOptions options;
  options.level = level;
  options.waiting_bytes = 0;  // no bundles
  options.key_steps = 3;
  options.group_cells = 30;
  options.segment_cells = 60;
  options.connectivity = ConnectivityCodec::rows;
  const std::vector<ArrayInfo> arrays = {array_of("fixed", point, float64),
                                         array_of("changing", cell, float32, 2),
                                         array_of("growing", point, int32)};
  return written_with_steps(
      bent_grid(5, 4, 4), arrays, options, 10,
      [](std::uint32_t array, std::uint64_t scalar, std::uint64_t step) -> std::optional<double> {
        if (array == 0) return random_share(scalar, 0);
        if (array == 1) return random_share(scalar, step < 5 ? 0 : 1);
        return std::floor(1e6 * random_share(scalar, 0)) + double(step);
      });
}

/// Returns a file with a stepped array of random numbers. The values in half of the mesh are those
/// of the other half, negated. They are coded as matched values of the codec `weighted`.
inline std::vector<std::byte> weighted_mirrored() {
  constexpr std::uint64_t kSide = 7, kComponents = 3;
  WriteOptions options;
  options.waiting_bytes = 0;  // no bundles
  options.slow_step_values = 0;
  const ArrayInfo info = array_of("n", Location::cell, ScalarType::int16, kComponents);
  return written_with_steps(
      bent_grid(kSide, kSide, kSide), {info}, options, 1,
      [](std::uint32_t, std::uint64_t scalar, std::uint64_t) -> std::optional<double> {
        const std::uint64_t c = scalar % kComponents, cell = scalar / kComponents;
        const std::uint64_t y = cell / kSide % kSide, other = kSide - 1 - y;
        if (y <= kSide / 2) return 1 + std::floor(30000 * random_share(cell, c));
        return -1 - std::floor(30000 * random_share(cell + (other - y) * kSide, c));
      });
}

/// Returns a value of a tensor with nine components. It is symmetric, except in some elements. A
/// tenth component is always 0, and so is an eleventh except in these elements.
inline double value_of_tensor(std::uint64_t scalar, std::uint64_t step) {
  constexpr std::uint64_t kComponents = 11;
  constexpr std::array<std::uint64_t, kComponents> kSymmetric = {0, 1, 2, 1, 3, 4, 2, 4, 5, 9, 9};
  const std::uint64_t element = scalar / kComponents, c = scalar % kComponents;
  const bool is_symmetric = element < 50 || element >= 100;
  const std::uint64_t own = is_symmetric ? kSymmetric[c] : c;
  if (own == 9) return 0;
  return 1 / (2 + double(own) + random_share(element, own) + .25 * double(step));
}
inline ArrayInfo tensor(Location location, ScalarType type) {
  return array_of("t" + std::to_string(scalar_bytes(type)), location, type, 11);
}

/// Returns a grid with tensors on points and cells, some of which are rounded.
inline TestMesh tensors() {
  using enum Location;
  using enum ScalarType;
  TestMesh mesh = bent_grid(6, 5, 4);
  for (const Location location : {point, cell})
    for (const ScalarType type : {float32, float64, int16}) {
      ArrayInfo info = tensor(location, type);
      if (type == float32 && location == cell) {
        info.quantization = {9, std::vector<double>(11, 0), std::vector<double>(11, 1)};
        // Components with equal values that are rounded differently
        info.quantization.maximum[3] = 2;
      }
      std::vector<std::byte> values;
      const std::uint64_t count = location == point ? mesh.vertices : mesh.cells.size();
      for (std::uint64_t i = 0; i < count * info.components; ++i) {
        const double value = value_of_tensor(i, 0);
        append_number(values, type, type == int16 ? 1000 * value : value);
      }
      mesh.schema.arrays.push_back(std::move(info));
      mesh.arrays.push_back(std::move(values));
    }
  return mesh;
}

/// Returns a file with tensors at four steps. At one of them, no element is symmetric.
inline std::vector<std::byte> tensors_at_steps(Level level) {
  using enum Location;
  using enum ScalarType;
  WriteOptions options;
  options.level = level;
  options.waiting_bytes = 0;  // no bundles
  options.slow_step_values = 0;
  options.group_cells = 50;
  options.segment_cells = 80;
  ArrayInfo bounded = tensor(cell, float32);
  bounded.quantization = Quantization::absolute(0x1p-10, bounded.components);
  return written_with_steps(
      bent_grid(6, 5, 4), {tensor(point, float64), bounded}, options, 4,
      [](std::uint32_t, std::uint64_t scalar, std::uint64_t step) -> std::optional<double> {
        return step == 2 ? 1 + random_share(scalar, step) : value_of_tensor(scalar, step);
      });
}

/// Returns a file with stepped arrays of the whole mesh and of sets, beside a point array. There
/// are several groups and segments. Without bundles, the arrays are coded as ordinary parts.
inline std::vector<std::byte> steps_beside_mesh(Level level, std::uint64_t waiting_bytes = 0) {
  using enum Location;
  using enum ScalarType;
  const auto of = [](std::string name, Location location, ScalarType type, std::uint64_t elements,
                     std::uint32_t components = 1) {
    ArrayInfo info = array_of(std::move(name), location, type, components);
    info.elements = elements;
    return info;
  };
  std::vector<ArrayInfo> arrays = {
      of("energy", global, float64, 1),         array_of("u", point, float32),
      of("momentum", global, float32, 1, 3),    of("pressure", node_set, float64, 40),
      of("flux", side_set, float32, 25, 2),     of("damaged", element_set, int8, 7),
      of("many", element_set, float32, 1, 300), of("energy", global, int32, 2)};
  arrays[3].blocks = {0, 7};
  arrays[3].quantization = Quantization::absolute(.25, 1);
  arrays[4].fills = {-1};
  WriteOptions options;
  options.group_cells = 40;
  options.segment_cells = 60;
  options.level = level;
  options.waiting_bytes = waiting_bytes;
  return written_with_steps(
      bent_grid(5, 4, 4), arrays, options, 5,
      [&](std::uint32_t array, std::uint64_t scalar, std::uint64_t step) -> std::optional<double> {
        if (array == 5 && step == 2) return std::nullopt;
        if (array == 4 && scalar % 5 == 1) return -1;
        return double(array) + 9 * random_share(scalar, 0) + double(step) * random_share(scalar, 1);
      });
}

/// Returns rows of quads with lines along one side and a cell array. All coordinates are the same
/// NaN. bent_grid() with 0 layers computes them as 0 / 0, which results in NaNs whose sign depends
/// on the machine. This function therefore replaces them with the NaN that x86 produces, which the
/// golden files contain.
inline TestMesh quads_in_rows() {
  TestMesh mesh = bent_grid(7, 5, 0);
  mesh.xyz.clear();
  for (std::uint64_t i = 0; i < 3 * mesh.vertices; ++i) append(mesh.xyz, std::uint32_t{0xffc00000});
  mesh.schema.blocks = {{1, "", CellShape::quad, 4}, {2, "", CellShape::line, 2}};
  for (std::uint64_t j = 0; j < 5; ++j)
    for (std::uint64_t i = 0; i < 7; ++i) {
      const std::uint64_t v = 8 * j + i;
      mesh.cells.push_back({0, {v, v + 1, v + 9, v + 8}});
    }
  for (std::uint64_t i = 0; i < 7; ++i) mesh.cells.push_back({1, {i, i + 1}});
  add_array(mesh, array_of("h", Location::cell, ScalarType::float32), mesh.cells.size());
  return mesh;
}

/// Returns a file with values at vertices and cells, in two segments of several groups each. The
/// cells are coded with `codec`. Two vertices are not used by any cell: one between cells, and one
/// at the end.
inline std::vector<std::byte> rows_of_cells(ConnectivityCodec codec, Level level,
                                            Order order = Order::keep) {
  const int row = order == Order::keep ? 4 : 8;
  TestMesh mesh = with_order(bent_grid(row, 3, 4), order, order == Order::keep, 0);
  for (int i = 0; i < 2; ++i) append_point(mesh, {2, i + .5, -1});
  add_array(mesh, array_of("u", Location::point, ScalarType::int16, 2), mesh.vertices);
  add_array(mesh, array_of("p", Location::cell, ScalarType::float64), mesh.cells.size());
  MemorySink sink;
  WriteOptions options;
  options.group_cells = static_cast<std::uint32_t>(3 * row);
  options.segment_cells = options.group_cells * 2;
  options.level = level;
  options.connectivity = codec;
  EXPECT_TRUE(write_mesh(mesh, sink, options));
  return std::move(sink.bytes);
}

/// Sets the delay of the mesh to 0. Replaces each block whose cells have more than 64 nodes or no
/// fixed number of nodes with an empty block of triangles. Returns the changed mesh.
inline TestMesh with_few_nodes(TestMesh mesh) {
  mesh.schema.delay = 0;
  for (BlockInfo& block : mesh.schema.blocks) {
    if (block.nodes_per_cell > 0 && block.nodes_per_cell <= 64) continue;
    const auto b = static_cast<std::uint32_t>(&block - mesh.schema.blocks.data());
    std::erase_if(mesh.cells, [&](const TestCell& cell) { return cell.block == b; });
    block.shape = CellShape::triangle;
    block.nodes_per_cell = 3;
  }
  return mesh;
}

/// Returns one file per feature of the format. Tests change their coded contents, so by default
/// they have no digests, except those named "digests...".
inline std::vector<FeatureFile> feature_files(bool digests = false) {
  writer_digests = digests;
  using enum Order;
  std::vector<FeatureFile> files;
  const auto add = [&](const char* name, std::vector<std::byte> bytes) {
    files.push_back({name, std::move(bytes)});
  };
  add("no_blocks", written({}));
  add("no_cells", written({hexahedra_schema(), {}, 0, {}, {}}));
  add("one_hexahedron", written(grid(1, 1, 1)));
  add("keep", written(bent_grid(3, 2, 2)));
  add("keep_delay", written(with_order(shuffled(bent_grid(3, 2, 2)), keep, true, 5)));
  add("stream", written(with_order(shuffled(bent_grid(3, 2, 2)), stream, true, 0)));
  add("stream_turned", written(with_order(shuffled(bent_grid(3, 2, 2)), stream, false, 5)));
  add("free", written(with_order(shuffled(bent_grid(3, 2, 2)), Order::free, true, 0)));
  add("groups", written(bent_grid(3, 3, 1), 2));
  add("paper_codec", written(shuffled(bent_grid(3, 3, 2)), 10, ConnectivityCodec::paper));
  add("paper_codec_stream", written(with_order(shuffled(bent_grid(3, 3, 2)), stream, false, 3),
                                    65536, ConnectivityCodec::paper));
  add("holes", written(grid(4, 4, 3, ScalarType::float32, straight, porous)));
  add("ring", written(exact_ring(5, 2, 2)));
  add("mixed_cells", written(mixed_cells()));
  add("mixed_cells_stream", written(with_order(mixed_cells(), stream, true, 3)));
  add("every_shape", written(every_shape()));
  add("every_shape_stream",
      written(with_order(every_shape(), stream, false, 5), 30, ConnectivityCodec::mixed));
  add("every_shape_values",
      written(with_arrays_of_every_type(every_shape()), 50, ConnectivityCodec::rows, Level::best));
  add("polyhedra", written(polyhedra()));
  add("polyhedra_stream",
      written(with_order(polyhedra(), stream, false, 5), 9, ConnectivityCodec::mixed, Level::best));
  add("polyhedra_values",
      written(with_arrays_of_every_type(polyhedra()), 40, ConnectivityCodec::rows, Level::best));
  add("second_order", written(second_order_cells()));
  add("second_order_stream", written(with_order(second_order_grid(3, 2, 2, 27), stream, true, 0), 5,
                                     ConnectivityCodec::replay));
  add("grid_nodes", written(grids_of_nodes()));
  add("high_order", written(high_order_cells()));
  add("grid_nodes_stream", written(with_order(grids_of_nodes(), stream, false, 3), 5,
                                   ConnectivityCodec::replay, Level::best));
  add("degenerate", written(degenerate_hexahedra()));
  add("arrays", written(with_arrays_of_every_type(bent_grid(2, 2, 1))));
  add("arrays_on_some_blocks", written(arrays_on_some_blocks()));
  add("tables_for_some", written(with_tables_for_some(bent_grid(2, 2, 1))));
  add("mixed_columns", written(with_arrays_of_every_type(bent_grid(2, 2, 2)), 5,
                               ConnectivityCodec::rows, Level::best));
  add("quantized", written(quantized()));
  add("bounded", bounded_file());
  add("special_values", written(special_values()));
  add("replay_keep", written(replayed(Order::keep), 65536, ConnectivityCodec::replay));
  add("replay_stream", written(replayed(Order::stream), 20, ConnectivityCodec::replay));
  add("replay_strays", written(cut_into_eight(3), 65536, ConnectivityCodec::replay));
  add("replay_strays_stream",
      written(with_order(cut_into_eight(3), stream, true, 0), 100, ConnectivityCodec::replay));
  add("mixed_rows", written(shuffled(bent_grid(4, 4, 3)), 20, ConnectivityCodec::mixed));
  add("mixed_rows_stream",
      written(with_order(mixed_cells(), stream, false, 3), 65536, ConnectivityCodec::mixed));
  add("unmarked", unmarked_file());
  add("steps_and_extras", steps_and_extras_file(keep));
  add("steps_and_extras_stream", steps_and_extras_file(stream));
  add("steps_that_stand_alone", steps_and_extras_file(keep, 1));
  add("bundles", bundles_file(keep, Level::standard));
  add("bundles_stream", bundles_file(stream, Level::fast));
  add("bundles_scaled", scaled_bundle_file());
  add("bounded_steps", bounded_steps_file(Level::standard));
  add("bounded_steps_best", bounded_steps_file(Level::best));
  add("bounded_steps_fast", bounded_steps_file(Level::fast));
  add("filled", written(filled(5, 3), 30));
  add("filled_stream", written(with_order(filled(5, 2), stream, true, 0), 65536,
                               ConnectivityCodec::mixed, Level::best));
  add("filled_patterns", written(filled(5, 3), 30, ConnectivityCodec::patterns, Level::fast));
  add("filled_shifts", written(filled(5, 3), 30, ConnectivityCodec::shifts, Level::fast));
  add("filled_steps", filled_steps(Level::standard));
  add("filled_steps_best", filled_steps(Level::best));
  add("filled_steps_fast", filled_steps(Level::fast));
  add("filled_bundles", filled_steps(Level::standard, 1 << 20));
  add("weighted_steps", weighted_steps());
  add("weighted_mirrored", weighted_mirrored());
  add("weighted_history", weighted_history());
  add("step_times", step_times());
  add("tensors", written(tensors(), 50));
  add("tensors_best", written(tensors(), 50, ConnectivityCodec::mixed, Level::best));
  add("tensors_shifts", written(tensors(), 50, ConnectivityCodec::shifts, Level::fast));
  add("tensors_patterns", written(tensors(), 50, ConnectivityCodec::patterns, Level::fast));
  add("tensor_steps", tensors_at_steps(Level::standard));
  add("tensor_steps_best", tensors_at_steps(Level::best));
  add("tensor_steps_fast", tensors_at_steps(Level::fast));
  add("steps_on_bases", steps_on_bases(Level::standard));
  add("steps_on_bases_fast", steps_on_bases(Level::fast));
  add("steps_beside_mesh", steps_beside_mesh(Level::standard));
  add("steps_beside_mesh_fast", steps_beside_mesh(Level::fast));
  add("steps_beside_mesh_bundles", steps_beside_mesh(Level::best, 1 << 20));
  add("relative_steps", relative_bounds_file(Level::standard));
  add("relative_steps_best", relative_bounds_file(Level::best));
  add("relative_steps_fast", relative_bounds_file(Level::fast));
  add("relative_bundles", relative_bounds_file(Level::standard, 1 << 20));
  add("relative", written(relative_bounds(), 30));
  add("relative_best", written(relative_bounds(), 65536, ConnectivityCodec::mixed, Level::best));
  add("relative_shifts", written(relative_bounds(), 30, ConnectivityCodec::shifts, Level::fast));
  add("relative_patterns",
      written(relative_bounds(), 30, ConnectivityCodec::patterns, Level::fast));
  add("large_extras", large_extras_file());
  add("mirrored", mirrored_file(Level::standard));
  add("mirrored_best", mirrored_file(Level::best));
  add("broken", written(broken(bent_grid(6, 4, 3, ScalarType::float64)), 40));
  add("broken_stream", written(with_order(broken(bent_grid(5, 4, 2)), stream, false, 0), 65536,
                               ConnectivityCodec::rows, Level::best));
  add("broken_shapes", written(broken(mixed_cells())));
  add("shifts_broken", written(broken(bent_grid(6, 4, 3, ScalarType::float64)), 40,
                               ConnectivityCodec::shifts, Level::standard));
  add("segments", segments_file(keep, true, 3, 7));
  add("segments_stream", segments_file(stream, false, 0, 6));
  add("shifts", rows_of_cells(ConnectivityCodec::shifts, Level::fast));
  add("shifts_stream", rows_of_cells(ConnectivityCodec::shifts, Level::fast, stream));
  // This mesh has more distinct shifts (differences between consecutive cells) than the codec's
  // table of shifts can hold.
  add("shifts_shuffled", written(shuffled(bent_grid(7, 7, 6, ScalarType::float64)), 200,
                                 ConnectivityCodec::shifts, Level::fast));
  add("shifts_arrays", written(with_arrays_of_every_type(bent_grid(2, 2, 2)), 5,
                               ConnectivityCodec::shifts, Level::fast));
  add("shifts_quantized", written(quantized(), 5, ConnectivityCodec::shifts, Level::fast));
  add("shifts_special_values",
      written(special_values(), 65536, ConnectivityCodec::shifts, Level::fast));
  // The values in this file are predicted from neighbours that are found by vertex number.
  add("shifts_columns", rows_of_cells(ConnectivityCodec::shifts, Level::standard));
  add("shifts_columns_arrays", written(with_arrays_of_every_type(bent_grid(2, 2, 2)), 5,
                                       ConnectivityCodec::shifts, Level::standard));
  add("shifts_mixed_columns", written(with_arrays_of_every_type(bent_grid(3, 3, 2)), 7,
                                      ConnectivityCodec::shifts, Level::best));
  add("shifts_steps", steps_over(ConnectivityCodec::shifts, Level::standard));
  add("shifts_columns_quads", written(quads_in_rows(), 20, ConnectivityCodec::shifts));
  const auto patterns = ConnectivityCodec::patterns;
  add("patterns", rows_of_cells(patterns, Level::fast));
  add("patterns_stream", rows_of_cells(patterns, Level::fast, stream));
  add("patterns_shuffled",
      written(shuffled(bent_grid(5, 5, 4, ScalarType::float64)), 30, patterns, Level::fast));
  add("patterns_shapes", written(with_few_nodes(second_order_cells()), 30, patterns, Level::fast));
  add("patterns_second_order",
      written(with_order(second_order_grid(3, 2, 2, 27), stream, true, 0), 5, patterns));
  add("patterns_grid_nodes", written(turned_grids(2, 2, 2, 3), 5, patterns, Level::fast));
  add("patterns_broken", written(broken(bent_grid(5, 4, 3)), 20, patterns, Level::fast));
  add("patterns_arrays",
      written(with_arrays_of_every_type(bent_grid(3, 3, 3)), 7, patterns, Level::fast));
  add("patterns_quantized", written(quantized(), 5, patterns, Level::fast));
  add("patterns_special_values", written(special_values(), 65536, patterns, Level::fast));
  add("patterns_steps", steps_over(patterns, Level::fast));
  add("patterns_steps_that_rise", steps_that_rise());
  add("copied_vertices", written(copied_vertices(), 40, patterns, Level::fast));
  add("rounding_best", rounding_file(Level::best));
  add("rounding_fast", rounding_file(Level::fast));
  add("digests", digests_file(keep, Level::standard));
  add("digests_fast", digests_file(keep, Level::fast));
  add("digests_stream", digests_file(stream, Level::standard));
  add("live", live_file(11, false));
  add("live_finished", live_file(3, true));
  writer_digests = true;
  return files;
}

/// Returns an archive of two feature files.
inline FeatureFile archive_file() {
  MemorySink sink;
  ArchiveWriter archive = ArchiveWriter::create(sink).value();
  for (const FeatureFile& feature : feature_files())
    if (feature.name == "one_hexahedron" || feature.name == "steps_and_extras")
      (void)archive.add_member(feature.name + ".e").value()->write(feature.bytes);
  (void)archive.finish().value();
  return {"archive", std::move(sink.bytes)};
}

}  // namespace shm
