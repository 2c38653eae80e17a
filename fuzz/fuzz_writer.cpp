// Writes an arbitrary mesh with the Writer and reads it back. The input of the target chooses
// schema, options, cells and values. The mesh must be restored exactly. Writing it again, with or
// without threads, must produce the same bytes. The Writer must refuse invalid calls, and must
// still work afterwards.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "choices.h"
#include "shm/mesh.h"
#include "support/test_mesh.h"

namespace {

/// Appends `count` scalars to `out`: smooth values, repeated values, or random bits.
void add_values(std::vector<std::byte>& out, shm::ScalarType type, std::size_t count, Choices& in) {
  const std::size_t width = shm::scalar_bytes(type);
  const std::uint32_t how = in.below(3);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t b = 0; b < width; ++b)
      out.push_back(static_cast<std::byte>(how == 0   ? (b == 0 ? i : 0)
                                           : how == 1 ? (b + 1 == width ? 0x40 : 7)
                                                      : in.byte()));
}

shm::TestMesh make_mesh(Choices& in) {
  using enum shm::CellShape;
  constexpr struct {
    shm::CellShape shape;
    std::uint32_t nodes;
  } kShapes[] = {{hexahedron, 8}, {hexahedron, 20}, {hexahedron, 27}, {tetrahedron, 4},
                 {wedge, 6},      {pyramid, 5},     {quad, 4},        {line, 2},
                 {vertex, 1},     {polygon, 0}};
  shm::TestMesh mesh;
  shm::Schema& schema = mesh.schema;
  schema.coordinate_type = in.flag() ? shm::ScalarType::float64 : shm::ScalarType::float32;
  schema.order = in.flag() ? shm::Order::stream : shm::Order::keep;
  schema.corner_order = schema.order == shm::Order::keep || in.flag();
  schema.delay = in.below(4) == 0 ? in.below(20) : 0;
  const std::uint32_t blocks = 1 + in.below(3);
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const auto& shape = kShapes[in.flag() ? 0 : in.below(std::size(kShapes))];
    schema.blocks.push_back({static_cast<std::int64_t>(b + 1), "b", shape.shape, shape.nodes});
  }
  const std::uint32_t arrays = in.below(4);
  for (std::uint32_t a = 0; a < arrays; ++a) {
    shm::ArrayInfo info;
    info.name = "a" + std::to_string(a);
    info.location = in.flag() ? shm::Location::point : shm::Location::cell;
    info.type = static_cast<shm::ScalarType>(1 + in.below(10));
    info.components = 1 + in.below(3);
    if (info.location == shm::Location::cell && in.flag()) info.blocks = {in.below(blocks)};
    schema.arrays.push_back(info);
  }
  // Most cells are cells of a regular grid; the others have arbitrary nodes.
  const std::uint32_t n = 1 + in.below(5), m = n + 1;
  mesh.vertices = m * m * m;
  const std::uint32_t cells = in.below(n * n * n + 1);
  for (std::uint32_t c = 0; c < cells; ++c) {
    shm::TestCell cell;
    cell.block = in.below(8) == 0 ? in.below(blocks) : 0;
    const shm::BlockInfo& block = schema.blocks[cell.block];
    const std::uint32_t nodes = block.nodes_per_cell == 0 ? in.below(7) : block.nodes_per_cell;
    const std::uint32_t first = c / (n * n) * m * m + c / n % n * m + c % n;
    const std::uint32_t by[] = {0, 1, m + 1, m, m * m, m * m + 1, m * m + m + 1, m * m + m};
    const bool wild = in.below(8) == 0;
    for (std::uint32_t i = 0; i < nodes; ++i)
      cell.corners.push_back(wild ? in.below(static_cast<std::uint32_t>(mesh.vertices))
                                  : (first + by[i % 8] + i / 8) % mesh.vertices);
    mesh.cells.push_back(std::move(cell));
  }
  add_values(mesh.xyz, schema.coordinate_type, 3 * mesh.vertices, in);
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    std::size_t elements = mesh.vertices;
    if (schema.arrays[a].location == shm::Location::cell)
      elements = static_cast<std::size_t>(
          std::count_if(mesh.cells.begin(), mesh.cells.end(),
                        [&](auto& cell) { return schema.array_covers(a, cell.block); }));
    add_values(mesh.arrays.emplace_back(), schema.arrays[a].type,
               elements * schema.arrays[a].components, in);
  }
  return mesh;
}

shm::WriteOptions make_options(Choices& in) {
  shm::WriteOptions options;
  options.level = static_cast<shm::Level>(in.below(3));
  options.connectivity = any_codec(in);
  options.group_cells = 1 + in.below(40);
  if (in.flag()) options.segment_cells = 1 + in.below(40);
  return options;
}

/// Writes the mesh with time steps and with rounding. The file must be readable. The values of each
/// array at each step must be exactly those that were passed, although their order may differ.
void with_more(shm::TestMesh mesh, const shm::WriteOptions& options, Choices& in) {
  if (in.flag())
    mesh.schema.coordinate_quantization =
        in.flag() ? shm::Quantization::absolute(.25 / (1 + in.byte()), 3)
                  : shm::Quantization{1 + in.below(52), {0, 0, 0}, {1. + in.byte(), 8, 8}};
  for (shm::ArrayInfo& info : mesh.schema.arrays) {
    if (is_float(info.type) && in.flag())
      info.quantization = shm::Quantization::absolute(.5, info.components);
    info.per_step = !info.quantization.lossy() && in.flag();
  }
  std::vector<std::vector<std::byte>> given;
  const auto steps = [&](shm::Writer& writer) -> shm::Result<void> {
    for (std::uint64_t step = 0; step < 3; ++step)
      for (std::uint32_t a = 0; a < mesh.schema.arrays.size(); ++a) {
        const shm::ArrayInfo& info = mesh.schema.arrays[a];
        if (!info.per_step) continue;
        const std::size_t size = mesh.arrays[a].size();
        add_values(given.emplace_back(), info.type, size / shm::scalar_bytes(info.type), in);
        if (auto status = writer.add_step_values(a, step, given.back()); !status) return status;
      }
    return {};
  };
  shm::TestMesh written = mesh;  // arrays with time steps have no static values
  for (std::size_t a = 0; a < mesh.arrays.size(); ++a)
    if (mesh.schema.arrays[a].per_step) written.arrays[a].clear();
  const auto begun = in;
  shm::MemorySink sink, again;
  if (!write_mesh(written, sink, options, steps)) return;
  in = begun;
  given.clear();
  shm::WriteOptions threads = options;
  threads.threads = 2;
  if (!write_mesh(written, again, threads, steps) || again.bytes != sink.bytes) std::abort();
  shm::MemorySource source(sink.bytes);
  const auto back = shm::read_mesh(source);
  if (!back || back->cell_count() != mesh.cells.size()) std::abort();
  const auto sorted = [](std::vector<std::byte> values, std::size_t stride) {
    std::vector<std::vector<std::byte>> out;
    for (std::size_t at = 0; at + stride <= values.size() && stride > 0; at += stride)
      out.emplace_back(values.begin() + static_cast<std::ptrdiff_t>(at),
                       values.begin() + static_cast<std::ptrdiff_t>(at + stride));
    std::sort(out.begin(), out.end());
    return out;
  };
  std::size_t next = 0;
  for (std::size_t step = 0; step < 3; ++step)
    for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a) {
      const shm::ArrayInfo& info = mesh.schema.arrays[a];
      if (!info.per_step) continue;
      const std::size_t stride = info.components * shm::scalar_bytes(info.type);
      const auto& values = given[next++];
      if (values.empty()) continue;
      if (back->steps[a].size() <= step ||
          sorted(back->steps[a][step], stride) != sorted(values, stride))
        std::abort();
    }
}

/// Makes invalid calls to a Writer.
void misuse(const shm::TestMesh& mesh, const shm::WriteOptions& options, Choices& in) {
  shm::NullSink sink;
  auto writer = shm::Writer::create(sink, mesh.schema, options);
  if (!writer) return;
  std::vector<std::byte> bytes(64);
  for (int calls = 0; calls < 64 && !in.empty(); ++calls) {
    const auto some = std::span<const std::byte>(bytes).first(in.below(32));
    std::vector<std::uint64_t> corners(in.below(9));
    for (std::uint64_t& corner : corners) corner = in.below(5);
    switch (in.below(8)) {
      case 0:
      case 1: (void)writer->add_vertex(in.below(8), some, {}); break;
      case 2: (void)writer->add_unused_vertex(in.below(8), some, some); break;
      case 3:
      case 4: (void)writer->add_cell(in.below(4), corners, in.byte(), some); break;
      case 5: (void)writer->end_mesh(); break;
      case 6: (void)writer->add_step_values(in.below(4), in.below(4), some); break;
      default:
        if (in.flag()) (void)writer->finish();
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Choices in(std::span(data, size));
  const bool wrong = in.below(8) == 0;
  const shm::TestMesh mesh = make_mesh(in);
  shm::WriteOptions options = make_options(in);
  if (wrong) {
    misuse(mesh, options, in);
    return 0;
  }
  shm::NullSink none;
  if (!shm::Writer::create(none, mesh.schema, options))
    return 0;  // `options` are invalid, e.g. because the shifts codec allows no delay buffer
  if (in.below(4) == 0) {
    with_more(mesh, options, in);
    return 0;
  }
  const std::vector<std::byte> bytes = shm::expect_round_trip(mesh, options);
  options.threads = 3;
  shm::MemorySink again;
  const auto written = shm::write_mesh(mesh, again, options);
  if (!written || again.bytes != bytes ||
      testing::UnitTest::GetInstance()->ad_hoc_test_result().Failed())
    std::abort();
  return 0;
}
