// Writes and reads every generated family of meshes in orders `keep` and `stream`, with and without
// delay buffers, and with quantized and exact values.
#include <limits>

#include "support/coded_meshes.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

void expect_one_of_some(SomeCases& some, const TestMesh& mesh, const WriteOptions& options) {
  if (!some.skips_next()) expect_round_trip(mesh, options);
}

/// If `codec` can encode the mesh, tests a round trip without a delay buffer: first in one segment,
/// then in several segments.
void expect_without_delay(TestMesh mesh, ConnectivityCodec codec) {
  mesh.schema.delay = 0;
  if (!can_be_in(mesh.schema, codec)) return;
  SomeCases some(4);
  for (const Order order : {Order::keep, Order::stream, Order::free})
    for (const Level level : {Level::fast, Level::standard, Level::best}) {
      SCOPED_TRACE(std::string(codec_name(codec)) + ", order " +
                   std::to_string(static_cast<int>(order)) + ", level " +
                   std::to_string(static_cast<int>(level)));
      mesh.schema.order = order;
      mesh.schema.corner_order = order != Order::free;
      WriteOptions options;
      options.connectivity = codec;
      options.level = level;
      expect_one_of_some(some, mesh, options);
      options.group_cells = 100;
      expect_one_of_some(some, mesh, options);
      options.segment_cells = std::max<std::uint64_t>(mesh.cells.size() / 3, 1);
      expect_one_of_some(some, mesh, options);
    }
}

/// Tests round trips in orders `keep` and `stream`, with and without storing the corner order, and
/// with several sizes of the delay buffer.
void expect_all_modes(TestMesh mesh) {
  for (const auto codec : codecs_without_delay()) expect_without_delay(mesh, codec);
  SomeCases some(5);
  mesh.schema.delay = 1;
  const auto codecs = codecs_for(mesh.schema);
  for (std::uint32_t delay : {0u, 1u, 50u, 1000u}) {
    mesh.schema.delay = delay;
    SCOPED_TRACE("delay " + std::to_string(delay));
    for (const auto codec : codecs) {
      SCOPED_TRACE("codec " + std::to_string(static_cast<int>(codec)));
      WriteOptions options;
      options.connectivity = codec;
      mesh.schema.order = Order::keep;
      mesh.schema.corner_order = true;
      expect_one_of_some(some, mesh, options);
      mesh.schema.order = Order::stream;
      expect_one_of_some(some, mesh, options);
      mesh.schema.corner_order = false;
      options.group_cells = 100;
      expect_one_of_some(some, mesh, options);
    }
  }
}

TEST(RoundTrip, EveryGeneratedMeshInEveryCodec) {
  SomeCases some(5);
  for (const GeneratedMesh& it : generated_meshes())
    for (const Order order : {Order::keep, Order::stream}) {
      const TestMesh mesh = with_order(it.mesh, order, true, 0);
      for (const auto codec : codecs_for(mesh.schema))
        for (const Level level : {Level::fast, Level::standard, Level::best}) {
          SCOPED_TRACE(it.name + ", " + std::string(order_name(order)) + ", " +
                       std::string(codec_name(codec)) + ", level " +
                       std::to_string(static_cast<int>(level)));
          WriteOptions options{.group_cells = 20, .segment_cells = 40};
          options.connectivity = codec;
          options.level = level;
          expect_one_of_some(some, mesh, options);
        }
    }
}

TEST(RoundTrip, EmptyMesh) { expect_all_modes({hexahedra_schema(), {}, 0, {}, {}}); }

TEST(RoundTrip, NoBlocksAtAll) {
  TestMesh mesh;
  expect_round_trip(mesh);
}

TEST(RoundTrip, OneCell) { expect_all_modes(grid(1, 1, 1)); }

TEST(RoundTrip, Grids) {
  expect_all_modes(grid(1, 1, 9));
  expect_all_modes(grid(9, 1, 1));
  expect_all_modes(grid(7, 6, 5));
  expect_all_modes(grid(12, 11, 10, ScalarType::float64, warped));
}

TEST(RoundTrip, NodesFarBehindTheCornersThatTheyRepeat) {
  TestMesh mesh = grid(2, 1, 1);
  mesh.schema.blocks[0].nodes_per_cell = 80;
  for (TestCell& cell : mesh.cells) {
    while (cell.corners.size() < 80) cell.corners.push_back(mesh.vertices++);
    cell.corners[75] = cell.corners[0];
    cell.corners[79] = cell.corners[6];
  }
  mesh.xyz.resize(mesh.vertices * 3 * scalar_bytes(mesh.schema.coordinate_type));
  expect_all_modes(mesh);
}

TEST(RoundTrip, VoxelsWithHoles) {
  expect_all_modes(grid(11, 12, 13, ScalarType::float32, straight, porous));
}

TEST(RoundTrip, Ring) {
  expect_all_modes(ring(12, 4, 6, ScalarType::float64));
  expect_all_modes(ring(3, 2, 2, ScalarType::float32));
  expect_all_modes(ring(2, 3, 2, ScalarType::float32));  // two cells around: they share two faces
  expect_all_modes(ring(1, 3, 2, ScalarType::float32));  // each cell is its own neighbour
}

TEST(RoundTrip, RandomOrders) {
  std::mt19937_64 random(5);
  for (int n = 0; n < 3; ++n) {
    TestMesh mesh = grid(9, 8, 7, ScalarType::float64, warped, n == 1 ? porous : nullptr);
    shuffle_cells(mesh, random);
    if (n > 0) shuffle_vertices(mesh, random);
    expect_all_modes(mesh);
  }
}

TEST(RoundTrip, RandomCornerRotations) {
  std::mt19937_64 random(6);
  TestMesh mesh = grid(8, 7, 6, ScalarType::float32, warped);
  rotate_corners(mesh, random, false);
  expect_all_modes(mesh);
}

TEST(RoundTrip, MirroredHexahedra) {
  std::mt19937_64 random(7);
  TestMesh mesh = grid(8, 7, 6);
  rotate_corners(mesh, random, true);
  expect_all_modes(mesh);
}

TEST(RoundTrip, NonManifold) {
  // The mesh contains every cell three times. It also contains a fan of many cells around one face
  // and one edge.
  TestMesh mesh = grid(3, 3, 3);
  const auto cells = mesh.cells;
  mesh.cells.insert(mesh.cells.end(), cells.begin(), cells.end());
  mesh.cells.insert(mesh.cells.begin(), cells.begin(), cells.end());
  expect_all_modes(mesh);
  TestMesh fan = grid(2, 2, 2);
  std::mt19937_64 random(8);
  for (int n = 0; n < 60; ++n) {
    TestCell cell = fan.cells[0];
    for (std::size_t i = 4; i < 8; ++i) cell.corners[i] = 20 + random() % 7;
    std::sort(cell.corners.begin() + 4, cell.corners.end());
    fan.cells.push_back(cell);
  }
  expect_all_modes(fan);
}

TEST(RoundTrip, DegenerateHexahedra) {
  TestMesh mesh = grid(8, 8, 8);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    auto& v = mesh.cells[c].corners;
    switch (c % 5) {
      case 0:
        v[3] = v[2];
        v[7] = v[6];
        break;                                                 // wedge
      case 1: v[5] = v[6] = v[7] = v[4]; break;                // pyramid
      case 2: std::fill(v.begin() + 1, v.end(), v[0]); break;  // a point
      case 3: v[0] = v[6]; break;                              // opposite corners
      default: break;
    }
  }
  expect_all_modes(mesh);
}

TEST(RoundTrip, TwistedFaces) {
  TestMesh mesh = grid(6, 6, 6);
  for (std::size_t c = 0; c < mesh.cells.size(); c += 3)
    std::swap(mesh.cells[c].corners[5], mesh.cells[c].corners[6]);
  expect_all_modes(mesh);
}

TEST(RoundTrip, UnusedAndDuplicateVertices) {
  TestMesh mesh = grid(5, 5, 5, ScalarType::float32, straight, porous);
  std::vector<std::byte> more(mesh.xyz.begin(), mesh.xyz.end());
  mesh.xyz.insert(mesh.xyz.end(), more.begin(), more.end());  // the same points again, unused
  mesh.vertices *= 2;
  expect_all_modes(mesh);
}

TEST(RoundTrip, SpecialCoordinates) {
  for (ScalarType type : {ScalarType::float32, ScalarType::float64}) {
    TestMesh mesh = grid(6, 5, 4, type, warped);
    const std::array<double, 8> odd = {-0.0,
                                       std::numeric_limits<double>::quiet_NaN(),
                                       std::numeric_limits<double>::infinity(),
                                       -std::numeric_limits<double>::infinity(),
                                       std::numeric_limits<double>::denorm_min(),
                                       1e-42,
                                       3e38,
                                       1e308};
    std::mt19937_64 random(9);
    const std::size_t width = scalar_bytes(type);
    for (int n = 0; n < 60; ++n) {
      const std::size_t at = random() % (mesh.xyz.size() / width) * width;
      std::vector<std::byte> one;
      if (type == ScalarType::float64)
        append(one, odd[random() % 8]);
      else if (n % 4 == 0)
        append(one, static_cast<std::uint32_t>(0x7fc00000u + random() % 5000));  // NaN payloads
      else
        append(one, static_cast<float>(odd[random() % 7]));
      std::copy(one.begin(), one.end(), mesh.xyz.begin() + static_cast<std::ptrdiff_t>(at));
    }
    expect_all_modes(mesh);
  }
}

TEST(RoundTrip, QuadraticAndMixedCells) {
  TestMesh mesh;
  mesh.schema = hexahedra_schema(ScalarType::float64);
  mesh.schema.blocks.push_back({2, "quadratic", CellShape::hexahedron, 20});
  mesh.schema.blocks.push_back({3, "triquadratic", CellShape::hexahedron, 27});
  mesh.schema.blocks.push_back({-4, "tetrahedra", CellShape::tetrahedron, 4});
  mesh.schema.blocks.push_back({5, "polygons", CellShape::polygon, 0});
  mesh.schema.blocks.push_back({6, "empty", CellShape::wedge, 6});
  std::mt19937_64 random(10);
  std::vector<std::array<double, 3>> points(4000);
  for (auto& p : points)
    p = {static_cast<double>(random() % 100), static_cast<double>(random() % 100), 0.5};
  mesh.set_points(points);
  const std::array<std::size_t, 5> sizes = {8, 20, 27, 4, 0};
  for (int c = 0; c < 600; ++c) {
    TestCell cell;
    cell.block = static_cast<std::uint32_t>(random() % 5);
    const std::size_t n = cell.block == 4 ? random() % 100 : sizes[cell.block];
    for (std::size_t i = 0; i < n; ++i)
      cell.corners.push_back(random() % 8 == 0 ? random() % 4000
                                               : (static_cast<std::uint64_t>(c) * 3 + i) % 4000);
    mesh.cells.push_back(cell);
  }
  expect_all_modes(mesh);
  // The codec `shifts` requires that all cells of a block have the same number of nodes.
  std::erase_if(mesh.cells, [](const TestCell& cell) { return cell.block == 4; });
  mesh.schema.blocks[4].nodes_per_cell = 64;
  for (const auto codec : codecs_without_delay()) expect_without_delay(mesh, codec);
}

ArrayInfo array_info(const char* name, Location location, ScalarType type, std::uint32_t components,
                     std::vector<std::uint32_t> blocks = {}) {
  ArrayInfo info;
  info.name = name;
  info.location = location;
  info.type = type;
  info.components = components;
  info.blocks = std::move(blocks);
  return info;
}

TEST(RoundTrip, ArraysOfEveryTypeOnPointsAndCells) {
  TestMesh mesh = grid(7, 6, 5, ScalarType::float32, warped, porous);
  mesh.schema.blocks.push_back({2, "others", CellShape::hexahedron, 8});
  for (std::size_t c = 0; c < mesh.cells.size(); c += 4) mesh.cells[c].block = 1;
  std::mt19937_64 random(11);
  for (int t = 1; t <= 10; ++t)
    for (Location where : {Location::point, Location::cell}) {
      const auto type = static_cast<ScalarType>(t);
      const auto components = static_cast<std::uint32_t>(1 + t % 4);
      std::vector<std::uint32_t> blocks;
      if (where == Location::cell && t % 3 == 0) blocks = {1};
      mesh.schema.arrays.push_back(array_info("a", where, type, components, blocks));
      std::uint64_t elements = mesh.vertices;
      if (where == Location::cell)
        elements = blocks.empty() ? mesh.cells.size() : (mesh.cells.size() + 3) / 4;
      std::vector<std::byte> values;
      for (std::uint64_t i = 0; i < elements * components; ++i) {
        const bool wild = random() % 16 == 0;
        if (type == ScalarType::float32) {
          append(values, wild ? std::bit_cast<float>(static_cast<std::uint32_t>(random()))
                              : static_cast<float>(std::sin(static_cast<double>(i) * .01)));
        } else if (type == ScalarType::float64) {
          append(values,
                 wild ? std::bit_cast<double>(random()) : std::sin(static_cast<double>(i) * .01));
        } else {
          const std::uint64_t v = wild ? random() : i / 7;
          for (std::size_t b = 0; b < scalar_bytes(type); ++b)
            values.push_back(static_cast<std::byte>(v >> (8 * b)));
        }
      }
      mesh.arrays.push_back(std::move(values));
    }
  expect_all_modes(mesh);
}

TEST(RoundTrip, QuantizedValuesKeepThePromise) {
  std::vector<std::pair<ScalarType, ConnectivityCodec>> cases;
  for (const auto type : {ScalarType::float32, ScalarType::float64})
    for (const auto codec : codecs_of_both_kinds()) cases.emplace_back(type, codec);
  for (const auto& [type, codec] : cases)
    for (std::uint32_t bits : {1u, 8u, 12u, 16u, 24u, 40u, 52u}) {
      TestMesh mesh = grid(9, 8, 7, type, warped);
      mesh.schema.coordinate_quantization = {bits, {-1, -1, -1}, {1.1, 1.2, 1.3}};
      const double nan = std::numeric_limits<double>::quiet_NaN();
      if (type == ScalarType::float32) {
        const float odd = static_cast<float>(nan);
        std::memcpy(&mesh.xyz[12], &odd, 4);
      } else {
        std::memcpy(&mesh.xyz[24], &nan, 8);
      }
      WriteOptions options;
      options.connectivity = codec;
      const auto bytes = expect_round_trip(mesh, options);
      const auto back = read_mesh(bytes);
      ASSERT_TRUE(back);
      const double promise = mesh.schema.coordinate_quantization.max_error(type);
      const std::size_t width = scalar_bytes(type);
      double worst = 0;
      for (std::uint64_t i = 0; i < mesh.vertices * 3; ++i) {
        const std::uint64_t source = back->mesh.vertex_numbers[i / 3] * 3 + i % 3;
        double a = 0, b = 0;
        if (width == 4) {
          float x = 0, y = 0;
          std::memcpy(&x, &back->mesh.xyz[i * 4], 4);
          std::memcpy(&y, &mesh.xyz[source * 4], 4);
          a = x, b = y;
        } else {
          std::memcpy(&a, &back->mesh.xyz[i * 8], 8);
          std::memcpy(&b, &mesh.xyz[source * 8], 8);
        }
        EXPECT_EQ(std::isnan(a), std::isnan(b));
        if (!std::isnan(a)) worst = std::max(worst, std::fabs(a - b));
      }
      EXPECT_LE(worst, promise) << bits << " bits";
    }
}

TEST(RoundTrip, StepsTimesAndExtras) {
  TestMesh mesh = grid(20, 20, 20);
  mesh.schema.blocks.push_back({2, "none", CellShape::quad, 4});
  for (int a = 0; a < 3; ++a) {
    auto info = array_info(a == 0   ? "u"
                           : a == 1 ? "p"
                                    : "none",
                           a == 0 ? Location::point : Location::cell,
                           a == 0 ? ScalarType::float64 : ScalarType::float32, a == 0 ? 3 : 1,
                           a == 2 ? std::vector<std::uint32_t>{1} : std::vector<std::uint32_t>{});
    info.per_step = true;
    mesh.schema.arrays.push_back(info);
  }
  mesh.arrays.resize(3);
  MemorySink sink;
  auto writer = Writer::create(sink, mesh.schema);
  ASSERT_TRUE(writer);
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    ASSERT_TRUE(writer->add_vertex(v, std::span(mesh.xyz).subspan(v * 12, 12)));
  for (const TestCell& cell : mesh.cells) ASSERT_TRUE(writer->add_cell(0, cell.corners));
  ASSERT_TRUE(writer->end_mesh());
  std::vector<std::vector<std::byte>> u(3), p(3);
  for (std::uint64_t step = 0; step < 3; ++step) {
    for (std::uint64_t i = 0; i < mesh.vertices * 3; ++i)
      append(u[step], std::sin(static_cast<double>(i * (step + 1)) * 1e-3));
    for (std::uint64_t i = 0; i < mesh.cells.size(); ++i)
      append(p[step], static_cast<float>(i / 100 + step));
    for (std::size_t at = 0; at < u[step].size(); at += 24 * 1000)
      ASSERT_TRUE(writer->add_step_values(
          0, step,
          std::span(u[step]).subspan(at, std::min<std::size_t>(24000, u[step].size() - at))));
    ASSERT_TRUE(writer->add_step_values(1, step, p[step]));
    ASSERT_TRUE(writer->add_step_values(2, step, {}));
  }
  const std::vector<double> times = {0.0, 0.5, 1.25};
  ASSERT_TRUE(writer->set_step_times(times));
  Extra extra{"test/set", ScalarType::int32, Reference::vertex, {2, 3}, {}};
  for (int i = 0; i < 6; ++i) append(extra.data, std::int32_t{i * i});
  ASSERT_TRUE(writer->add_extra(extra));
  const Extra empty{"test/empty", ScalarType::uint8, Reference::nothing, {0}, {}};
  ASSERT_TRUE(writer->add_extra(empty));
  ASSERT_TRUE(writer->finish());
  const auto back = read_mesh(sink.bytes);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->times, times);
  EXPECT_EQ(back->totals.steps, 3u);
  ASSERT_EQ(back->extras.size(), 2u);
  EXPECT_EQ(back->extras[0], extra);
  EXPECT_EQ(back->extras[1], empty);
  std::vector<std::vector<std::byte>> u2(3), p2(3);
  for (const StepPiece& piece : back->steps) {
    auto& to = piece.array == 0 ? u2[piece.step] : p2[piece.step];
    to.insert(to.end(), piece.values.begin(), piece.values.end());
  }
  EXPECT_EQ(p2, p);
  // Point values are returned in coding order. In this file, the coding order of the points equals
  // their order in the source.
  for (std::uint64_t step = 0; step < 3; ++step) {
    std::vector<std::byte> expected = u[step];
    EXPECT_EQ(u2[step], expected);
  }
}

// The patterns refer to cells that are further back than the initial window of the codec. The
// encoder enlarges the window for the next group.
TEST(RoundTrip, PatternsThatReachFarBack) {
  TestMesh mesh;
  mesh.schema.blocks = {{1, "lines", CellShape::line, 2}};
  constexpr std::uint64_t kLines = 70000;
  for (std::uint64_t v = 0; v <= kLines; ++v) append_point(mesh, {static_cast<double>(v), 0, 0});
  for (int pass = 0; pass < 3; ++pass)
    for (std::uint64_t v = 0; v < kLines; ++v) mesh.cells.push_back({0, {v, v + 1}});
  WriteOptions options;
  options.connectivity = ConnectivityCodec::patterns;
  options.group_cells = kLines;
  options.restart_budget = 0;  // one segment
  const FileParts parts = take_apart(expect_round_trip(mesh, options));
  std::vector<int> bits;
  for (const Chunk& chunk : parts.chunks)
    if (chunk.is(container::ChunkKind::group))
      bits.push_back(std::to_integer<int>(take_group_apart(chunk)->streams[0][0]));
  EXPECT_EQ(bits, (std::vector<int>{16, 16, 17}));
}

// The numbers of these vertices hash to the same slot in the table of live vertices. When a vertex
// is finalized and removed, another vertex moves to its slot. The moved vertex must still be found.
TEST(RoundTrip, ShiftsOfNumbersThatCollide) {
  std::vector<std::uint64_t> numbers;
  for (std::uint64_t word = 0; numbers.size() < 4; ++word)
    if (((word * 0x9e3779b97f4a7c15u) >> 32 & 0xffff) == 0xffff) numbers.push_back(word << 6);
  Schema schema = hexahedra_schema();
  schema.blocks[0] = {1, "lines", CellShape::line, 2};
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::shifts;
  auto writer = Writer::create(sink, schema, options);
  ASSERT_TRUE(writer);
  const std::vector<std::byte> xyz(12);
  for (const std::uint64_t number : numbers) ASSERT_TRUE(writer->add_vertex(number, xyz));
  const auto add = [&](std::size_t a, std::size_t b, std::uint64_t last_use) {
    const std::array<std::uint64_t, 2> corners = {numbers[a], numbers[b]};
    ASSERT_TRUE(writer->add_cell(0, corners, last_use));
  };
  for (std::size_t a = 0; a < 3; ++a) add(a, a + 1, 0);  // all vertices live, in order
  for (std::size_t a = 0; a < 3; ++a) {  // vertices are finalized one after the other
    for (std::size_t b = a + 1; b < 4; ++b) add(b, a, 0);
    for (std::size_t b = a + 1; b < 4; ++b) add(a, b, 0);
    add(a, 3, 1);
    for (std::size_t b = a + 1; b < 4; ++b) add(b, 3, 0);
  }
  ASSERT_TRUE(writer->finish());
  const auto back = read_mesh(sink.bytes);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->mesh.cell_count(), 24u);
}

TEST(RoundTrip, SameBytesTwice) {
  TestMesh mesh = grid(9, 9, 9, ScalarType::float64, warped, porous);
  mesh.schema.delay = 20;
  EXPECT_EQ(expect_round_trip(mesh), expect_round_trip(mesh));
}

TEST(Events, FollowTheGrammar) {
  const auto bytes = expect_round_trip(grid(4, 3, 2, ScalarType::float32, straight, porous));
  const auto back = read_mesh(bytes);
  ASSERT_TRUE(back);
  std::map<std::uint64_t, bool> alive;
  std::size_t vertices = 0, cells = 0;
  for_each_event(back->mesh, ScalarType::float32, [&](const Event& event) {
    if (const auto* vertex = std::get_if<VertexEvent>(&event)) {
      EXPECT_TRUE(alive.emplace(vertex->number, true).second);
      EXPECT_EQ(vertex->xyz.size(), 12u);
      ++vertices;
    } else if (const auto* cell = std::get_if<CellEvent>(&event)) {
      for (std::uint64_t corner : cell->corners) EXPECT_TRUE(alive[corner]);
      ++cells;
    } else {
      EXPECT_TRUE(std::exchange(alive[std::get<FinalizeEvent>(event).vertex], false));
    }
  });
  EXPECT_EQ(vertices, back->totals.vertices);
  EXPECT_EQ(cells, back->totals.cells);
}

// Tests several thousand small random meshes, with cells of every shape, degenerate cells and
// irregular connectivity.
TEST(RoundTrip, RandomSmallMeshes) {
  const auto codecs = codecs_for(hexahedra_schema()), without_delay = codecs_without_delay();
  for (std::uint64_t seed = 0; seed < 3000; seed += every(13)) {
    std::mt19937_64 random(seed);
    TestMesh mesh;
    if (random() % 3 == 0) {
      mesh.schema = hexahedra_schema(ScalarType::float32);
      mesh.set_points(std::vector<std::array<double, 3>>(5 + random() % 30, {1, 2, 3}));
      for (std::uint64_t n = random() % 30; n > 0; --n) {
        TestCell cell;
        for (int i = 0; i < 8; ++i) cell.corners.push_back(random() % mesh.vertices);
        mesh.cells.push_back(cell);
      }
    } else {
      mesh = grid(1 + random() % 4, 1 + random() % 4, 1 + random() % 4, ScalarType::float32, warped,
                  random() % 2 == 0 ? porous : nullptr);
      if (random() % 2 == 0) shuffle_cells(mesh, random);
      if (random() % 2 == 0) shuffle_vertices(mesh, random);
      if (random() % 2 == 0) rotate_corners(mesh, random, random() % 2 == 0);
      for (TestCell& cell : mesh.cells)
        if (random() % 10 == 0) cell.corners[random() % 8] = random() % mesh.vertices;
    }
    mesh.schema.order = random() % 2 == 0 ? Order::keep : Order::stream;
    mesh.schema.corner_order = mesh.schema.order == Order::keep || random() % 2 == 0;
    mesh.schema.delay = static_cast<std::uint32_t>(random() % 3 == 0 ? random() % 40 : 0);
    SCOPED_TRACE("seed " + std::to_string(seed));
    WriteOptions options;
    options.group_cells = static_cast<std::uint32_t>(1 + random() % 20);
    options.connectivity = codecs[seed % codecs.size()];
    if (std::ranges::count(without_delay, options.connectivity) > 0) mesh.schema.delay = 0;
    expect_round_trip(mesh, options);
    options.segment_cells = 7;
    expect_round_trip(mesh, options);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace shm
