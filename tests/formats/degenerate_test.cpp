// Round trips of every degenerate and non-manifold family of meshes. The meshes pass through Writer
// and Reader with every codec, in orders `keep` and `stream`, with delay buffers and short
// segments. They also pass through the converters in every order.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <string>

#include "compare/compare.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "support/coded_meshes.h"
#include "support/degenerate_families.h"
#include "support/memory_mesh.h"
#include "support/sanitized.h"

namespace shm {
namespace {

class EveryFamily : public ::testing::TestWithParam<std::size_t> {
 protected:
  const TestMesh& mesh() const { return degenerate_families()[GetParam()].mesh; }
};

std::string name_of(const ::testing::TestParamInfo<std::size_t>& parameter) {
  std::string name = degenerate_families()[parameter.param].name;
  std::replace_if(
      name.begin(), name.end(),
      [](char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0; }, '_');
  return name;
}

void expect_round_trips(const TestMesh& mesh, ConnectivityCodec codec, SomeCases& some) {
  for (const std::uint64_t segment_cells : {0, 5}) {
    // Coding with short segments is slow. Short segments are tested only with a short delay buffer
    // and, in order `keep`, without a delay buffer.
    if (segment_cells > 0 && mesh.schema.delay != (mesh.schema.order == Order::keep ? 0 : 7))
      continue;
    if (some.skips_next()) continue;
    SCOPED_TRACE("codec " + std::to_string(static_cast<int>(codec)) + ", " +
                 std::string(order_name(mesh.schema.order)) + ", delay " +
                 std::to_string(mesh.schema.delay) + ", segments of " +
                 std::to_string(segment_cells));
    WriteOptions options;
    options.connectivity = codec;
    options.segment_cells = segment_cells;
    expect_round_trip(mesh, options);
  }
}

TEST_P(EveryFamily, ThroughWriterAndReader) {
  TestMesh copy = mesh();
  SomeCases some(5);
  copy.schema.delay = 0;
  for (const auto codec : codecs_for(copy.schema))
    for (const std::uint32_t delay : {0u, 7u, 300u}) {
      copy.schema.delay = delay;
      copy.schema.order = Order::keep;
      copy.schema.corner_order = true;
      if (!can_be_in(copy.schema, codec)) continue;
      expect_round_trips(copy, codec, some);
      copy.schema.order = Order::stream;
      copy.schema.corner_order = false;
      expect_round_trips(copy, codec, some);
      copy.schema.corner_order = true;
      if (delay == 7) expect_round_trips(copy, codec, some);
    }
}

converters::MemoryMesh source_of(const TestMesh& mesh) {
  converters::MemoryMesh source;
  source.mesh.schema = mesh.schema;
  source.mesh.vertices = mesh.vertices;
  source.mesh.block_cells = {0};
  source.points = mesh.xyz;
  for (const TestCell& cell : mesh.cells) source.add_cell(cell.block, cell.corners);
  std::vector<std::int32_t> numbers(mesh.cells.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  source.add_array<std::int32_t>(
      {"number", Location::cell, ScalarType::int32, 1, false, {}, "", {}}, {numbers});
  return source;
}

TEST_P(EveryFamily, ThroughTheConverters) {
  converters::MemoryMesh source = source_of(mesh());
  SomeCases some(3);
  for (const Order order : {Order::keep, Order::stream, Order::free})
    for (const auto codec : {ConnectivityCodec::automatic, ConnectivityCodec::paper})
      for (const std::uint32_t delay : {0u, 20u}) {
        if (order == Order::free && delay > 0) continue;
        if (some.skips_next()) continue;
        SCOPED_TRACE(std::string(order_name(order)) + ", codec " +
                     std::to_string(static_cast<int>(codec)) + ", delay " + std::to_string(delay));
        converters::Spool spool(::testing::TempDir());
        MemorySink sink;
        converters::CompressOptions options;
        options.order = order;
        options.connectivity = codec;
        options.delay = delay;
        converters::compress_mesh(source, sink, options, spool);
        MemorySource file(sink.bytes);
        converters::StagedMesh restored(file, "test.shm", spool);
        const auto report = converters::compare_meshes(source, restored, spool);
        EXPECT_TRUE(report.equal()) << (report.first.empty() ? "" : report.first.front());
      }
}

INSTANTIATE_TEST_SUITE_P(Degenerate, EveryFamily,
                         ::testing::Range<std::size_t>(0, degenerate_families().size()), name_of);

/// Returns the total size of the streams that encode the corners of cells, in bits per hexahedron.
double connectivity_bits(TestMesh mesh, Order order) {
  mesh.schema.order = order;
  mesh.schema.corner_order = order == Order::keep;
  SizeReport sizes;
  expect_round_trip(mesh, {}, &sizes);
  std::uint64_t bytes = 0;
  for (const char* stream : {"connectivity", "corner order", "vertex numbers", "cell numbers"})
    if (sizes.streams.contains(stream)) bytes += sizes.streams.at(stream);
  return 8 * static_cast<double>(bytes) / static_cast<double>(mesh.cells.size());
}

TEST(Collapsed, FourThousandHexahedraTakeFewBits) {
  struct Case {
    const char* name;
    TestMesh mesh;
  };
  std::mt19937_64 random(1);
  Case cases[] = {{"prisms in layers", layered_prisms(16, 8)},
                  {"sectors of a cylinder", sectors(64, 64)},
                  {"prisms, numbered and turned at random", layered_prisms(16, 8)},
                  {"pyramids", pyramids(9)},
                  {"tetrahedra", tetrahedra(9)}};
  shuffle_vertices(cases[2].mesh, random);
  rotate_corners(cases[2].mesh, random, false);
  for (Case& each : cases) {
    each.mesh.cells.resize(std::min<std::size_t>(each.mesh.cells.size(), 4096));
    EXPECT_EQ(each.mesh.cells.size(), 4096u);
    const double stream = connectivity_bits(each.mesh, Order::stream);
    const double keep = connectivity_bits(each.mesh, Order::keep);
    std::printf("4096 collapsed hexahedra, %s: %.2f bits a hexahedron in stream, %.2f in keep\n",
                each.name, stream, keep);
    EXPECT_LE(stream, 12) << each.name;
    EXPECT_LE(keep, 20) << each.name;  // random numbers alone need about 12
  }
}

// No cell of this mesh uses a vertex. A group therefore contains cells but no vertices, and the
// point array has no values in that group.
TEST(CellsWithoutNodes, BesideAPointArray) {
  TestMesh mesh;
  mesh.schema.blocks = {{1, "nothing", CellShape::polygon, 0}};
  mesh.schema.arrays = {{"height", Location::point, ScalarType::float64, 1, false, {}, "", {}}};
  mesh.set_points({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}});
  mesh.cells.resize(20);
  mesh.arrays.resize(1);
  for (double height : {1., 2., 3.}) append(mesh.arrays[0], height);
  SomeCases all(1);
  for (const auto codec : codecs_for(mesh.schema)) expect_round_trips(mesh, codec, all);
}

}  // namespace
}  // namespace shm
