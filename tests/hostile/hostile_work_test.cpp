// Files designed to be expensive to read, and an ordinary file to compare them with. This program
// only checks that the files are read without an error. After each call to counted_run(), the
// program prints a line: "counted", the name of the file, the way in which it was read ("by item"
// or "by index"), and the number of bytes read and delivered. hostile_work_test.py counts the
// instructions of these calls.
#include <cstdio>
#include <string>

#include "hostile/hostile.h"
#include "shm/step_reader.h"
#include "shm/summary.h"
#include "support/stepped_mesh.h"

// callgrind collects data while this function runs, and finds the function by its name.
extern "C" [[gnu::noinline]] std::uint64_t counted_run(std::uint64_t (*read)(const shm::Bytes&),
                                                       const shm::Bytes& file) {
  volatile std::uint64_t bytes = read(file);
  return bytes;
}

namespace shm {
namespace {

std::uint64_t bytes_of(const Item& item) {
  if (const auto* block = std::get_if<MeshBlock>(&item)) {
    std::uint64_t bytes = block->xyz.size() + 8 * (block->corners.size() + block->cell_count());
    for (const auto& array : block->arrays) bytes += array.size();
    return bytes;
  }
  if (const auto* piece = std::get_if<StepPiece>(&item)) return piece->values.size();
  if (const auto* extra = std::get_if<Extra>(&item)) return extra->key.size() + extra->data.size();
  return 0;
}

/// Reads all items of a file. With kept_topology_bytes = 0, the Reader keeps no topology in memory;
/// by default, this happens only for meshes of many millions of cells. Returns the number of bytes
/// delivered.
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

/// Reads the values of all arrays at all steps with a StepReader. Returns the number of bytes
/// delivered.
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

Bytes file_of(Stepped stepped, ConnectivityCodec codec, std::uint32_t group_cells = 65536,
              std::uint64_t segment_cells = 0) {
  // Not Level::fast: at that level, step values do not depend on the mesh, so a reader would not
  // decode the mesh again.
  stepped.options.level = Level::standard;
  stepped.options.connectivity = codec;
  stepped.options.group_cells = group_cells;
  stepped.options.segment_cells = segment_cells;
  stepped.options.key_steps = 1;
  return written(stepped);
}

constexpr std::uint64_t kSide = 12;
constexpr std::uint64_t kManySteps = 100;
constexpr std::uint64_t kThousands = 10000;

/// Returns a mesh with a field on all points and a field on all cells.
Stepped ordinary() {
  Stepped stepped;
  stepped.mesh = bent_grid(kSide, kSide, kSide);
  for (const Location location : {Location::point, Location::cell}) {
    const std::uint32_t a = add_stepped(stepped.mesh, array_of("f", location, ScalarType::float32));
    for (std::uint64_t step = 0; step < 3; ++step)
      stepped.values[{a, step}] =
          moving_values(stepped.mesh.schema.arrays[a], elements_of(stepped.mesh, a), step);
  }
  return stepped;
}

/// Returns a mesh with very many steps. Its arrays have a few components and cover only the last
/// cell.
Stepped on_one_cell(TestMesh mesh, std::uint64_t steps, std::uint32_t components = 16) {
  mesh.schema.blocks.push_back({2, "spring", CellShape::hexahedron, 8});
  mesh.cells.back().block = 1;
  Stepped stepped;
  stepped.mesh = std::move(mesh);
  for (int n = 0; n < 2; ++n) {
    const std::uint32_t a = add_stepped(
        stepped.mesh, array_of("f", Location::cell, ScalarType::float32, components, {1}));
    for (std::uint64_t step = 0; step < steps; ++step)
      stepped.values[{a, step}] = moving_values(stepped.mesh.schema.arrays[a], 1, step);
  }
  return stepped;
}

/// Returns a file with `count` additional chunks of an unknown kind, each with an entry in the
/// index.
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

/// Counts the work of reading the file twice: item by item with a Reader, and using the index with
/// a StepReader.
void count(const char* name, const Bytes& file) {
  for (const bool by_index : {false, true}) {
    const std::uint64_t out = counted_run(by_index ? read_steps : read_all, file);
    std::printf("counted,%s,%s,%llu\n", name, by_index ? "by index" : "by item",
                static_cast<unsigned long long>(file.size() + out));
  }
}

TEST(HostileWork, AnOrdinaryFile) {
  count("ordinary", file_of(ordinary(), ConnectivityCodec::rows));
}

TEST(HostileWork, AFewElementsOverManyStepsInRows) {
  count("one cell in rows",
        file_of(on_one_cell(bent_grid(kSide, kSide, kSide), kManySteps), ConnectivityCodec::rows));
}

TEST(HostileWork, AFewElementsOverManyStepsInShifts) {
  count("one cell in shifts", file_of(on_one_cell(bent_grid(kSide, kSide, kSide), kManySteps),
                                      ConnectivityCodec::shifts));
}

TEST(HostileWork, AFewElementsOverManyStepsInManyTinyGroups) {
  count("one cell in tiny groups",
        file_of(on_one_cell(bent_grid(kSide, kSide, kSide / 2), 10 * kManySteps, 1),
                ConnectivityCodec::rows, 3));
}

TEST(HostileWork, AFewElementsOverManyStepsInManyTinySegments) {
  count("one cell in tiny segments",
        file_of(on_one_cell(bent_grid(kSide, kSide / 2, kSide / 4), 10 * kManySteps, 1),
                ConnectivityCodec::rows, 65536, 2));
}

TEST(HostileWork, AllElementsOfManyTinySegments) {
  Stepped stepped;
  stepped.mesh = bent_grid(kSide / 2, kSide / 2, kSide / 2);
  for (const Location location : {Location::point, Location::cell}) {
    const std::uint32_t a = add_stepped(stepped.mesh, array_of("f", location, ScalarType::float32));
    for (std::uint64_t step = 0; step < 3; ++step)
      stepped.values[{a, step}] =
          moving_values(stepped.mesh.schema.arrays[a], elements_of(stepped.mesh, a), step);
  }
  count("tiny segments", file_of(std::move(stepped), ConnectivityCodec::rows, 65536, 2));
}

TEST(HostileWork, ManyEmptyChunksAndLinesOfTheIndex) {
  const Bytes file = file_of(on_one_cell(bent_grid(2, 2, 2), 2), ConnectivityCodec::rows);
  const Bytes many = with_unknown_chunks(file, 2 * kThousands);
  count("empty chunks", many);
  MemoryRandomSource source(many);
  EXPECT_TRUE(read_summary(source));
}

TEST(HostileWork, ThousandsOfExtras) { count("extras", with_extras(kThousands)); }

TEST(HostileWork, ThousandsOfBlocks) {
  TestMesh mesh = bent_grid(2 * kSide, 2 * kSide, kSide);
  mesh.schema.blocks.clear();
  for (std::uint32_t n = 0; n < mesh.cells.size(); ++n) {
    mesh.schema.blocks.push_back({n, "block" + std::to_string(n), CellShape::hexahedron, 8});
    mesh.cells[n].block = n;
  }
  count("blocks", file_of({std::move(mesh), {}, {}}, ConnectivityCodec::rows));
}

TEST(HostileWork, ThousandsOfArraysWithoutElements) {
  Stepped stepped;
  stepped.mesh = bent_grid(2, 2, 2);
  stepped.mesh.schema.blocks.push_back({2, "empty", CellShape::hexahedron, 8});
  for (std::uint64_t n = 0; n < kThousands; ++n)
    add_stepped(stepped.mesh,
                array_of("f" + std::to_string(n), Location::cell, ScalarType::float32, 1, {1}));
  count("arrays", file_of(std::move(stepped), ConnectivityCodec::rows));
}

}  // namespace
}  // namespace shm
