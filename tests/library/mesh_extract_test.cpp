// Tests of MeshExtractor. An extracted piece must equal the same part of the whole mesh as read
// with a Reader. The extractor reads only the bytes that the piece needs. An inconsistent index may
// cause cells to be missing from a piece, but must not change any other data.
#include "shm/mesh_extract.h"

#include <map>
#include <set>

#include "support/coded_meshes.h"
#include "support/counted_source.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"
#include "support/second_order_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;
using container::IndexEntry;

/// A mesh stored as maps from vertex and cell numbers to their data, so that comparisons do not
/// depend on the order of vertices and cells.
struct ByNumber {
  struct Cell {
    std::uint32_t block = 0;
    std::vector<std::uint64_t> corners;
    std::map<std::uint32_t, Bytes> values;  // by array
    bool operator==(const Cell&) const = default;
  };
  struct Vertex {
    Bytes xyz;
    std::map<std::uint32_t, Bytes> values;
    bool operator==(const Vertex&) const = default;
  };
  std::map<std::uint64_t, Vertex> vertices;
  std::map<std::uint64_t, Cell> cells;
  /// Values by array and step.
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::map<std::uint64_t, Bytes>> steps;
  bool operator==(const ByNumber&) const = default;
};

std::size_t stride_of(const ArrayInfo& info) { return scalar_bytes(info.type) * info.components; }

Bytes element(const Bytes& values, std::size_t i, std::size_t stride) {
  const auto from = values.begin() + static_cast<std::ptrdiff_t>(i * stride);
  return Bytes(from, from + static_cast<std::ptrdiff_t>(stride));
}

void add(ByNumber& to, const MeshBlock& block, const Schema& schema) {
  const auto of_points = [&](std::size_t a) {
    return schema.arrays[a].location == Location::point;
  };
  const auto here = [&](std::size_t a) {
    return !schema.arrays[a].per_step && !block.arrays[a].empty();
  };
  for (std::size_t v = 0; v < block.vertex_count(); ++v) {
    const auto [at, fresh] = to.vertices.try_emplace(block.vertex_numbers[v]);
    EXPECT_TRUE(fresh) << "vertex " << block.vertex_numbers[v] << " comes twice";
    if (!block.xyz.empty())
      at->second.xyz = element(block.xyz, v, 3 * scalar_bytes(schema.coordinate_type));
    for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
      if (here(a) && of_points(a))
        at->second.values[a] = element(block.arrays[a], v, stride_of(schema.arrays[a]));
  }
  std::vector<std::size_t> next(schema.arrays.size());
  for (std::size_t c = 0; c < block.cell_count(); ++c) {
    const auto [at, fresh] = to.cells.try_emplace(block.cell_numbers[c]);
    EXPECT_TRUE(fresh) << "cell " << block.cell_numbers[c] << " comes twice";
    at->second.block = block.cell_blocks[c];
    at->second.corners.assign(
        block.corners.begin() + static_cast<std::ptrdiff_t>(block.corner_begin[c]),
        block.corners.begin() + static_cast<std::ptrdiff_t>(block.corner_begin[c + 1]));
    for (std::uint32_t a = 0; a < schema.arrays.size(); ++a)
      if (here(a) && !of_points(a) && schema.array_covers(a, block.cell_blocks[c]))
        at->second.values[a] = element(block.arrays[a], next[a]++, stride_of(schema.arrays[a]));
  }
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    if (!here(a)) continue;
    EXPECT_EQ(block.arrays[a].size(),
              stride_of(schema.arrays[a]) * (of_points(a) ? block.vertex_count() : next[a]));
  }
}

ByNumber whole_of(std::span<const std::byte> bytes) {
  ByNumber all;
  const auto back = read_mesh(bytes);
  EXPECT_TRUE(back) << (back ? "" : back.error().message());
  if (!back) return all;
  add(all, back->mesh, back->schema);
  for (const StepPiece& piece : back->steps) {
    const ArrayInfo& info = back->schema.arrays[piece.array];
    std::vector<std::uint64_t> numbers;
    if (info.location == Location::point) numbers = back->mesh.vertex_numbers;
    for (std::size_t c = 0; c < back->mesh.cell_count() && info.location == Location::cell; ++c)
      if (back->schema.array_covers(piece.array, back->mesh.cell_blocks[c]))
        numbers.push_back(back->mesh.cell_numbers[c]);
    for (std::size_t i = 0; i * stride_of(info) < piece.values.size(); ++i)
      all.steps[{piece.array, piece.step}][numbers.at(piece.first + i)] =
          element(piece.values, i, stride_of(info));
  }
  return all;
}

bool in_box(const std::array<double, 6>& box, const Bytes& xyz, const Schema& schema) {
  for (std::size_t c = 0; c < 3; ++c) {
    double v = 0;
    if (schema.coordinate_type == ScalarType::float32) {
      float narrow = 0;
      std::memcpy(&narrow, &xyz[c * 4], 4);
      v = static_cast<double>(narrow);
    } else {
      std::memcpy(&v, &xyz[c * 8], 8);
    }
    if (!(std::isfinite(v) && v >= box[c] && v <= box[3 + c])) return false;
  }
  return true;
}

std::set<std::uint64_t> unused(const ByNumber& whole) {
  std::set<std::uint64_t> numbers;
  for (const auto& [number, vertex] : whole.vertices) numbers.insert(number);
  for (const auto& [number, cell] : whole.cells)
    for (const std::uint64_t v : cell.corners) numbers.erase(v);
  return numbers;
}

/// The cells of a segment, and the vertices of the segment that no cell of the mesh uses.
struct SegmentOfWhole {
  std::set<std::uint64_t> cells, unused;
};
std::vector<SegmentOfWhole> segments_of(const Bytes& bytes, const std::set<std::uint64_t>& unused) {
  std::vector<SegmentOfWhole> segments;
  MemoryRandomSource source(bytes);
  auto reader = SegmentReader::open(source);
  EXPECT_TRUE(reader);
  for (std::size_t s = 0; reader && s < reader->segments().size(); ++s) {
    SegmentOfWhole& segment = segments.emplace_back();
    const auto blocks = reader->read(s);
    EXPECT_TRUE(blocks);
    for (const MeshBlock& block : blocks ? *blocks : std::vector<MeshBlock>()) {
      segment.cells.insert(block.cell_numbers.begin(), block.cell_numbers.end());
      for (const std::uint64_t v : block.vertex_numbers)
        if (unused.contains(v)) segment.unused.insert(v);
    }
  }
  return segments;
}

/// Returns the expected piece: the part of the whole mesh that the request selects.
ByNumber cut(const ByNumber& whole, const std::vector<SegmentOfWhole>& segments,
             const Schema& schema, const ExtractRequest& request) {
  ByNumber piece;
  const CellSelection& want = request.cells;
  const auto take = [&](std::uint64_t v) { piece.vertices[v] = whole.vertices.at(v); };
  if (request.vertices) {
    for (const std::uint64_t v : *request.vertices)
      if (!want.box || in_box(*want.box, whole.vertices.at(v).xyz, schema)) take(v);
  } else if (want.all()) {
    piece = whole;
  } else {
    for (const auto& [number, cell] : whole.cells) {
      if (want.range && (number < want.range->first || number >= want.range->end)) continue;
      if (want.numbers &&
          std::find(want.numbers->begin(), want.numbers->end(), number) == want.numbers->end())
        continue;
      if (want.blocks &&
          std::find(want.blocks->begin(), want.blocks->end(), cell.block) == want.blocks->end())
        continue;
      if (want.box && std::none_of(cell.corners.begin(), cell.corners.end(), [&](std::uint64_t v) {
            return in_box(*want.box, whole.vertices.at(v).xyz, schema);
          }))
        continue;
      piece.cells[number] = cell;
      for (const std::uint64_t v : cell.corners) take(v);
    }
    for (const SegmentOfWhole& segment : segments) {
      const bool read = segment.cells.empty() ||
                        std::any_of(segment.cells.begin(), segment.cells.end(),
                                    [&](std::uint64_t c) { return piece.cells.contains(c); });
      for (const std::uint64_t v : segment.unused)
        if (request.unused_vertices && read) take(v);
    }
  }
  piece.steps.clear();
  for (const auto& [key, values] : whole.steps)
    for (const auto& [number, value] : values)
      if (schema.arrays[key.first].location == Location::point ? piece.vertices.contains(number)
                                                               : piece.cells.contains(number))
        piece.steps[key][number] = value;
  if (!request.coordinates && !request.cells.box)
    for (auto& [number, vertex] : piece.vertices) vertex.xyz.clear();
  if (request.arrays) {
    const auto drop = [&](auto& elements) {
      for (auto& [number, one] : elements)
        std::erase_if(one.values, [&](const auto& it) {
          return std::find(request.arrays->begin(), request.arrays->end(), it.first) ==
                 request.arrays->end();
        });
    };
    drop(piece.vertices);
    drop(piece.cells);
  }
  return piece;
}

/// Extracts the requested piece with all steps of all stepped arrays.
Result<ByNumber> extracted(MeshExtractor& file, const ExtractRequest& request, unsigned threads = 1,
                           std::uint64_t ahead = ReadOptions().max_ahead_bytes) {
  ByNumber piece;
  ReadOptions options;
  options.threads = threads;
  options.max_ahead_bytes = ahead;
  if (auto status = file.begin(request, options); !status) return status.error();
  while (true) {
    const auto part = file.next();
    if (!part) return part.error();
    if (*part == nullptr) break;
    EXPECT_EQ((*part)->first_vertex, piece.vertices.size());
    EXPECT_EQ((*part)->first_cell, piece.cells.size());
    add(piece, **part, file.schema());
    // Each vertex must be delivered before, or together with, the first cell that uses it.
    for (const std::uint64_t corner : (*part)->corners)
      EXPECT_TRUE(piece.vertices.contains(corner));
  }
  EXPECT_EQ(file.vertex_numbers().size(), piece.vertices.size());
  EXPECT_EQ(file.cell_numbers().size(), piece.cells.size());
  EXPECT_TRUE(std::is_sorted(file.vertex_numbers().begin(), file.vertex_numbers().end()));
  for (std::uint32_t a = 0; a < file.schema().arrays.size(); ++a) {
    if (!file.schema().arrays[a].per_step) continue;
    const auto steps = file.steps(a);
    if (!steps) return steps.error();
    for (const std::uint64_t step : *steps) {
      if (auto status = file.begin_values(a, step); !status) return status.error();
      while (true) {
        const auto values = file.next_values();
        if (!values) return values.error();
        if (*values == nullptr) break;
        const std::size_t stride = stride_of(file.schema().arrays[a]);
        for (std::size_t i = 0; i < (*values)->numbers.size(); ++i) {
          const auto [at, fresh] = piece.steps[{a, step}].emplace(
              (*values)->numbers[i], element((*values)->values, i, stride));
          EXPECT_TRUE(fresh) << "a value of " << at->first << " comes twice";
        }
      }
    }
  }
  return piece;
}

ExtractRequest cells(std::uint64_t first, std::uint64_t end) {
  ExtractRequest request;
  request.cells.range = {first, end};
  return request;
}

/// Returns requests of all kinds for a mesh with the given cells and vertices. One request is a box
/// around the whole mesh.
std::vector<ExtractRequest> requests(const ByNumber& whole, const Schema& schema) {
  std::vector<ExtractRequest> all(1);
  const std::uint64_t n = whole.cells.size();
  for (const auto& [first, end] :
       {std::pair(std::uint64_t{0}, n), {n / 3, n / 2}, {n / 2, n / 2}, {n - 1, n}, {0, 1}})
    all.push_back(cells(first, end));
  ExtractRequest some;
  some.cells.numbers.emplace();
  for (std::uint64_t c = 1; c < n; c += 7) some.cells.numbers->push_back(c);
  all.push_back(some);
  some.cells.range = {n / 4, n};
  all.push_back(some);
  for (std::uint32_t b = 0; b < schema.blocks.size(); ++b) {
    ExtractRequest of_block;
    of_block.cells.blocks = {{b}};
    all.push_back(of_block);
    of_block.cells.range = {n / 3, n};
    all.push_back(of_block);
  }
  for (const std::array<double, 6>& box : {std::array<double, 6>{0, 0, 0, .3, .3, .3},
                                           {.2, .1, -5, .9, .6, 5},
                                           {7, 7, 7, 8, 8, 8},
                                           {-100, -100, .3, 100, 100, .31},
                                           {-100, -100, -100, 100, 100, 100}}) {
    ExtractRequest in;
    in.cells.box = box;
    all.push_back(in);
    in.cells.range = {n / 5, n / 2};
    all.push_back(in);
    in.cells.range.reset();
    in.cells.blocks = {{0}};
    all.push_back(in);
  }
  ExtractRequest vertices;
  vertices.vertices.emplace();
  std::uint64_t i = 0;
  for (const auto& [number, vertex] : whole.vertices)
    if (i++ % 5 == 2) vertices.vertices->push_back(number);
  all.push_back(vertices);
  vertices.cells.box = {0, 0, 0, .5, .5, .5};
  all.push_back(vertices);
  for (const std::uint64_t first : {std::uint64_t{0}, n / 3, n - 1}) {
    ExtractRequest last = cells(first, n);
    last.unused_vertices = true;
    all.push_back(last);
  }
  for (const std::vector<std::uint32_t>& arrays :
       {std::vector<std::uint32_t>{},
        {0},
        {static_cast<std::uint32_t>(schema.arrays.size() - 1)}}) {
    if (!arrays.empty() && schema.arrays.empty()) continue;
    ExtractRequest few = cells(n / 4, n / 2);
    few.arrays = arrays;
    all.push_back(few);
    few.coordinates = false;
    all.push_back(few);
    few.cells = {};
    all.push_back(few);
  }
  return all;
}

void expect_pieces(const Bytes& bytes) {
  const ByNumber whole = whole_of(bytes);
  const auto segments = segments_of(bytes, unused(whole));
  MemoryRandomSource source(bytes);
  auto file = MeshExtractor::open(source);
  ASSERT_TRUE(file) << file.error().message();
  EXPECT_EQ(file->vertices(), whole.vertices.size());
  EXPECT_EQ(file->cells(), whole.cells.size());
  std::size_t nth = 0;
  for (const ExtractRequest& request : requests(whole, file->schema())) {
    SCOPED_TRACE("request " + std::to_string(nth++));
    const auto piece = extracted(*file, request);
    ASSERT_TRUE(piece) << piece.error().message();
    const ByNumber expected = cut(whole, segments, file->schema(), request);
    EXPECT_EQ(piece->vertices.size(), expected.vertices.size());
    EXPECT_EQ(piece->cells.size(), expected.cells.size());
    EXPECT_TRUE(*piece == expected);
    if (nth % 5 != 0) continue;
    const auto by_threads = extracted(*file, request, 3);
    ASSERT_TRUE(by_threads) << by_threads.error().message();
    EXPECT_TRUE(*by_threads == expected) << "with threads";
  }
}

Bytes cut_file(const TestMesh& mesh, WriteOptions options) {
  MemorySink sink;
  const auto report = write_mesh(mesh, sink, options);
  EXPECT_TRUE(report) << (report ? "" : report.error().message());
  return std::move(sink.bytes);
}

TEST(MeshExtract, PiecesAreThoseOfTheWholeMesh) {
  SomeCases some(7);
  for (const GeneratedMesh& family : generated_meshes())
    for (const auto& [order, delay] : {std::pair(Order::keep, 0u), std::pair(Order::keep, 6u),
                                       std::pair(Order::stream, 0u), std::pair(Order::stream, 4u)})
      for (const std::uint64_t segment_cells : {3u, 20u, 1000u})
        for (const auto codec : codecs_of_both_kinds()) {
          const TestMesh mesh = with_order(family.mesh, order, true, delay);
          if (!can_be_in(mesh.schema, codec) || some.skips_next()) continue;
          SCOPED_TRACE(family.name + ", order " + std::to_string(int(order)) + ", delay " +
                       std::to_string(delay) + ", codec " + std::string(codec_name(codec)) +
                       ", segments of " + std::to_string(segment_cells));
          WriteOptions options;
          options.segment_cells = segment_cells;
          options.group_cells = 5;
          options.connectivity = codec;
          expect_pieces(cut_file(mesh, options));
        }
}

TEST(MeshExtract, StepsOfThePiece) {
  std::vector<GeneratedMesh> meshes;
  meshes.push_back({"two blocks", two_blocks()});
  TestMesh moved = two_blocks();
  std::mt19937_64 random(5);
  shuffle_vertices(moved, random);
  meshes.push_back({"shuffled vertices", moved});
  meshes.push_back({"second order", second_order_cells()});
  SomeCases some(5);
  for (const GeneratedMesh& family : meshes)
    for (const Order order : {Order::keep, Order::stream})
      for (const std::uint64_t segment_cells : {30u, 1000u}) {
        if (some.skips_next()) continue;
        SCOPED_TRACE(family.name + ", order " + std::to_string(int(order)) + ", segments of " +
                     std::to_string(segment_cells));
        Stepped stepped = with_steps(family.mesh, order);
        stepped.options.segment_cells = segment_cells;
        stepped.options.group_cells = 11;
        expect_pieces(written(stepped));
      }
}

TEST(MeshExtract, ExtrasAndTimesAreThoseOfTheFile) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Bytes bytes = steps_and_extras_file(order);
    const auto back = read_mesh(bytes);
    ASSERT_TRUE(back);
    MemoryRandomSource source(bytes);
    auto file = MeshExtractor::open(source);
    ASSERT_TRUE(file);
    EXPECT_EQ(*file->extras(), back->extras);
    EXPECT_EQ(*file->step_times(), back->times);
    EXPECT_EQ(*file->steps(0), (std::vector<std::uint64_t>{0, 1, 3}));
  }
}

TEST(MeshExtract, SourcesAreToldWhatWillBeRead) {
  Stepped stepped = with_steps(two_blocks(), Order::keep);
  stepped.options.segment_cells = 30;
  stepped.options.group_cells = 11;
  const Bytes bytes = written(stepped);
  ExtractRequest all, corners = cells(5, 40);
  corners.coordinates = false;
  corners.arrays.emplace();
  ExtractRequest in_box;
  in_box.cells.box = {0, 0, 0, .5, .5, .5};
  for (const ExtractRequest& request : {all, corners, in_box}) {
    ToldSource source(bytes);
    auto file = MeshExtractor::open(source);
    ASSERT_TRUE(file);
    ASSERT_TRUE(file->step_reader());  // reads the step times
    source.untold = 0;
    ASSERT_TRUE(extracted(*file, request));
    EXPECT_EQ(source.untold, 0u);
    EXPECT_GT(source.calls, 1u);
  }
}

TEST(MeshExtract, ThreadsStopWhereItIsDamaged) {
  TestMesh mesh = bent_grid(6, 6, 6);
  WriteOptions options;
  options.segment_cells = 20;
  options.group_cells = 10;
  Bytes bytes = cut_file(mesh, options);
  for (std::size_t at = bytes.size() / 4; at < bytes.size() / 4 + 16; ++at)
    bytes[at] ^= std::byte{0x55};
  for (const unsigned threads : {1u, 3u}) {
    MemoryRandomSource source(bytes);
    auto file = MeshExtractor::open(source);
    ASSERT_TRUE(file);
    ReadOptions how;
    how.threads = threads;
    ASSERT_TRUE(file->begin({}, how));
    std::uint64_t whole = 0;
    auto part = file->next();
    for (; part && *part != nullptr; part = file->next()) whole += (*part)->cell_count();
    ASSERT_FALSE(part);
    EXPECT_EQ(part.error().code, ErrorCode::corrupt);
    EXPECT_GT(whole, 20u);  // everything before the damage is delivered
    EXPECT_LT(whole, 216u);
    EXPECT_EQ(file->next().error().detail, part.error().detail);
    ExtractRequest before = cells(0, 20);
    EXPECT_TRUE(extracted(*file, before, threads));  // the next piece may be undamaged
  }
}

// If extraction with a single thread does not read a damaged group, the damage must not cause an
// error with several threads either.
TEST(MeshExtract, ThreadsFailWhereOneDoes) {
  const TestMesh mesh = two_blocks();
  WriteOptions options;
  options.segment_cells = 15;
  options.group_cells = 6;
  const Bytes whole = cut_file(mesh, options);
  const auto all = requests(whole_of(whole), mesh.schema);
  std::size_t failed = 0, succeeded = 0;
  for (std::size_t at = 40; at < whole.size(); at += 151) {
    Bytes bytes = whole;
    bytes[at] ^= std::byte{0x10};
    MemoryRandomSource source(bytes);
    auto file = MeshExtractor::open(source);
    if (!file) continue;
    for (std::size_t r = at % 3; r < all.size(); r += 3) {
      const auto one = extracted(*file, all[r]);
      for (const std::uint64_t ahead : {std::uint64_t{0}, ReadOptions().max_ahead_bytes}) {
        const auto several = extracted(*file, all[r], 3, ahead);
        ASSERT_EQ(bool(one), bool(several)) << "byte " << at << ", request " << r;
        if (one)
          EXPECT_TRUE(*one == *several) << "byte " << at << ", request " << r;
        else
          EXPECT_EQ(one.error().detail, several.error().detail);
      }
      ++(one ? succeeded : failed);
    }
  }
  EXPECT_GT(failed, 20u);
  EXPECT_GT(succeeded, 20u);
}

TEST(MeshExtract, WhatIsWrongWithStepsIsToldEachTime) {
  const Bytes bytes = steps_and_extras_file(Order::keep);
  MemoryRandomSource source(bytes);
  ReadLimits limits;
  limits.max_steps = 2;
  auto file = MeshExtractor::open(source, limits);
  ASSERT_TRUE(file);
  for (int i = 0; i < 3; ++i) {
    const auto steps = file->steps(0);
    ASSERT_FALSE(steps);
    EXPECT_EQ(steps.error().code, ErrorCode::over_limit);
  }
}

TEST(MeshExtract, NoMesh) {
  const Bytes bytes = cut_file({hexahedra_schema(), {}, 0, {}, {}}, {});
  MemoryRandomSource source(bytes);
  auto file = MeshExtractor::open(source);
  ASSERT_TRUE(file);
  for (const ExtractRequest& request : {ExtractRequest(), cells(0, 0)}) {
    ASSERT_TRUE(file->begin(request));
    for (int i = 0; i < 2; ++i) {
      const auto part = file->next();
      ASSERT_TRUE(part);
      EXPECT_EQ(*part, nullptr);
    }
  }
}

// --- bytes read

constexpr std::uint64_t kBarWidth = kSanitized ? 10 : 16;
constexpr std::uint64_t kBarGroup = kBarWidth * kBarWidth * 8;  // cells

/// Returns a bar of hexahedra with two static arrays and a stepped array. Each segment is one layer
/// of cells.
Stepped bar(Order order) {
  Stepped stepped;
  stepped.mesh = with_order(grid(kBarWidth, kBarWidth, 128, ScalarType::float64, warped), order,
                            order == Order::keep, 0);
  add_array(stepped.mesh, array_of("u", Location::point, ScalarType::float32, 3),
            stepped.mesh.vertices);
  add_array(stepped.mesh, array_of("p", Location::cell, ScalarType::float64),
            stepped.mesh.cells.size());
  const std::uint32_t a =
      add_stepped(stepped.mesh, array_of("w", Location::cell, ScalarType::float32));
  for (std::uint64_t step = 0; step < 4; ++step)
    stepped.values[{a, step}] =
        moving_values(stepped.mesh.schema.arrays[a], stepped.mesh.cells.size(), step);
  stepped.options.segment_cells = 2 * kBarGroup;
  stepped.options.group_cells = kBarGroup;
  stepped.options.key_steps = 1;
  return stepped;
}

/// Extracts the requested piece without step values. Returns the number of bytes that are read from
/// the file after open().
std::uint64_t bytes_of(CountedSource& source, MeshExtractor& file, const ExtractRequest& request) {
  source.bytes = 0;
  const auto begun = file.begin(request);
  EXPECT_TRUE(begun) << (begun ? "" : begun.error().message());
  while (true) {
    const auto part = file.next();
    EXPECT_TRUE(part) << (part ? "" : part.error().message());
    if (!part || *part == nullptr) return source.bytes;
  }
}

TEST(MeshExtract, ReadsWhatItNeeds) {
  for (const Order order : {Order::keep, Order::stream})
    for (const auto codec : {ConnectivityCodec::automatic, ConnectivityCodec::mixed}) {
      Stepped stepped = bar(order);
      stepped.options.connectivity = codec;
      const Bytes bytes = written(stepped);
      CountedSource source(bytes);
      auto file = MeshExtractor::open(source);
      ASSERT_TRUE(file);
      const std::uint64_t head = source.bytes;
      const auto& segments = file->segments();
      ASSERT_EQ(segments.size(), 8u);

      // The request selects all cells of one segment, so only that segment is read.
      const auto third = cells(segments[2].first_cell, segments[2].first_cell + segments[2].cells);
      EXPECT_LE(bytes_of(source, *file, third), segments[2].bytes);
      EXPECT_LT(static_cast<double>(head + source.bytes),
                1.2 * static_cast<double>(segments[2].bytes) + static_cast<double>(head));
      EXPECT_LT(head, bytes.size() / 10);
      // If a single cell is requested, only its group and the groups before it in the same segment
      // are read.
      EXPECT_LT(bytes_of(source, *file, cells(segments[2].first_cell, segments[2].first_cell + 1)),
                segments[2].bytes * 6 / 10);
      // Requests a box around the middle fifth of the same segment.
      ExtractRequest in;
      const double low = segments[2].box[2], high = segments[2].box[5];
      in.cells.box = {-100, -100, low + .4 * (high - low), 100, 100, low + .6 * (high - low)};
      std::uint64_t meeting = 0;
      for (const SegmentInfo& segment : segments)
        if (segment.box[2] <= in.cells.box->at(5) && segment.box[5] >= in.cells.box->at(2))
          meeting += segment.bytes;
      EXPECT_LT(meeting, bytes.size() / 2);
      EXPECT_LE(bytes_of(source, *file, in), meeting);
      EXPECT_GT(file->cell_numbers().size(), 0u);
      // Data of arrays that the request does not name is not read.
      ExtractRequest bare = third;
      bare.arrays.emplace();
      const std::uint64_t without = bytes_of(source, *file, bare);
      bare.arrays = {{0}};
      const std::uint64_t with = bytes_of(source, *file, bare);
      EXPECT_LT(without, with);
      EXPECT_LT(with, segments[2].bytes);
      // A single vertex.
      ExtractRequest vertex;
      vertex.vertices = {{segments[2].first_vertex + 5}};
      EXPECT_LT(bytes_of(source, *file, vertex),
                order == Order::stream ? segments[2].bytes : bytes.size() / 2);

      // Reading the values of a step in this segment must read each chunk of these values exactly
      // once. steps() opens the StepReader before the measurement.
      ASSERT_TRUE(file->steps(2));
      bytes_of(source, *file, third);
      std::uint64_t chunks = 0;
      with_index(bytes, [&](container::Index& index) {
        for (const IndexEntry& entry : index.entries)
          if (entry.parts.size() == 1 && entry.parts[0].step == 2 && entry.parts[0].group / 2 == 2)
            chunks += entry.bytes;
      });
      source.bytes = 0;
      ASSERT_TRUE(file->begin_values(2, 2));
      while (true) {
        const auto values = file->next_values();
        ASSERT_TRUE(values) << values.error().message();
        if (*values == nullptr) break;
      }
      EXPECT_GE(source.bytes, chunks);
      EXPECT_LE(source.bytes, chunks + segments[2].bytes / 2);  // may read connectivity, too
    }
}

TEST(MeshExtract, BlocksAreFoundWhereTheyStand) {
  for (const Order order : {Order::keep, Order::stream}) {
    Stepped stepped = bar(order);
    for (int b = 2; b <= 4; ++b)
      stepped.mesh.schema.blocks.push_back({b, "", CellShape::hexahedron, 8});
    const std::size_t quarter = stepped.mesh.cells.size() / 4;
    for (std::size_t c = 0; c < stepped.mesh.cells.size(); ++c)
      stepped.mesh.cells[c].block = static_cast<std::uint32_t>(c / quarter);
    const Bytes bytes = written(stepped);
    CountedSource source(bytes);
    auto file = MeshExtractor::open(source);
    ASSERT_TRUE(file);
    ExtractRequest request;
    request.cells.blocks = {{2}};
    const auto& segments = file->segments();
    ASSERT_EQ(segments.size(), 8u);
    EXPECT_LE(bytes_of(source, *file, request), segments[4].bytes + segments[5].bytes);
    EXPECT_EQ(file->cell_numbers().size(), quarter);
  }
  // Blocks 1 and 2 alternate from group to group, so the cells of one block are spread across the
  // whole file. The extractor must read the connectivity of a segment to determine whether the
  // segment contains cells of the requested block. If there are none, the extractor must not read
  // any other data of the segment.
  Stepped stepped = bar(Order::keep);
  stepped.options.segment_cells = kBarGroup;
  stepped.mesh.schema.blocks.push_back({2, "", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < stepped.mesh.cells.size(); ++c)
    stepped.mesh.cells[c].block = static_cast<std::uint32_t>(c / kBarGroup % 2);
  const Bytes bytes = written(stepped);
  CountedSource source(bytes);
  auto file = MeshExtractor::open(source);
  ASSERT_TRUE(file);
  ExtractRequest request;
  request.cells.blocks = {{0}};
  std::uint64_t all = 0;
  for (const SegmentInfo& segment : file->segments()) all += segment.bytes;
  EXPECT_LT(bytes_of(source, *file, request), all * 9 / 10);
  EXPECT_EQ(file->cell_numbers().size(), stepped.mesh.cells.size() / 2);
}

// --- errors

/// Runs every third request that requests() returns. Returns the first error.
std::optional<Error> complaint(std::span<const std::byte> bytes, const ByNumber& whole,
                               std::vector<ByNumber>* pieces = nullptr,
                               const ReadLimits& limits = {}) {
  MemoryRandomSource source(bytes);
  auto file = MeshExtractor::open(source, limits);
  if (!file) return file.error();
  if (const auto extras = file->extras(); !extras) return extras.error();
  std::optional<Error> first;
  const std::vector<ExtractRequest> all = requests(whole, file->schema());
  for (std::size_t r = 0; r < all.size(); r += 3) {
    auto piece = extracted(*file, all[r]);
    if (!piece && !first) first = piece.error();
    if (pieces != nullptr) pieces->push_back(piece ? std::move(*piece) : ByNumber());
  }
  return first;
}

Stepped small(Order order) {
  Stepped stepped = with_steps(grid(3, 3, 4, ScalarType::float64, warped), order);
  stepped.options.segment_cells = 12;
  stepped.options.group_cells = 6;
  return stepped;
}

TEST(MeshExtract, TheIndexMayHideCellsAndNothingElse) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Bytes bytes = written(small(order));
    const ByNumber whole = whole_of(bytes);
    ASSERT_FALSE(complaint(bytes, whole));
    for (std::size_t n = 0; n < 6; ++n) {
      // The test uses an index of version 0, because that version also stores fields that can be
      // computed from other fields.
      const auto refused = [&](const char* what, const std::function<void(IndexEntry&)>& lie) {
        const Bytes inconsistent = with_old_index(
            bytes, [&](container::Index& index) { lie(entry_of(index, ChunkKind::group, n)); });
        EXPECT_TRUE(complaint(inconsistent, whole)) << what << " of group " << n;
      };
      refused("segment", [](IndexEntry& e) { e.segment += 1; });
      refused("cells", [](IndexEntry& e) { e.cells += 1; });
      refused("first cell", [](IndexEntry& e) { e.first_cell += 1; });
      refused("vertices", [](IndexEntry& e) { e.vertices -= 1; });
      refused("header", [](IndexEntry& e) { e.header_bytes += 1; });
      refused("large header", [](IndexEntry& e) { e.header_bytes = ~std::uint64_t{0}; });
      refused("offset", [](IndexEntry& e) { e.offset += 32; });
      refused("many bytes", [](IndexEntry& e) { e.bytes = ~std::uint64_t{0}; });
      refused("box", [](IndexEntry& e) { e.box[3] += 1; });
      refused("no box", [](IndexEntry& e) { e.box.fill(std::nan("")); });
      refused("far box", [](IndexEntry& e) { e.box = {50, 50, 50, 51, 51, 51}; });
    }
    // The index states wrong bounding boxes, which do not intersect the requested box. An extractor
    // cannot detect this, so it skips the groups and returns an empty piece.
    const Bytes hidden = with_index(bytes, [](container::Index& index) {
      for (IndexEntry& entry : index.entries) entry.box = {50, 50, 50, 51, 51, 51};
    });
    MemoryRandomSource source(hidden);
    auto file = MeshExtractor::open(source);
    ASSERT_TRUE(file);
    ExtractRequest in;
    in.cells.box = {0, 0, 0, .5, .5, .5};
    const auto piece = extracted(*file, in);
    ASSERT_TRUE(piece);
    EXPECT_TRUE(piece->cells.empty());

    const auto refused = [&](const char* what, const std::function<void(container::Index&)>& lie) {
      EXPECT_TRUE(complaint(with_index(bytes, lie), whole)) << what;
    };
    refused("vertices", [](container::Index& index) { index.vertices += 1; });
    refused("cells", [](container::Index& index) { index.cells -= 1; });
    refused("blocks", [](container::Index& index) { index.block_cells.push_back(0); });
    refused("no blocks", [](container::Index& index) { index.block_cells.clear(); });
    refused("no schema",
            [](container::Index& index) { index.entries.erase(index.entries.begin()); });
  }
}

TEST(MeshExtract, ABlockThatTheIndexCountsWronglyIsNotWhole) {
  TestMesh mesh = two_blocks();
  WriteOptions options;
  options.segment_cells = 40;
  const Bytes bytes = with_index(cut_file(mesh, options), [](container::Index& index) {
    index.block_cells[0] += 10;
    index.block_cells[1] -= 10;
  });
  MemoryRandomSource source(bytes);
  auto file = MeshExtractor::open(source);
  ASSERT_TRUE(file);
  ExtractRequest request;
  request.cells.blocks = {{0}};
  EXPECT_FALSE(extracted(*file, request));
}

/// If a bit of the file is flipped, extraction must either return an error or a correct piece.
TEST(MeshExtract, EveryFlippedBitIsFoundOrDoesNotMatter) {
  const Bytes bytes = written(small(Order::keep));
  const ByNumber whole = whole_of(bytes);
  std::vector<ByNumber> right;
  ASSERT_FALSE(complaint(bytes, whole, &right));
  Bytes damaged = bytes;
  for (std::size_t i = 0; i < bytes.size(); i += 29 * every(7)) {
    damaged[i] ^= std::byte{1} << i % 8;
    std::vector<ByNumber> pieces;
    complaint(damaged, whole, &pieces);
    for (std::size_t p = 0; p < pieces.size(); ++p)
      EXPECT_TRUE(pieces[p] == right[p] || pieces[p] == ByNumber()) << "byte " << i;
    damaged[i] = bytes[i];
  }
}

TEST(MeshExtract, LiesOfAllKindsEndSomehow) {
  for (const Order order : {Order::keep, Order::stream}) {
    const Bytes bytes = written(small(order));
    const ByNumber whole = whole_of(bytes);
    std::mt19937_64 random(11);
    for (std::size_t i = 0; i < 150 / every(10); ++i) {
      // Changes a byte of a chunk and recomputes its checksums.
      FileParts parts = take_apart(bytes);
      Chunk& chunk = parts.chunks[random() % parts.chunks.size()];
      if (chunk.payload.empty()) continue;
      chunk.payload[random() % chunk.payload.size()] ^= std::byte{1} << random() % 8;
      if (chunk.is(ChunkKind::group))
        if (auto group = take_group_apart(chunk)) chunk.payload = put_group_together(*group);
      MemoryRandomSource source(put_together(parts));
      complaint(put_together(parts), whole);
    }
  }
}

TEST(MeshExtract, EveryCutIsFound) {
  const Bytes bytes = written(small(Order::stream));
  for (std::size_t size = 0; size < bytes.size(); size += every(7)) {
    MemoryRandomSource source{std::span(bytes).first(size)};
    EXPECT_FALSE(MeshExtractor::open(source)) << size;
  }
}

TEST(MeshExtract, LimitsAreKept) {
  const Bytes bytes = written(small(Order::keep));
  const ByNumber whole = whole_of(bytes);
  const auto over = [&](const std::function<void(ReadLimits&)>& set) {
    ReadLimits limits;
    set(limits);
    const auto error = complaint(bytes, whole, nullptr, limits);
    return error && error->code == ErrorCode::over_limit;
  };
  EXPECT_TRUE(over([](ReadLimits& limits) { limits.max_active_vertices = 3; }));
  EXPECT_TRUE(over([](ReadLimits& limits) { limits.max_group_bytes = 100; }));
  EXPECT_TRUE(over([](ReadLimits& limits) { limits.max_chunk_bytes = 300; }));
  const Bytes extras = steps_and_extras_file(Order::keep);
  MemoryRandomSource source(extras);
  ReadLimits limits;
  limits.max_extra_bytes = 50;
  auto file = MeshExtractor::open(source, limits);
  ASSERT_TRUE(file);
  const auto read = file->extras();
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, ErrorCode::over_limit);
}

TEST(MeshExtract, WrongUse) {
  const Bytes bytes = written(small(Order::keep));
  MemoryRandomSource source(bytes);
  auto file = MeshExtractor::open(source);
  ASSERT_TRUE(file);
  EXPECT_EQ(file->next().error().code, ErrorCode::misuse);
  const auto refused = [&](const std::function<void(ExtractRequest&)>& set) {
    ExtractRequest request;
    set(request);
    const auto begun = file->begin(request);
    EXPECT_FALSE(begun);
    return !begun && begun.error().code == ErrorCode::misuse;
  };
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.range = {5, 4}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.range = {5, 37}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.numbers = {{3, 3}}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.numbers = {{60}}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.blocks = {{1}}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.box = {0, 0, 1, 1, 1, 0}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.cells.box = {0, 0, std::nan(""), 1, 1, 0}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.vertices = {{4, 2}}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) { r.arrays = {{99}}; }));
  EXPECT_TRUE(refused([](ExtractRequest& r) {
    r.vertices = {{4}};
    r.cells.range = {0, 1};
  }));
  ExtractRequest beyond;
  beyond.vertices = {{1, 100000}};
  ASSERT_TRUE(file->begin(beyond));
  Result<MeshBlock*> part = file->next();
  while (part && *part != nullptr) part = file->next();
  ASSERT_FALSE(part);
  EXPECT_EQ(part.error().code, ErrorCode::misuse);

  ASSERT_TRUE(file->begin(cells(0, 1)));
  EXPECT_EQ(file->begin_values(0, 0).error().code, ErrorCode::misuse);  // too early
  ASSERT_TRUE(extracted(*file, cells(0, 1)));
  EXPECT_TRUE(file->begin_values(0, 0));
  EXPECT_EQ(file->begin_values(0, 3).error().code, ErrorCode::misuse);   // no such step
  EXPECT_EQ(file->begin_values(77, 0).error().code, ErrorCode::misuse);  // no such array
}

}  // namespace
}  // namespace shm
