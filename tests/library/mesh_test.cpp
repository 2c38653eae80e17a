// Tests that whole meshes are written and read back unchanged, in orders `keep` and `stream`.
#include "shm/mesh.h"

#include <filesystem>
#include <fstream>
#include <limits>

#include "shm/version.h"
#include "support/temporary_folder.h"
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
  // The set still refers to the same points, although the points were renumbered and the data of
  // the set was reordered.
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
  // The mesh is already in stream order. Writing it again may change vertex and cell numbers, but
  // not the order of blocks.
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

// A caller can pass arrays of 32-bit numbers. If the blocks state the number of corners per cell,
// the caller need not pass corner offsets.
TEST(WholeMesh, ArraysOfSomebodyElseAreTheSameMesh) {
  const Mesh mesh = sample(Order::keep, 0);
  const std::vector<std::uint32_t> corners(mesh.corners.begin(), mesh.corners.end());
  MeshArrays arrays;
  arrays.xyz = mesh.xyz;
  arrays.cells = mesh.cell_count();
  arrays.cell_blocks = mesh.cell_blocks;
  arrays.corners = NumberSpan(corners);
  arrays.arrays.assign(mesh.arrays.begin(), mesh.arrays.end());
  Mesh still = mesh;  // without the data that follows the mesh
  still.steps.assign(mesh.steps.size(), {});
  still.step_times.clear();
  still.extras.clear();
  MemorySink expected, sink;
  ASSERT_TRUE(write_mesh(expected, still));
  auto writer = Writer::create(sink, mesh.schema);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->add_mesh(arrays));
  ASSERT_TRUE(writer->end_mesh());
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(sink.bytes, expected.bytes);
}

// Adding many elements in one call must write the same file as adding them one at a time.
TEST(WholeMesh, BatchesAreAsSingleCalls) {
  Schema schema;
  schema.order = Order::stream;
  schema.blocks.push_back({1, "row", CellShape::hexahedron, 8});
  schema.arrays.push_back({"height", Location::point, ScalarType::float32, 1});
  schema.arrays.push_back({"part", Location::cell, ScalarType::uint16, 1});
  constexpr std::size_t kCells = 5, kVertices = 4 * (kCells + 1);
  std::vector<std::uint64_t> numbers, corners, last_uses(kCells, 0x0f);
  std::vector<double> xyz;
  std::vector<float> heights;
  std::vector<std::uint16_t> parts;
  last_uses.back() = 0xff;
  for (std::size_t v = 0; v < kVertices; ++v) {
    numbers.push_back(100 + v);
    xyz.insert(xyz.end(), {v % 4 == 1 || v % 4 == 2 ? 1.0 : 0.0, v % 4 >= 2 ? 1.0 : 0.0,
                           static_cast<double>(v / 4)});
    heights.push_back(static_cast<float>(v) / 3);
  }
  for (std::size_t c = 0; c < kCells; ++c) {
    for (std::size_t i = 0; i < 8; ++i) corners.push_back(100 + 4 * c + i);
    parts.push_back(static_cast<std::uint16_t>(c * c));
  }
  const auto points = std::as_bytes(std::span(xyz)),
             of_vertices = std::as_bytes(std::span(heights)),
             of_cells = std::as_bytes(std::span(parts));
  MemorySink one, many;
  auto writer = Writer::create(one, schema);
  for (std::size_t v = 0; v < kVertices; ++v)
    ASSERT_TRUE(
        writer->add_vertex(numbers[v], points.subspan(24 * v, 24), of_vertices.subspan(4 * v, 4)));
  for (std::size_t c = 0; c < kCells; ++c)
    ASSERT_TRUE(writer->add_cell(0, std::span(corners).subspan(8 * c, 8), last_uses[c],
                                 of_cells.subspan(2 * c, 2)));
  ASSERT_TRUE(writer->finish());
  writer = Writer::create(many, schema);
  ASSERT_TRUE(writer->add_vertices(numbers, points, of_vertices));
  ASSERT_TRUE(writer->add_cells(0, 2, std::span(corners).first(16), std::span(last_uses).first(2),
                                of_cells.first(4)));
  ASSERT_TRUE(writer->add_cells(0, kCells - 2, std::span(corners).subspan(16),
                                std::span(last_uses).subspan(2), of_cells.subspan(4)));
  ASSERT_TRUE(writer->finish());
  EXPECT_EQ(one.bytes, many.bytes);

  for (int fault = 0; fault < 6; ++fault) {
    MemorySink sink;
    writer = Writer::create(sink, schema);
    Result<void> added;
    if (fault == 0) added = writer->add_vertices(numbers, points.first(24), of_vertices);
    if (fault == 1) added = writer->add_vertices(numbers, points, of_vertices.first(4));
    if (fault >= 2) {
      ASSERT_TRUE(writer->add_vertices(numbers, points, of_vertices));
    }
    if (fault == 2) added = writer->add_cells(1, kCells, corners, last_uses, of_cells);
    if (fault == 3) added = writer->add_cells(0, kCells - 1, corners, {}, of_cells.first(8));
    if (fault == 4)
      added = writer->add_cells(0, kCells, corners, std::span(last_uses).first(1), of_cells);
    if (fault == 5) added = writer->add_mesh({});
    ASSERT_FALSE(added) << "fault " << fault;
    EXPECT_EQ(added.error().code, ErrorCode::misuse);
  }
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
    const auto added = writer->add_mesh(arrays);
    ASSERT_FALSE(added) << "fault " << fault;
    EXPECT_EQ(added.error().code, ErrorCode::misuse);
  }
}

std::vector<std::array<double, 3>> cube_points() {
  return {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 2}, {0, 1, 1}};
}

TEST(WholeMesh, IsMadeOfVectorsAndGivesThemBack) {
  const std::vector<std::array<std::uint64_t, 8>> cells{{0, 1, 2, 3, 4, 5, 6, 7}};
  Mesh mesh = Mesh::of_hexahedra(cube_points(), cells);
  const std::vector<std::int16_t> material{7};
  const std::vector<float> velocity(24, .5F);
  const auto m = mesh.add_array<std::int16_t>("m", Location::cell, material);
  const auto u = mesh.add_array<float>("u", Location::point, velocity, 3);
  for (const std::size_t step : {std::size_t{0}, std::size_t{2}})
    mesh.add_step<double>("t", Location::cell, step, std::vector{1.0 + static_cast<double>(step)});
  const auto back = there_and_back(mesh);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->hexahedra(), cells);
  EXPECT_TRUE(back->hexahedra(1).empty());
  EXPECT_EQ(back->bounds(), (std::array<double, 6>{0, 0, 0, 1, 1, 2}));
  EXPECT_EQ(back->points_as<float>()[20], 2);
  EXPECT_EQ(back->find_array(Location::cell, "m"), m);
  EXPECT_EQ(back->find_array(Location::point, "u"), u);
  EXPECT_EQ(back->find_array(Location::point, "m"), std::nullopt);
  EXPECT_EQ(back->values_as<double>(m), std::vector{7.0});
  EXPECT_EQ(back->values_as<float>(u), velocity);
  const auto t = back->find_array(Location::cell, "t");
  ASSERT_TRUE(t);
  EXPECT_EQ(back->values_as<int>(*t), std::vector{1});
  EXPECT_TRUE(back->values_as<int>(*t, 1).empty());
  EXPECT_EQ(back->values_as<int>(*t, 2), std::vector{3});
  EXPECT_TRUE(back->values_as<int>(*t, 9).empty());
  EXPECT_TRUE(back->values(99).empty());
  EXPECT_EQ(Mesh().bounds()[0], std::numeric_limits<double>::infinity());
}

TEST(WholeMesh, NumbersThatDoNotCountAreRefused) {
  for (const std::size_t odd : {0u, 3u, 7u})
    for (const std::uint64_t number : {std::uint64_t{1} << 32, std::uint64_t{9}}) {
      Schema schema;
      schema.coordinate_type = ScalarType::float32;
      schema.blocks.push_back({1, "", CellShape::hexahedron, 8});
      MemorySink sink;
      auto writer = Writer::create(sink, schema);
      ASSERT_TRUE(writer);
      std::array<std::uint64_t, 8> corners{0, 1, 2, 3, 4, 5, 6, 7};
      corners[odd] = number;
      const std::array<float, 3> xyz{};
      for (const std::uint64_t corner : corners)
        ASSERT_TRUE(writer->add_vertex(corner, std::as_bytes(std::span(xyz))));
      ASSERT_TRUE(writer->add_cell(0, corners, 0xff));
      ASSERT_TRUE(writer->end_mesh() && writer->finish());
      MemorySource source(sink.bytes);
      const auto mesh = read_mesh(source);
      ASSERT_FALSE(mesh) << odd << " " << number;
      EXPECT_EQ(mesh.error().code, ErrorCode::corrupt);
    }
}

TEST(WholeMesh, NumbersOfEveryTypeAreConverted) {
  const auto as_doubles = []<class T>(T value) {
    const std::vector<T> values{value, T{2}};
    return numbers_as<double>(scalar_type_of<T>(), std::as_bytes(std::span(values)));
  };
  EXPECT_EQ(as_doubles(std::int8_t{-3}), (std::vector{-3.0, 2.0}));
  EXPECT_EQ(as_doubles(std::uint8_t{200}), (std::vector{200.0, 2.0}));
  EXPECT_EQ(as_doubles(std::int16_t{-300}), (std::vector{-300.0, 2.0}));
  EXPECT_EQ(as_doubles(std::uint16_t{60000}), (std::vector{60000.0, 2.0}));
  EXPECT_EQ(as_doubles(std::int32_t{-70000}), (std::vector{-70000.0, 2.0}));
  EXPECT_EQ(as_doubles(std::uint32_t{4000000000}), (std::vector{4e9, 2.0}));
  EXPECT_EQ(as_doubles(std::int64_t{-5}), (std::vector{-5.0, 2.0}));
  EXPECT_EQ(as_doubles(std::uint64_t{5}), (std::vector{5.0, 2.0}));
  EXPECT_EQ(as_doubles(.5F), (std::vector{.5, 2.0}));
  EXPECT_EQ(as_doubles(.25), (std::vector{.25, 2.0}));
}

TEST(WholeMesh, FilesAreWrittenAndReadByName) {
  const TemporaryFolder folder;
  const std::string path = folder / "mesh.shm";
  const Mesh mesh = sample(Order::keep, 0);
  ASSERT_TRUE(write_file(path, mesh));
  const auto back = read_file(path);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(*back, mesh);
  EXPECT_EQ(write_file(path, mesh).error().detail, "exists already");
  EXPECT_TRUE(write_file(path, mesh, {}, FileSink::Existing::replace));
  EXPECT_EQ(read_file(folder / "none").error().code, ErrorCode::io);
  std::ofstream(folder / "other") << "no mesh at all, but long enough to be looked at";
  const auto other = read_file(folder / "other");
  ASSERT_FALSE(other);
  EXPECT_EQ(other.error().file, folder / "other");
  Mesh wrong = mesh;
  wrong.corners[0] = mesh.vertex_count();
  EXPECT_EQ(write_file(folder / "wrong", wrong).error().code, ErrorCode::misuse);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 2);
}

TEST(WholeMesh, VersionsAreOne) {
  EXPECT_EQ(library_version(), Version());
  std::ifstream in(std::string(SHM_SOURCE_DIR) + "/CMakeLists.txt");
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::string version = std::to_string(kVersionMajor) + "." + std::to_string(kVersionMinor) +
                              "." + std::to_string(kVersionPatch);
  EXPECT_NE(text.find("VERSION " + version + "\n"), std::string::npos);
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
