// Tests of files designed to be expensive: the processor time for reading them, per byte of input
// and output, must not be much larger than for an ordinary file in the same run. The test compares
// only ratios, because the machine may be busy or slow.
#include <time.h>

#include <algorithm>
#include <limits>
#include <string>

#include "shm/step_reader.h"
#include "shm/summary.h"
#include "support/hostile.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__clang__)
/// AddressSanitizer keeps freed memory for long and uses new pages instead, which the system fills
/// with zeros. That takes a third of the time, randomly in one file or the other.
extern "C" [[gnu::visibility("default")]] const char* __asan_default_options() {
  return "quarantine_size_mb=1";
}
#endif

namespace shm {
namespace {

/// Largest allowed ratio of the times per byte. Small items need more time per byte than large
/// items. Creating a column takes some microseconds, and twice as much if a sanitizer watches every
/// allocation (tiny segments: ratios of 10 to 14 with sanitizers, 5 without).
constexpr double kMost = kSanitized ? 24 : 12;

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

std::uint64_t bytes_of(const Item& item) {
  if (const auto* block = std::get_if<MeshBlock>(&item)) {
    std::uint64_t bytes = block->xyz.size() + 8 * (block->corners.size() + block->cell_count());
    for (const auto& array : block->arrays) bytes += array.size();
    return bytes;
  }
  if (const auto* piece = std::get_if<StepPiece>(&item)) return piece->values.size();
  if (const auto* extra = std::get_if<Extra>(&item)) return extra->data.size();
  return 0;
}

/// Reads everything, item by item. Topology is never kept, as in meshes of many millions of cells.
/// Returns the number of bytes delivered.
std::uint64_t read_all(const Bytes& file) {
  MemorySource source(file);
  ReadOptions options;
  options.kept_topology_bytes = 0;
  auto reader = Reader::open(source, {}, options);
  EXPECT_TRUE(reader);
  std::uint64_t out = 0;
  while (reader) {
    const auto item = reader->next();
    EXPECT_TRUE(item) << item.error().message();
    if (!item || *item == nullptr) break;
    out += bytes_of(**item);
  }
  return out;
}

/// Reads every array at every step, by the index.
std::uint64_t read_steps(const Bytes& file) {
  MemoryRandomSource source(file);
  auto reader = StepReader::open(source);
  EXPECT_TRUE(reader) << reader.error().message();
  std::uint64_t out = 0;
  for (std::uint32_t a = 0; reader && a < reader->schema().arrays.size(); ++a)
    for (const std::uint64_t step : reader->steps(a)) {
      const auto pieces = reader->read({a, step});
      EXPECT_TRUE(pieces) << pieces.error().message();
      if (!pieces) return out;
      for (const StepValues& piece : *pieces) out += piece.values.size();
    }
  return out;
}

/// Returns the time in seconds per byte of input and output, measured in the fastest of several
/// runs.
template <class Read>
double seconds_a_byte(const Bytes& file, const Read& read) {
  double least = std::numeric_limits<double>::max(), all = 0;
  for (int run = 0; run < 100 && all < .5; ++run) {
    const double begin = processor_seconds();
    const std::uint64_t out = read(file);
    const double took = processor_seconds() - begin;
    all += took;
    least = std::min(least, took / static_cast<double>(file.size() + out));
  }
  return least;
}

Bytes file_of(Stepped stepped, ConnectivityCodec codec, std::uint32_t group_cells = 65536,
              std::uint64_t segment_cells = 0) {
  stepped.options.level = Level::fast;
  stepped.options.connectivity = codec;
  stepped.options.group_cells = group_cells;
  stepped.options.segment_cells = segment_cells;
  stepped.options.key_steps = 1;
  return written(stepped);
}

constexpr std::uint64_t kSide = kSanitized ? 16 : 40;
constexpr std::uint64_t kManySteps = kSanitized ? 60 : 1500;
constexpr std::uint64_t kThousands = kSanitized ? 1000 : 20000;

/// Returns a mesh with a field on all points and a field on all cells.
Stepped ordinary() {
  Stepped stepped{bent_grid(kSide, kSide, kSide), {}, {}};
  for (const Location location : {Location::point, Location::cell}) {
    const std::uint32_t a = add_stepped(stepped.mesh, array_of("f", location, ScalarType::float32));
    for (std::uint64_t step = 0; step < 3; ++step)
      stepped.values[{a, step}] =
          moving_values(stepped.mesh.schema.arrays[a], elements_of(stepped.mesh, a), step);
  }
  return stepped;
}

/// Returns a mesh with arrays of a few components on its last cell, at very many steps.
Stepped on_one_cell(TestMesh mesh, std::uint64_t steps, std::uint32_t components = 16) {
  mesh.schema.blocks.push_back({2, "spring", CellShape::hexahedron, 8});
  mesh.cells.back().block = 1;
  Stepped stepped{std::move(mesh), {}, {}};
  for (int n = 0; n < 2; ++n) {
    const std::uint32_t a = add_stepped(
        stepped.mesh, array_of("f", Location::cell, ScalarType::float32, components, {1}));
    for (std::uint64_t step = 0; step < steps; ++step)
      stepped.values[{a, step}] = moving_values(stepped.mesh.schema.arrays[a], 1, step);
  }
  return stepped;
}

/// Returns a file with this number of additional chunks and index entries of a kind that no reader
/// knows.
Bytes with_unknown_chunks(const Bytes& file, std::uint64_t count) {
  FileParts parts = take_apart(file);
  Chunk unknown;
  unknown.header.kind = 200;
  unknown.header.flags = container::kChunkOptional;
  unknown.header.is_long = true;
  const auto index = parts.chunks.end() - 1;
  parts.chunks.insert(index, static_cast<std::size_t>(count), unknown);
  const Bytes longer = put_together(parts);
  return with_index(longer, [&](container::Index& changed) {
    container::IndexEntry entry;
    entry.kind = unknown.header.kind;
    entry.bytes = unknown.bytes();
    const container::IndexEntry& last = changed.entries.back();
    entry.offset = last.offset + last.bytes;
    for (std::uint64_t n = 0; n < count; ++n, entry.offset += entry.bytes)
      changed.entries.push_back(entry);
  });
}

Bytes with_extras(std::uint64_t count) {
  MemorySink sink;
  const auto report = write_mesh(bent_grid(2, 2, 2), sink, {}, [&](Writer& writer) -> Result<void> {
    for (std::uint64_t n = 0; n < count; ++n) {
      Extra extra;
      extra.key = "test/" + std::to_string(n);
      extra.type = ScalarType::uint8;
      extra.shape = {1};
      extra.data = Bytes(1);
      if (auto status = writer.add_extra(extra); !status) return status;
    }
    return {};
  });
  EXPECT_TRUE(report);
  return std::move(sink.bytes);
}

void expect_in_proportion(const std::string& name, const Bytes& file) {
  static const double usual =
      seconds_a_byte(file_of(ordinary(), ConnectivityCodec::rows), read_all);
  static const double usual_steps =
      seconds_a_byte(file_of(ordinary(), ConnectivityCodec::rows), read_steps);
  const double all = seconds_a_byte(file, read_all) / usual;
  const double steps = seconds_a_byte(file, read_steps) / usual_steps;
  ::testing::Test::RecordProperty(name, std::to_string(all) + " " + std::to_string(steps));
  std::printf("%s, %zu bytes: the time per byte is %.1f times as long, by the index %.1f\n",
              name.c_str(), file.size(), all, steps);
  EXPECT_LT(all, kMost) << name;
  EXPECT_LT(steps, kMost) << name << " by the index";
}

TEST(HostileWork, AFewElementsOverManyStepsInRows) {
  expect_in_proportion(
      "one cell, rows",
      file_of(on_one_cell(bent_grid(kSide, kSide, kSide), kManySteps), ConnectivityCodec::rows));
}

TEST(HostileWork, AFewElementsOverManyStepsInShifts) {
  expect_in_proportion(
      "one cell, shifts",
      file_of(on_one_cell(bent_grid(kSide, kSide, kSide), kManySteps), ConnectivityCodec::shifts));
}

TEST(HostileWork, AFewElementsOverManyStepsInManyTinyGroups) {
  expect_in_proportion("one cell, tiny groups",
                       file_of(on_one_cell(bent_grid(kSide, kSide, kSide / 2), 10 * kManySteps, 1),
                               ConnectivityCodec::rows, 3));
}

TEST(HostileWork, AFewElementsOverManyStepsInManyTinySegments) {
  expect_in_proportion(
      "one cell, tiny segments",
      file_of(on_one_cell(bent_grid(kSide, kSide / 2, kSide / 4), 10 * kManySteps, 1),
              ConnectivityCodec::rows, 65536, 2));
}

TEST(HostileWork, AllElementsOfManyTinySegments) {
  Stepped stepped{bent_grid(kSide / 2, kSide / 2, kSide / 2), {}, {}};
  for (const Location location : {Location::point, Location::cell}) {
    const std::uint32_t a = add_stepped(stepped.mesh, array_of("f", location, ScalarType::float32));
    for (std::uint64_t step = 0; step < 3; ++step)
      stepped.values[{a, step}] =
          moving_values(stepped.mesh.schema.arrays[a], elements_of(stepped.mesh, a), step);
  }
  expect_in_proportion("tiny segments",
                       file_of(std::move(stepped), ConnectivityCodec::rows, 65536, 2));
}

TEST(HostileWork, ManyEmptyChunksAndLinesOfTheIndex) {
  const Bytes file = file_of(on_one_cell(bent_grid(2, 2, 2), 2), ConnectivityCodec::rows);
  const Bytes many = with_unknown_chunks(file, 10 * kThousands);
  expect_in_proportion("empty chunks", many);
  MemoryRandomSource source(many);
  EXPECT_TRUE(read_summary(source));
}

TEST(HostileWork, ThousandsOfExtras) { expect_in_proportion("extras", with_extras(kThousands)); }

}  // namespace
}  // namespace shm
