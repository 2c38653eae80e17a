// The whole-mesh door: what goes in comes out, in both orders.
#include "shm/mesh.h"

#include "support/test_mesh.h"

namespace shm {
namespace {

Mesh sample(Order order, std::uint32_t delay) {
  const TestMesh from = grid(7, 6, 5, ScalarType::float64, warped, porous);
  Mesh mesh;
  mesh.schema = from.schema;
  mesh.schema.order = order;
  mesh.schema.delay = delay;
  mesh.schema.blocks.push_back({2, "others", CellShape::hexahedron, 8});
  mesh.xyz = from.xyz;
  for (std::size_t c = 0; c < from.cells.size(); ++c) {
    mesh.cell_blocks.push_back(c % 3 == 0 ? 1 : 0);
    mesh.corners.insert(mesh.corners.end(), from.cells[c].corners.begin(),
                        from.cells[c].corners.end());
    mesh.corner_begin.push_back(mesh.corners.size());
  }
  for (int kind = 0; kind < 4; ++kind) {
    ArrayInfo info;
    info.name = "a" + std::to_string(kind);
    info.location = kind % 2 == 0 ? Location::point : Location::cell;
    info.type = ScalarType::int32;
    info.per_step = kind >= 2;
    if (kind % 2 == 1) info.blocks = {1};
    const std::uint64_t elements =
        kind % 2 == 0 ? mesh.vertex_count() : (mesh.cell_count() + 2) / 3;
    std::vector<std::byte> values;
    for (std::uint64_t i = 0; i < elements; ++i) append(values, static_cast<std::int32_t>(i * i));
    mesh.schema.arrays.push_back(info);
    mesh.arrays.push_back(info.per_step ? std::vector<std::byte>() : values);
    mesh.steps.push_back(info.per_step ? std::vector{values, values}
                                       : std::vector<std::vector<std::byte>>());
  }
  mesh.step_times = {0.0, 0.25};
  Extra set{"test/vertices", ScalarType::int64, Reference::vertex, {3}, {}};
  for (std::int64_t v : {5, 0, 17}) append(set.data, v);
  mesh.extras.push_back(set);
  return mesh;
}

Result<Mesh> there_and_back(const Mesh& mesh) {
  MemorySink sink;
  if (auto report = write_mesh(sink, mesh); !report) return report.error();
  MemorySource source(sink.bytes);
  return read_mesh(source);
}

TEST(WholeMesh, KeepGivesBackTheSame) {
  for (std::uint32_t delay : {0u, 30u}) {
    const Mesh mesh = sample(Order::keep, delay);
    const auto back = there_and_back(mesh);
    ASSERT_TRUE(back) << back.error().message();
    EXPECT_EQ(*back, mesh);
  }
}

TEST(WholeMesh, StreamRenumbersAllAlike) {
  const Mesh mesh = sample(Order::stream, 30);
  const auto back = there_and_back(mesh);
  ASSERT_TRUE(back) << back.error().message();
  const auto point = [](const Mesh& m, std::uint64_t v) {
    return std::vector(m.xyz.begin() + static_cast<std::ptrdiff_t>(24 * v),
                       m.xyz.begin() + static_cast<std::ptrdiff_t>(24 * v + 24));
  };
  // The set still names the same points, and their data came along.
  for (std::size_t i = 0; i < 3; ++i) {
    std::int64_t before = 0, after = 0;
    std::memcpy(&before, &mesh.extras[0].data[8 * i], 8);
    std::memcpy(&after, &back->extras[0].data[8 * i], 8);
    EXPECT_EQ(point(mesh, static_cast<std::uint64_t>(before)),
              point(*back, static_cast<std::uint64_t>(after)));
    for (std::size_t a : {0u, 2u}) {
      const auto& was = a == 0 ? mesh.arrays[0] : mesh.steps[2][1];
      const auto& is = a == 0 ? back->arrays[0] : back->steps[2][1];
      EXPECT_EQ(std::memcmp(&was[static_cast<std::size_t>(before) * 4],
                            &is[static_cast<std::size_t>(after) * 4], 4),
                0);
    }
  }
  // Writing it again changes nothing any more but the numbers: it is its own stream order.
  Mesh again = *back;
  again.schema.delay = 0;
  const auto third = there_and_back(again);
  ASSERT_TRUE(third);
  EXPECT_EQ(third->cell_blocks, again.cell_blocks);
}

TEST(WholeMesh, OptionsAreThoseOfWriterAndReader) {
  const Mesh mesh = sample(Order::stream, 30);
  RecordedOrder order;
  WriteOptions options;
  options.segment_cells = 40;
  options.level = Level::best;
  options.coding_order = &order;
  MemorySink sink;
  const auto report = write_mesh(sink, mesh, options);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_GT(report->segments, 1u);
  EXPECT_EQ(order.vertices.size(), mesh.vertex_count());
  EXPECT_EQ(order.cells.size(), mesh.cell_count());
  ReadOptions threads;
  threads.threads = 2;
  MemorySource alone(sink.bytes), together(sink.bytes);
  const auto one = read_mesh(alone), two = read_mesh(together, {}, threads);
  ASSERT_TRUE(one && two);
  EXPECT_EQ(*one, *two);
}

// Arrays of somebody else, with numbers of 32 bits, and blocks that say how many corners there are.
TEST(WholeMesh, ArraysOfSomebodyElseAreTheSameMesh) {
  const Mesh mesh = sample(Order::keep, 0);
  const std::vector<std::uint32_t> corners(mesh.corners.begin(), mesh.corners.end());
  MeshArrays arrays;
  arrays.xyz = mesh.xyz;
  arrays.cells = mesh.cell_count();
  arrays.cell_blocks = mesh.cell_blocks;
  arrays.corners = NumberSpan(corners);
  arrays.arrays.assign(mesh.arrays.begin(), mesh.arrays.end());
  Mesh still = mesh;  // without what comes behind the mesh
  still.steps.assign(mesh.steps.size(), {});
  still.step_times.clear();
  still.extras.clear();
  MemorySink expected, sink;
  ASSERT_TRUE(write_mesh(expected, still));
  auto writer = Writer::create(sink, mesh.schema);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(add_mesh(*writer, mesh.schema, arrays));
  ASSERT_TRUE(writer->end_mesh());
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(sink.bytes, expected.bytes);
}

TEST(WholeMesh, ArraysThatDoNotFitAreMisuse) {
  const Mesh mesh = sample(Order::keep, 0);
  const std::vector<std::uint64_t> short_begin(3);
  for (int fault = 0; fault < 6; ++fault) {
    Schema schema = mesh.schema;
    MeshArrays arrays;
    arrays.xyz = mesh.xyz;
    arrays.cells = mesh.cell_count();
    arrays.cell_blocks = mesh.cell_blocks;
    arrays.corners = NumberSpan(mesh.corners);
    arrays.arrays.assign(mesh.arrays.begin(), mesh.arrays.end());
    if (fault == 0) arrays.xyz = arrays.xyz.first(arrays.xyz.size() - 1);
    if (fault == 1) arrays.cells -= 1;
    if (fault == 2) arrays.corner_begin = NumberSpan(short_begin);
    if (fault == 3) schema.blocks[0].nodes_per_cell = 0;
    if (fault == 4) arrays.arrays.pop_back();
    if (fault == 5) arrays.corners = NumberSpan(std::span(mesh.corners).first(9));
    MemorySink sink;
    auto writer = Writer::create(sink, schema);
    ASSERT_TRUE(writer);
    const auto added = add_mesh(*writer, schema, arrays);
    ASSERT_FALSE(added) << "fault " << fault;
    EXPECT_EQ(added.error().code, ErrorCode::misuse);
  }
}

TEST(WholeMesh, RefusesWhatContradictsItself) {
  for (int fault = 0; fault < 5; ++fault) {
    Mesh mesh = sample(Order::keep, 0);
    if (fault == 0) mesh.corners[3] = mesh.vertex_count();
    if (fault == 1) mesh.corner_begin.pop_back();
    if (fault == 2) mesh.cell_blocks[0] = 9;
    if (fault == 3) mesh.arrays[0].pop_back();
    if (fault == 4) mesh.steps[3][0].push_back(std::byte{0});
    MemorySink sink;
    const auto report = write_mesh(sink, mesh);
    ASSERT_FALSE(report) << "fault " << fault;
    EXPECT_EQ(report.error().code, ErrorCode::misuse);
  }
}

}  // namespace
}  // namespace shm
