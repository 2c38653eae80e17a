// Tests of arrays of the whole mesh and of sets: every writer and reader handles them, also in
// damaged files.
#include <string>

#include "shm/appender.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"
#include "shm/step_reader.h"
#include "support/file_surgery.h"
#include "support/sanitized.h"
#include "support/stepped_mesh.h"

namespace shm {
namespace {

using container::ChunkKind;

constexpr std::uint64_t kSteps = 6;

ArrayInfo beside(std::string name, Location location, std::uint64_t elements,
                 ScalarType type = ScalarType::float64, std::uint32_t components = 1) {
  ArrayInfo info = array_of(std::move(name), location, type, components);
  info.elements = elements;
  return info;
}

/// Returns a mesh of several segments with a point array and arrays beside the mesh. `many` is the
/// number of elements of the largest of these arrays.
Stepped beside_mesh(Order order, std::uint64_t many = 5000) {
  Stepped out;
  out.mesh = with_order(grid(6, 5, 5, ScalarType::float64), order, order == Order::keep, 0);
  out.options.segment_cells = 70;
  out.options.group_cells = 50;
  add_stepped(out.mesh, beside("energy", Location::global, 1));
  add_stepped(out.mesh, array_of("u", Location::point, ScalarType::float32));
  add_stepped(out.mesh, beside("flux", Location::side_set, many));
  add_stepped(out.mesh, beside("force", Location::node_set, 12, ScalarType::float32, 3));
  add_stepped(out.mesh, beside("damage", Location::element_set, 3, ScalarType::int16));
  add_stepped(out.mesh, beside("nothing", Location::element_set, 0));
  for (std::uint32_t a = 0; a < out.mesh.schema.arrays.size(); ++a)
    for (std::uint64_t step = 0; step < kSteps; ++step) {
      const ArrayInfo& info = out.mesh.schema.arrays[a];
      const std::uint64_t elements =
          is_on_mesh(info.location) ? elements_of(out.mesh, a) : info.elements;
      if (elements > 0) out.values[{a, step}] = moving_values(info, elements, step);
    }
  return out;
}

Bytes values_at(StepReader& reader, std::uint32_t array, std::uint64_t step) {
  const auto pieces = reader.read({array, step});
  EXPECT_TRUE(pieces) << (pieces ? "" : pieces.error().message());
  Bytes all;
  if (!pieces) return all;
  std::uint64_t number = 0;
  for (const StepValues& piece : *pieces) {
    EXPECT_EQ(piece.first, number);
    for (const std::uint64_t each : piece.numbers) EXPECT_EQ(each, number++);
    all.insert(all.end(), piece.values.begin(), piece.values.end());
  }
  return all;
}

void expect_back(const Stepped& stepped, const Bytes& bytes) {
  const auto back = read_mesh(bytes);
  ASSERT_TRUE(back) << back.error().message();
  Values values;
  for (const StepPiece& piece : back->steps) {
    Bytes& to = values[{piece.array, piece.step}];
    to.insert(to.end(), piece.values.begin(), piece.values.end());
  }
  EXPECT_TRUE(values == stepped.values);
  MemoryRandomSource source(bytes);
  auto reader = StepReader::open(source);
  ASSERT_TRUE(reader) << reader.error().message();
  for (const auto& [key, of_step] : stepped.values) {
    const ArrayInfo& info = stepped.mesh.schema.arrays[key.first];
    if (is_on_mesh(info.location)) continue;
    EXPECT_EQ(reader->elements(key.first), info.elements);
    EXPECT_TRUE(values_at(*reader, key.first, key.second) == of_step)
        << info.name << " at step " << key.second;
  }
}

TEST(BesideMesh, ReadersReturnAllValues) {
  for (const Order order : {Order::keep, Order::stream})
    for (const Level level : {Level::fast, Level::standard, Level::best})
      for (const std::uint64_t waiting : {std::uint64_t{0}, std::uint64_t{8} << 20}) {
        SCOPED_TRACE(std::string(order_name(order)) + ", level " +
                     std::to_string(static_cast<int>(level)) + ", " + std::to_string(waiting));
        Stepped stepped = beside_mesh(order);
        stepped.options.level = level;
        stepped.options.waiting_bytes = waiting;
        expect_back(stepped, written(stepped));
      }
}

// The mesh need not have other arrays, and its topology is then not needed.
TEST(BesideMesh, AloneInAFile) {
  Stepped stepped;
  stepped.mesh = with_order(grid(3, 3, 3, ScalarType::float64), Order::keep, true, 0);
  const auto array = add_stepped(stepped.mesh, beside("energy", Location::global, 2));
  for (std::uint64_t step = 0; step < 3; ++step)
    stepped.values[{array, step}] = moving_values(stepped.mesh.schema.arrays[array], 2, step);
  expect_back(stepped, written(stepped));
}

TEST(BesideMesh, MeshInMemory) {
  for (const Order order : {Order::keep, Order::stream}) {
    const std::vector<std::array<double, 3>> points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                       {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    const std::vector<std::array<std::uint64_t, 8>> cells = {{0, 1, 2, 3, 4, 5, 6, 7}};
    Mesh mesh = Mesh::of_hexahedra(points, cells);
    mesh.schema.order = order;
    const std::vector<double> energy = {2.5}, more = {3.5}, flux = {1, 2, 3, 4, 5};
    mesh.add_step<double>("energy", Location::global, 0, energy);
    mesh.add_step<double>("energy", Location::global, 1, more);
    mesh.add_step<double>("flux", Location::side_set, 1, flux);
    EXPECT_EQ(mesh.schema.arrays[1].elements, 5u);
    MemorySink sink;
    ASSERT_TRUE(write_mesh(sink, mesh));
    MemorySource source(sink.bytes);
    const auto back = read_mesh(source);
    ASSERT_TRUE(back) << back.error().message();
    EXPECT_EQ(back->values_as<double>(*back->find_array(Location::global, "energy"), 1), more);
    EXPECT_EQ(back->values_as<double>(*back->find_array(Location::side_set, "flux"), 1), flux);
    mesh.steps[1][1].pop_back();
    MemorySink other;
    const auto wrong = write_mesh(other, mesh);
    ASSERT_FALSE(wrong);
    EXPECT_EQ(wrong.error().code, ErrorCode::misuse);
  }
}

TEST(BesideMesh, AppendedSteps) {
  const Stepped all = beside_mesh(Order::keep);
  Stepped first = all;
  std::erase_if(first.values, [](const auto& it) { return it.first.second >= 4; });
  const Bytes bytes = written(first);
  MemoryRandomSource source(bytes);
  MemorySink sink;
  auto appender = Appender::open(source, sink, {});
  ASSERT_TRUE(appender) << appender.error().message();
  for (const auto& [key, values] : all.values)
    if (key.second >= 4) {
      ASSERT_TRUE(appender->add_step_values(key.first, key.second, values));
    }
  ASSERT_TRUE(appender->finish());
  expect_back(all, sink.bytes);
}

// A piece of the mesh has the values of all elements.
TEST(BesideMesh, ExtractedPiece) {
  const Stepped stepped = beside_mesh(Order::keep);
  const Bytes bytes = written(stepped);
  MemoryRandomSource source(bytes);
  auto extractor = MeshExtractor::open(source);
  ASSERT_TRUE(extractor);
  ExtractRequest request;
  request.cells.numbers = {100, 101};
  ASSERT_TRUE(extractor->begin(request));
  while (true) {
    const auto part = extractor->next();
    ASSERT_TRUE(part) << part.error().message();
    if (*part == nullptr) break;
  }
  for (const std::uint32_t array : {0u, 2u, 3u}) {
    ASSERT_TRUE(extractor->begin_values(array, 5));
    Bytes values;
    while (true) {
      const auto some = extractor->next_values();
      ASSERT_TRUE(some) << some.error().message();
      if (*some == nullptr) break;
      values.insert(values.end(), (*some)->values.begin(), (*some)->values.end());
    }
    EXPECT_TRUE(values == stepped.values.at({array, 5})) << array;
  }
}

// A file that lost its first group, or its index, still has these values.
TEST(BesideMesh, DamagedFile) {
  const Stepped stepped = beside_mesh(Order::keep, 40);
  const Bytes bytes = written(stepped);
  for (const bool lose_index : {false, true}) {
    Bytes damaged = bytes;
    const FileParts parts = take_apart(bytes);
    std::size_t at = container::kFileStartBytes;
    for (std::size_t c = 0; c < parts.chunks.size(); ++c) {
      const Chunk& chunk = parts.chunks[c];
      const std::size_t size = chunk.header.chunk_bytes();
      const bool first_group = chunk.is(ChunkKind::group) && c == 1;
      if (first_group || (lose_index && chunk.is(ChunkKind::index)))
        damaged[at + size - 1] ^= std::byte{1};
      at += size;
    }
    ASSERT_TRUE(damaged != bytes);
    MemoryRandomSource source(damaged);
    auto reader = StepReader::open_damaged(source);
    ASSERT_TRUE(reader) << reader.error().message();
    for (const std::uint32_t array : {0u, 2u, 3u, 4u}) {
      EXPECT_EQ(reader->steps(array).size(), kSteps) << array;
      for (const std::uint64_t step : reader->steps(array))
        EXPECT_TRUE(values_at(*reader, array, step) == stepped.values.at({array, step}))
            << array << " at step " << step;
    }
  }
}

TEST(BesideMesh, MisuseIsRefused) {
  MemorySink sink;
  const auto refused = [&](const ArrayInfo& info) {
    TestMesh mesh = grid(2, 2, 2, ScalarType::float64);
    mesh.schema.arrays.push_back(info);
    const auto writer = Writer::create(sink, mesh.schema);
    return !writer && writer.error().code == ErrorCode::misuse;
  };
  ArrayInfo info = beside("a", Location::node_set, 4);
  EXPECT_TRUE(refused(info)) << "static";
  info.per_step = true;
  EXPECT_FALSE(refused(info));
  info.blocks = {1, 0};
  EXPECT_TRUE(refused(info)) << "sets that do not ascend";
  info.blocks = {7};
  EXPECT_FALSE(refused(info));
  info.location = Location::global;
  EXPECT_TRUE(refused(info)) << "a global array on sets";
  info.location = Location::cell;
  info.blocks.clear();
  EXPECT_TRUE(refused(info)) << "a cell array that states its elements";

  Schema schema;
  schema.blocks.resize(1);
  schema.arrays = {beside("a", Location::global, 1)};
  schema.arrays[0].per_step = true;
  auto writer = Writer::create(sink, schema);
  ASSERT_TRUE(writer);
  ASSERT_TRUE(writer->end_mesh());
  const auto status = writer->add_step_values(0, 0, Bytes(8));
  ASSERT_FALSE(status) << "a mesh without vertices and cells";
  EXPECT_EQ(status.error().code, ErrorCode::misuse);
}

}  // namespace
}  // namespace shm
