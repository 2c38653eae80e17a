// Digests of the decoded content (shm/options.h, WriteOptions::digest).
// spec: "Digests"
#include <gtest/gtest.h>

#include <bit>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "shm/appender.h"
#include "shm/mesh.h"
#include "shm/reader.h"
#include "shm/summary.h"
#include "support/file_surgery.h"
#include "support/stepped_mesh.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;
using container::ChunkKind;

/// Returns a mesh with static and stepped arrays at vertices and cells, and step times.
Mesh mesh_with_values() {
  Mesh mesh = mesh_from(grid(7, 6, 5));
  const std::size_t vertices = 8 * 7 * 6, cells = 7 * 6 * 5;
  std::vector<double> at_vertices(vertices);
  std::vector<float> at_cells(cells);
  for (std::size_t i = 0; i < vertices; ++i) at_vertices[i] = .5 * static_cast<double>(i * i % 97);
  for (std::size_t i = 0; i < cells; ++i) at_cells[i] = static_cast<float>(i * 7 % 31);
  at_vertices[5] = -0.0;
  at_cells[4] = std::bit_cast<float>(0x7fc01234u);
  mesh.add_array<double>("a", Location::point, at_vertices);
  mesh.add_array<float>("b", Location::cell, at_cells);
  for (const char* name : {"c", "d"}) {
    const bool of_points = name[0] == 'c';
    ArrayInfo info;
    info.name = name;
    info.location = of_points ? Location::point : Location::cell;
    info.type = ScalarType::float64;
    info.per_step = true;
    mesh.schema.arrays.push_back(info);
    mesh.arrays.emplace_back();
    auto& steps = mesh.steps.emplace_back();
    for (std::uint64_t step = 0; step < 4; ++step) {
      auto& values = steps.emplace_back();
      for (std::size_t i = 0; i < (of_points ? vertices : cells); ++i)
        append(values, at_vertices[i] + .125 * static_cast<double>(step * step));
    }
  }
  mesh.steps.resize(mesh.arrays.size());
  mesh.step_times = {0, .5, 1, 4};
  return mesh;
}

Bytes written(const Mesh& mesh, const WriteOptions& options = {}) {
  MemorySink sink;
  const auto report = write_mesh(sink, mesh, options);
  EXPECT_TRUE(report) << report.error().message();
  return std::move(sink.bytes);
}

/// Returns the digest that a file states, after all of it has been decoded.
std::optional<std::uint64_t> digest_of(const Bytes& bytes) {
  MemorySource source(bytes);
  auto reader = Reader::open(source);
  EXPECT_TRUE(reader) << reader.error().message();
  while (reader) {
    const auto item = reader->next();
    EXPECT_TRUE(item) << item.error().message();
    if (!item || *item == nullptr) return std::nullopt;
    if (const auto* totals = std::get_if<Totals>(*item)) {
      MemoryRandomSource anywhere(bytes);
      const auto summary = read_summary(anywhere);
      EXPECT_TRUE(summary && summary->totals.digest == totals->digest);
      return totals->digest;
    }
  }
  return std::nullopt;
}

/// Returns the error of a reader of the whole file, or an empty string.
std::string error_of(const Bytes& bytes, const ReadOptions& options = {}) {
  MemorySource source(bytes);
  const auto mesh = read_mesh(source, {}, options);
  return mesh ? std::string() : mesh.error().message();
}

/// Returns the mesh with other numbers of the vertices, so that the order of coding differs.
Mesh shuffled_points(Mesh mesh) {
  const std::uint64_t count = mesh.vertex_count();
  for (std::uint64_t& corner : mesh.corners) corner = (corner * 5 + 1) % count;
  return mesh;
}

TEST(Digest, IsTheSameHoweverTheMeshIsCoded) {
  const Mesh mesh = mesh_with_values();
  const auto expected = digest_of(written(mesh));
  ASSERT_TRUE(expected);
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const std::uint64_t segment_cells : {0, 40})
      for (const unsigned threads : {1u, 3u})
        for (const std::uint32_t key_steps : {1u, 8u}) {
          WriteOptions options;
          options.level = level;
          options.segment_cells = segment_cells;
          options.group_cells = segment_cells == 0 ? 65536 : 16;
          options.threads = threads;
          options.key_steps = key_steps;
          options.waiting_bytes = threads == 1 ? options.waiting_bytes : 0;
          EXPECT_EQ(digest_of(written(mesh, options)), expected);
        }
  // Vertex numbers that do not fit into the memory limit are decoded again for each step.
  WriteOptions sparing;
  sparing.level = Level::fast;
  sparing.kept_topology_bytes = 64;
  const Bytes bytes = written(shuffled_points(mesh), sparing);
  EXPECT_EQ(digest_of(bytes), digest_of(written(shuffled_points(mesh))));
  EXPECT_EQ(error_of(bytes, {.kept_topology_bytes = 64}), "");
  Mesh delayed = mesh;
  delayed.schema.delay = 20;
  EXPECT_EQ(digest_of(written(delayed)), expected);
}

TEST(Digest, DependsOnEveryBit) {
  const Mesh mesh = mesh_with_values();
  const auto expected = digest_of(written(mesh));
  const auto expect_other = [&](const char* what, const std::function<void(Mesh&)>& change) {
    Mesh changed = mesh;
    change(changed);
    EXPECT_NE(digest_of(written(changed)), expected) << what;
  };
  const auto flip = [](Bytes& values, std::size_t at, int bit) {
    values[at] ^= static_cast<std::byte>(1 << bit);
  };
  expect_other("a coordinate", [&](Mesh& it) { flip(it.xyz, 100, 0); });
  expect_other("a value at a vertex", [&](Mesh& it) { flip(it.arrays[0], 803, 3); });
  expect_other("the sign of zero", [&](Mesh& it) { flip(it.arrays[0], 47, 7); });
  expect_other("the payload of NaN", [&](Mesh& it) { flip(it.arrays[1], 16, 2); });
  expect_other("a value at a step", [&](Mesh& it) { flip(it.steps[2][3], 8, 0); });
  expect_other("two values", [](Mesh& it) {
    std::swap_ranges(it.arrays[0].begin(), it.arrays[0].begin() + 8, it.arrays[0].begin() + 8);
  });
  expect_other("two cells", [](Mesh& it) {
    std::swap_ranges(it.corners.begin(), it.corners.begin() + 8, it.corners.begin() + 8);
  });
  expect_other("two corners", [](Mesh& it) { std::swap(it.corners[2], it.corners[3]); });
  expect_other("two steps", [](Mesh& it) { std::swap(it.steps[3][1], it.steps[3][2]); });
  expect_other("two arrays", [](Mesh& it) { std::swap(it.steps[2][1], it.steps[2][2]); });
  expect_other("a time", [](Mesh& it) { it.step_times[1] = .25; });
}

// The digest of a bounded array is that of the values that readers return.
TEST(Digest, CoversRestoredValues) {
  Mesh mesh = mesh_with_values();
  for (ArrayInfo& info : mesh.schema.arrays) info.quantization = Quantization::absolute(.3, 1);
  const Bytes bytes = written(mesh);
  MemorySource source(bytes);
  auto back = read_mesh(source);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_NE(back->arrays[0], mesh.arrays[0]);
  for (ArrayInfo& info : back->schema.arrays) info.quantization = {};
  EXPECT_EQ(digest_of(written(*back)), digest_of(bytes));
}

TEST(Digest, OfAnAppendedFileIsThatOfAFileWrittenAtOnce) {
  const Mesh mesh = mesh_with_values();
  Mesh begun = mesh;
  for (auto& steps : begun.steps)
    if (!steps.empty()) steps.resize(2);
  begun.step_times.resize(2);
  for (const std::uint64_t waiting : {0, 1 << 20}) {
    WriteOptions options;
    options.waiting_bytes = waiting;
    options.level = Level::fast;
    const Bytes first = written(begun, options);
    MemoryRandomSource source(first);
    MemorySink sink;
    auto appender = Appender::open(source, sink, {.waiting_bytes = waiting});
    ASSERT_TRUE(appender) << appender.error().message();
    RecordedOrder order;
    WriteOptions heard = options;
    heard.coding_order = &order;
    (void)written(begun, heard);
    for (std::uint64_t step = 2; step < 4; ++step)
      for (const std::uint32_t array : {2u, 3u}) {
        const Bytes& values = mesh.steps[array][step];
        const auto& numbers = array == 2 ? order.vertices : order.cells;
        Bytes coded;
        for (const std::uint64_t number : numbers)
          coded.insert(coded.end(), values.begin() + static_cast<std::ptrdiff_t>(8 * number),
                       values.begin() + static_cast<std::ptrdiff_t>(8 * number + 8));
        ASSERT_TRUE(appender->add_step_values(array, step, coded));
      }
    ASSERT_TRUE(appender->set_step_times(mesh.step_times));
    ASSERT_TRUE(appender->finish());
    EXPECT_EQ(digest_of(sink.bytes), digest_of(written(mesh)));
  }
}

TEST(Digest, ReadersNameTheChunkThatDiffers) {
  WriteOptions options;
  options.waiting_bytes = 0;
  options.segment_cells = 100;
  const Bytes bytes = written(mesh_with_values(), options);
  const auto with_other_digest = [&](ChunkKind kind, std::size_t nth) {
    FileParts parts = take_apart(bytes);
    Chunk& chunk = *parts.find(kind, nth);
    if (auto group = kind == ChunkKind::group ? take_group_apart(chunk) : std::nullopt) {
      group->header.digest += 1;
      chunk.payload = put_group_together(std::move(*group));
    } else {
      chunk.payload[0] ^= std::byte{1};
    }
    return put_together(std::move(parts));
  };
  const Bytes of_group = with_other_digest(ChunkKind::group, 1);
  EXPECT_NE(error_of(of_group).find("group 1, at byte"), std::string::npos) << error_of(of_group);
  EXPECT_NE(error_of(of_group).find("digest"), std::string::npos);
  const Bytes of_steps = with_other_digest(ChunkKind::step_values, 1);
  EXPECT_NE(error_of(of_steps).find("array 'c', step 0, segment 1"), std::string::npos)
      << error_of(of_steps);
  EXPECT_NE(error_of(with_other_digest(ChunkKind::step_times, 0)).find("times"), std::string::npos);
  const Bytes bundled = written(mesh_with_values());
  FileParts parts = take_apart(bundled);
  parts.find(ChunkKind::step_values)->payload[0] ^= std::byte{1};
  const std::string of_bundle = error_of(put_together(std::move(parts)));
  EXPECT_NE(of_bundle.find("array 'c' to array 'd', step 0 to 3, segment 0"), std::string::npos)
      << of_bundle;
  // The index does not match the sum, whether or not the digests of chunks are checked.
  EXPECT_NE(error_of(of_group, {.check_digests = false}).find("index"), std::string::npos);
  EXPECT_EQ(error_of(bytes, {.check_digests = false}), "");
}

TEST(Digest, IsOptional) {
  const Mesh mesh = mesh_with_values();
  WriteOptions options;
  options.digest = false;
  const Bytes bytes = written(mesh, options);
  EXPECT_EQ(digest_of(bytes), std::nullopt);
  for (const Chunk& chunk : take_apart(bytes).chunks)
    EXPECT_FALSE(container::has_digest(chunk.header.version));
}

}  // namespace
}  // namespace shm
