// Tests that a Writer refuses calls that are not allowed, and that all later calls return the error
// of the first refused call.
#include "shm/writer.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "support/feature_files.h"
#include "support/file_surgery.h"

namespace shm {
namespace {

constexpr std::array<std::uint64_t, 8> kCube = {0, 1, 2, 3, 4, 5, 6, 7};

Schema small_schema() {
  Schema schema = hexahedra_schema();
  schema.blocks.push_back({2, "polygons", CellShape::polygon, 0});
  schema.arrays.push_back(array_of("p", Location::point, ScalarType::int16));
  schema.arrays.push_back(array_of("c", Location::cell, ScalarType::float32, 2, {0}));
  ArrayInfo steps = array_of("s", Location::point, ScalarType::float32, 1);
  steps.per_step = true;
  schema.arrays.push_back(steps);
  return schema;
}

/// A Writer to which the eight vertices of a cube have been added. Its sink only counts bytes.
class Session {
 public:
  explicit Session(const Schema& schema = small_schema(), const WriteOptions& options = {})
      : writer_(std::move(*Writer::create(sink_, schema, options))) {
    for (std::uint64_t v = 0; v < 8; ++v) EXPECT_TRUE(add_vertex(v));
  }
  Result<void> add_vertex(std::uint64_t number) {
    return writer_.add_vertex(number, xyz_, point_data_);
  }
  Result<void> add_cube(std::uint64_t last_use = 0) {
    return writer_.add_cell(0, kCube, last_use, cell_data_);
  }
  Result<void> add_steps(std::uint64_t step, std::size_t values) {
    return writer_.add_step_values(2, step, std::vector<std::byte>(4 * values));
  }
  Writer& operator*() { return writer_; }
  Writer* operator->() { return &writer_; }
  std::uint64_t written() const { return sink_.bytes; }

 private:
  NullSink sink_;
  std::vector<std::byte> xyz_ = std::vector<std::byte>(12), point_data_ = std::vector<std::byte>(2),
                         cell_data_ = std::vector<std::byte>(8);
  Writer writer_;
};

void expect_misuse(const std::function<Result<void>(Session&)>& work, const char* what) {
  Session session;
  const auto result = work(session);
  ASSERT_FALSE(result) << what;
  EXPECT_EQ(result.error().code, ErrorCode::misuse) << what;
  EXPECT_FALSE(result.error().detail.empty()) << what;
  // Every later call returns the first error.
  const std::string message = result.error().message();
  EXPECT_EQ(session.add_vertex(100).error().message(), message) << what;
  EXPECT_EQ(session->end_mesh().error().message(), message) << what;
  EXPECT_EQ(session->set_step_times({}).error().message(), message) << what;
  EXPECT_EQ(session->add_extra({}).error().message(), message) << what;
  EXPECT_EQ(session->finish().error().message(), message) << what;
  EXPECT_EQ(session->finish().error().message(), message) << what;
}

TEST(Writer, GoodSession) {
  Session session;
  EXPECT_TRUE(session.add_cube());
  EXPECT_TRUE(session->end_mesh());
  EXPECT_TRUE(session.add_steps(0, 3));
  EXPECT_TRUE(session.add_steps(0, 5));
  EXPECT_TRUE(session.add_steps(5, 8));
  const auto report = session->finish();
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->vertices, 8u);
  EXPECT_EQ(report->cells, 1u);
  EXPECT_EQ(report->hexahedra, 1u);
  EXPECT_EQ(report->max_active_vertices, 8u);
  EXPECT_EQ(report->total_bytes, session.written());
  std::uint64_t sum = 0;
  for (const auto& [name, bytes] : report->streams) sum += bytes;
  EXPECT_EQ(sum, report->total_bytes);
}

TEST(Writer, FinishEndsTheMesh) {
  Session session;
  EXPECT_TRUE(session.add_cube());
  EXPECT_TRUE(session->finish());
}

TEST(Writer, Vertices) {
  expect_misuse([](Session& s) { return s.add_vertex(7); }, "twice");
  expect_misuse(
      [](Session& s) {
        return s->add_vertex(9, std::vector<std::byte>(11), std::vector<std::byte>(2));
      },
      "coordinates too short");
  expect_misuse([](Session& s) { return s->add_vertex(9, std::vector<std::byte>(12), {}); },
                "no data");
  expect_misuse(
      [](Session& s) {
        return s->add_vertex(9, std::vector<std::byte>(12), std::vector<std::byte>(3));
      },
      "too much data");
}

TEST(Writer, Cells) {
  const std::vector<std::byte> data(8);
  expect_misuse([&](Session& s) { return s->add_cell(2, kCube, 0, data); }, "unknown block");
  expect_misuse([&](Session& s) { return s->add_cell(0, std::span(kCube).first(7), 0, data); },
                "too few corners");
  expect_misuse([&](Session& s) { return s->add_cell(0, kCube, 0, {}); }, "no data");
  expect_misuse([&](Session& s) { return s->add_cell(1, kCube, 0, data); },
                "data of another block");
  expect_misuse(
      [&](Session& s) {
        return s->add_cell(1, std::vector<std::uint64_t>(kMaxNodesPerCell + 1), 0, {});
      },
      "too many corners");
  expect_misuse([&](Session& s) { return s->add_cell(1, std::array<std::uint64_t, 1>{8}, 0, {}); },
                "unknown vertex");
  expect_misuse(
      [&](Session& s) {
        EXPECT_TRUE(s.add_cube(1 << 3));
        return s.add_cube();
      },
      "vertex that was finalized");
}

TEST(Writer, FinalizedVerticesStayUnusableInTheDelayBuffer) {
  Schema schema = small_schema();
  schema.delay = 10;
  Session session(schema);
  EXPECT_TRUE(session.add_cube(1));
  EXPECT_EQ(session.add_cube().error().code, ErrorCode::misuse);
}

// In Order::stream, a caller may reuse a vertex number after it has finalized the vertex. The cell
// that finalizes the vertex may still be in the delay buffer.
TEST(Writer, NumbersAreFreeAgain) {
  for (std::uint32_t delay : {0u, 10u}) {
    Schema schema = small_schema();
    schema.order = Order::stream;
    schema.delay = delay;
    Session session(schema);
    for (int n = 0; n < 5; ++n) {
      ASSERT_TRUE(session.add_cube(0xff)) << delay;
      for (std::uint64_t v = 0; v < 8; ++v) {
        const auto status = session.add_vertex(v);
        ASSERT_TRUE(status) << "delay " << delay << ": " << status.error().message();
      }
    }
    const auto report = session->finish();
    ASSERT_TRUE(report);
    EXPECT_EQ(report->vertices, 48u);
  }
}

TEST(Writer, OrderOfCalls) {
  expect_misuse([](Session& s) { return s.add_steps(0, 8); }, "steps before end_mesh");
  expect_misuse([](Session& s) { return s->set_step_times({}); }, "times before end_mesh");
  expect_misuse(
      [](Session& s) {
        EXPECT_TRUE(s->end_mesh());
        return s.add_vertex(20);
      },
      "vertex behind end_mesh");
  expect_misuse(
      [](Session& s) {
        EXPECT_TRUE(s->end_mesh());
        return s.add_cube();
      },
      "cell behind end_mesh");
  expect_misuse(
      [](Session& s) {
        EXPECT_TRUE(s->end_mesh());
        return s->end_mesh();
      },
      "end_mesh twice");
  expect_misuse(
      [](Session& s) {
        EXPECT_TRUE(s->end_mesh());
        EXPECT_TRUE(s->set_step_times(std::vector<double>{1}));
        return s->set_step_times(std::vector<double>{2});
      },
      "times twice");
}

TEST(Writer, Steps) {
  const auto ended = [](const std::function<Result<void>(Session&)>& work) {
    return [work](Session& s) -> Result<void> {
      EXPECT_TRUE(s->end_mesh());
      return work(s);
    };
  };
  expect_misuse(ended([](Session& s) { return s->add_step_values(3, 0, {}); }), "no array");
  expect_misuse(ended([](Session& s) { return s->add_step_values(0, 0, {}); }), "a static array");
  expect_misuse(
      ended([](Session& s) { return s->add_step_values(2, 0, std::vector<std::byte>(5)); }),
      "within an element");
  expect_misuse(ended([](Session& s) {
                  EXPECT_TRUE(s.add_steps(3, 8));
                  return s.add_steps(2, 8);
                }),
                "descending");
  expect_misuse(ended([](Session& s) {
                  EXPECT_TRUE(s.add_steps(0, 7));
                  return s.add_steps(1, 8);
                }),
                "too few");
  expect_misuse(ended([](Session& s) -> Result<void> {
                  EXPECT_TRUE(s.add_steps(0, 8));
                  if (auto status = s.add_steps(0, 1); !status) return status;
                  return s.add_steps(1, 8);
                }),
                "too many");
}

TEST(Writer, StepsLeftShortAreFoundAtTheEnd) {
  Session session;
  EXPECT_TRUE(session->end_mesh());
  EXPECT_TRUE(session.add_steps(0, 7));
  const auto report = session->finish();
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().code, ErrorCode::misuse);
  EXPECT_EQ(session->finish().error().message(), report.error().message());
  const auto more = session.add_steps(0, 1);
  ASSERT_FALSE(more);
  EXPECT_EQ(more.error().message(), report.error().message());
}

TEST(Writer, Extras) {
  const auto extra = [](ScalarType type, Reference refers, std::vector<std::uint64_t> shape,
                        std::size_t bytes) {
    return [=](Session& s) {
      return s->add_extra({"key", type, refers, shape, std::vector<std::byte>(bytes)});
    };
  };
  using enum ScalarType;
  expect_misuse(extra(uint8, Reference::nothing, {4}, 5), "too long");
  expect_misuse(extra(int32, Reference::nothing, {4}, 4), "too short");
  expect_misuse(extra(static_cast<ScalarType>(0), Reference::nothing, {0}, 0), "no type");
  expect_misuse(extra(uint32, Reference::vertex, {1}, 4), "unsigned references");
  expect_misuse(extra(int32, static_cast<Reference>(3), {1}, 4), "unknown reference");
  constexpr std::uint64_t kHuge = std::uint64_t{1} << 32;
  expect_misuse(extra(uint8, Reference::nothing, {kHuge, kHuge}, 0), "a product that wraps");
}

TEST(Writer, NothingBehindFinish) {
  Session session;
  ASSERT_TRUE(session->finish());
  const std::uint64_t size = session.written();
  EXPECT_FALSE(session.add_vertex(100));
  EXPECT_FALSE(session.add_cube());
  EXPECT_FALSE(session->add_extra({"k", ScalarType::uint8, Reference::nothing, {0}, {}}));
  EXPECT_FALSE(session->set_step_times(std::vector<double>{1}));
  EXPECT_FALSE(session.add_steps(0, 8));
  EXPECT_FALSE(session->finish());
  EXPECT_EQ(session.written(), size);
}

TEST(Writer, OptionsAndSchemaAreChecked) {
  NullSink sink;
  for (std::uint32_t cells : {0u, (1u << 20) + 1}) {
    WriteOptions options;
    options.group_cells = cells;
    const auto writer = Writer::create(sink, small_schema(), options);
    ASSERT_FALSE(writer);
    EXPECT_EQ(writer.error().code, ErrorCode::misuse);
  }
  constexpr auto kNoCodec = static_cast<ConnectivityCodec>(99);
  for (const WriteOptions& options :
       {WriteOptions{.level = static_cast<Level>(3)}, WriteOptions{.connectivity = kNoCodec},
        WriteOptions{.segment_connectivity = {ConnectivityCodec::rows, kNoCodec}}})
    EXPECT_EQ(Writer::create(sink, small_schema(), options).error().code, ErrorCode::misuse);
  Schema schema = small_schema();
  schema.corner_order = false;
  EXPECT_EQ(Writer::create(sink, schema).error().code, ErrorCode::misuse);
  EXPECT_EQ(sink.bytes, 0u);
}

TEST(Writer, ShiftsAreNotForEverySchema) {
  const auto code_with = [](const WriteOptions& options,
                            const std::function<void(Schema&)>& change) {
    Schema schema = hexahedra_schema();
    change(schema);
    NullSink sink;
    const auto writer = Writer::create(sink, schema, options);
    EXPECT_EQ(sink.bytes > 0, static_cast<bool>(writer));
    return writer ? std::optional<ErrorCode>() : writer.error().code;
  };
  const std::vector<std::function<void(Schema&)>> valid = {
      [](Schema&) {},
      [](Schema& s) { s.blocks.clear(); },
      [](Schema& s) { s.order = Order::stream; },
      [](Schema& s) { s.order = Order::free; },
      [](Schema& s) { s.blocks[0].nodes_per_cell = 64; },
      [](Schema& s) {
        s.blocks.push_back({2, "", CellShape::vertex, 1});
      },
      [](Schema& s) { s.arrays.push_back(array_of("a", Location::cell, ScalarType::int8)); },
      [](Schema& s) {
        s.arrays.push_back(array_of("a", Location::cell, ScalarType::int8, 32));
        s.arrays[0].per_step = true;
      },
  };
  const std::vector<std::function<void(Schema&)>> bad = {
      [](Schema& s) { s.delay = 1; },
      [](Schema& s) { s.blocks[0].nodes_per_cell = 65; },
      [](Schema& s) {
        s.blocks.push_back({2, "", CellShape::polygon, 0});
      },
      [](Schema& s) {
        s.arrays.push_back(array_of("a", Location::cell, ScalarType::int8, 33));
        s.arrays[0].per_step = true;
      },
  };
  using enum ConnectivityCodec;
  for (const WriteOptions& options : {WriteOptions{.connectivity = shifts},
                                      WriteOptions{.segment_connectivity = {rows, shifts}}}) {
    for (std::size_t i = 0; i < valid.size(); ++i)
      EXPECT_EQ(code_with(options, valid[i]), std::nullopt) << i;
    for (std::size_t i = 0; i < bad.size(); ++i)
      EXPECT_EQ(code_with(options, bad[i]), ErrorCode::misuse) << i;
  }
  // If no codec is requested, the Writer selects a codec that can encode the mesh.
  for (const auto& change : bad) EXPECT_EQ(code_with({.level = Level::fast}, change), std::nullopt);
}

/// A sink that accepts a limited number of bytes and then fails.
struct FullSink final : ByteSink {
  explicit FullSink(std::uint64_t room) : left(room) {}
  Result<void> write(std::span<const std::byte> bytes) override {
    if (bytes.size() > left) {
      EXPECT_FALSE(std::exchange(failed, true)) << "used again after an error";
      return Error{ErrorCode::output, "full", {}, kNoOffset, "disk"};
    }
    left -= bytes.size();
    return {};
  }
  std::uint64_t left;
  bool failed = false;
};

TEST(Writer, AFullDiskIsTold) {
  const TestMesh mesh = bent_grid(3, 3, 3);
  WriteOptions options;
  options.group_cells = 4;
  const std::uint64_t size = [&] {
    NullSink sink;
    return write_mesh(mesh, sink, options)->total_bytes;
  }();
  for (std::uint64_t room = 0; room < size; room += 7) {
    FullSink sink(room);
    const auto report = write_mesh(mesh, sink, options);
    ASSERT_FALSE(report) << room;
    EXPECT_EQ(report.error().code, ErrorCode::output);
    EXPECT_EQ(report.error().file, "disk");
  }
  FullSink enough(size);
  EXPECT_TRUE(write_mesh(mesh, enough, options));
}

TEST(Writer, LargeFilesSayTheSchemaAgain) {
  TestMesh mesh = bent_grid(8, 8, 8);
  mesh.schema.arrays.push_back(array_of("noise", Location::cell, ScalarType::float64, 400));
  PlainRandom random(1);
  mesh.arrays.emplace_back();
  for (std::size_t i = 0; i < mesh.cells.size() * 400; ++i) append(mesh.arrays[0], random.bits());
  const auto bytes = expect_round_trip(mesh);
  FileParts parts = take_apart(bytes);
  const Chunk* again = parts.find(container::ChunkKind::schema, 1);
  ASSERT_NE(again, nullptr);
  EXPECT_EQ(again->payload, parts.chunks[0].payload);
}

TEST(Writer, WritersAreIndependentAndMove) {
  MemorySink one, two;
  const TestMesh mesh = bent_grid(2, 2, 2);
  auto first = Writer::create(one, mesh.schema), second = Writer::create(two, mesh.schema);
  ASSERT_TRUE(first);
  ASSERT_TRUE(second);
  for (std::uint64_t v = 0; v < mesh.vertices; ++v)
    for (auto* writer : {&first, &second})
      ASSERT_TRUE((*writer)->add_vertex(v, std::span(mesh.xyz).subspan(v * 12, 12)));
  Writer moved = std::move(*first);
  for (const TestCell& cell : mesh.cells) {
    ASSERT_TRUE(moved.add_cell(0, cell.corners));
    ASSERT_TRUE((*second).add_cell(0, cell.corners));
  }
  ASSERT_TRUE(moved.finish());
  ASSERT_TRUE(second->finish());
  EXPECT_EQ(one.bytes, two.bytes);
}

}  // namespace
}  // namespace shm
