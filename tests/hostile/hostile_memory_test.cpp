// Tests that damaged and inconsistent files, and meshes with many components, do not need excessive
// memory.
#include <array>
#include <string>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/shared/codec_id.h"
#include "format/schema.h"
#include "hostile/hostile.h"
#include "hostile/watched_memory.h"
#include "support/sanitized.h"

namespace shm {
namespace {

TEST(Hostile, BytesBehindTheEndAreNotKept) {
  Decoder decoder;
  ASSERT_TRUE(decoder.feed(file("keep")));
  while (*decoder.advance() == Decoder::Progress::item_ready) decoder.take();
  const Bytes more(1 << 16);
  largest_allocation = 0;
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(decoder.feed(more));
    ASSERT_EQ(*decoder.advance(), Decoder::Progress::need_input);
  }
  EXPECT_LE(largest_allocation, std::size_t{4} << 20);
}

TEST(Hostile, StatedSizesAllocateNothing) {
  constexpr std::size_t kSmall = 1 << 20;
  // The header declares a payload of four gigabytes, but the file ends after the header.
  FileParts parts = take_apart(file("keep"));
  ByteWriter start;
  container::put(start, parts.start);
  container::ChunkHeader header;
  header.kind = static_cast<std::uint8_t>(ChunkKind::schema);
  header.is_long = true;
  header.payload_bytes = std::uint64_t{1} << 32;
  container::put(start, header);
  largest_allocation = 0;
  EXPECT_EQ(code_of(start.bytes), ErrorCode::over_limit);
  ReadLimits limits;
  limits.max_chunk_bytes = std::uint64_t{1} << 40;
  // This payload length does not fit into a 32-bit size, so the file is refused, whatever the limit
  // is.
  EXPECT_EQ(code_of(start.bytes, limits),
            sizeof(std::size_t) < 8 ? ErrorCode::over_limit : ErrorCode::truncated);
  EXPECT_LE(largest_allocation, kSmall);

  // The schema declares an unpacked size of one gigabyte, with each of the two packing methods.
  for (const std::uint8_t method : {std::uint8_t{0}, std::uint8_t{1}}) {
    ByteWriter payload;
    payload.put_u16(container::kMajor);
    payload.put_u16(container::kMinor);
    payload.put_u32(0);
    payload.put_u8(method);
    payload.put_varint(std::uint64_t{1} << 30);
    payload.put_bytes(zstd_compress(Bytes(100), 1));
    largest_allocation = 0;
    EXPECT_EQ(code_of(file_of({{ChunkKind::schema, payload.bytes}})), ErrorCode::corrupt);
    EXPECT_LE(largest_allocation, kSmall);
  }

  // The group header declares 2^20 cells and one gigabyte of decoded data.
  parts = take_apart(file("keep"));
  auto group = take_group_apart(parts.chunks[1]);
  ASSERT_TRUE(group);
  group->header.cells = container::kMaxGroupCells;
  group->header.vertices = std::uint64_t{1} << 60;
  group->header.decoded_bytes = std::uint64_t{1} << 30;
  parts.chunks[1].payload = put_group_together(*group);
  largest_allocation = 0;
  EXPECT_EQ(code_of(put_together(parts)), ErrorCode::corrupt);
  EXPECT_LE(largest_allocation, std::size_t{32} << 20);
}

TEST(Hostile, LimitsOfTheSchemaComeBeforeItsMemory) {
  // After packing, a million unnamed blocks and a million unnamed arrays need almost no bytes.
  for (const bool arrays : {false, true}) {
    Schema schema;
    if (arrays)
      schema.arrays.resize(1000000);
    else
      schema.blocks.resize(1000000);
    const Bytes bytes = file_of({{ChunkKind::schema, schema_payload(schema)}});
    ReadLimits limits;
    limits.max_blocks = limits.max_arrays = 1000;
    largest_allocation = 0;
    EXPECT_EQ(code_of(bytes, limits), ErrorCode::over_limit);
    EXPECT_LE(largest_allocation, std::size_t{33} << 20) << (arrays ? "arrays" : "blocks");
  }
}

/// Adds `arrays` point arrays with `components` components each to a mesh.
TestMesh with_components(TestMesh mesh, std::uint32_t arrays, std::uint32_t components,
                         ScalarType type) {
  for (std::uint32_t a = 0; a < arrays; ++a)
    add_array(mesh, array_of("a" + std::to_string(a), Location::point, type, components),
              mesh.vertices);
  return mesh;
}
struct Components {
  std::uint32_t arrays, components;
  bool any_tables;  // true if some array is coded with match tables, which need much memory
};
constexpr std::array<Components, 4> kManyComponents = {
    {{1, 4096, false}, {4096, 1, true}, {256, 16, true}, {64, 64, false}}};

// Only a limited number of components is coded with match tables, which need much memory. Each of
// the other components needs only a few kilobytes.
TEST(Hostile, ManyComponentsTakeLittleMemory) {
  constexpr std::size_t kPerComponent = 12 << 10, kTables = 32 << 20;
  for (const Components& many : kManyComponents)
    for (const Level level : {Level::fast, Level::standard, Level::best}) {
      if (kSanitized && level != Level::best) continue;
      SCOPED_TRACE(std::to_string(many.arrays) + " arrays, level " +
                   std::to_string(static_cast<int>(level)));
      const TestMesh mesh =
          with_components(grid(1, 1, 1), many.arrays, many.components, ScalarType::uint8);
      MemorySink sink;
      WriteOptions options;
      options.level = level;
      ASSERT_TRUE(write_mesh(mesh, sink, options));
      const std::size_t most =
          4096 * kPerComponent + (level == Level::best || many.any_tables ? kTables : 0);
      EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(sink.bytes)); }), most);

      FileParts parts = take_apart(sink.bytes);
      Chunk& chunk = *parts.find(ChunkKind::group);
      const auto group = take_group_apart(chunk);
      ASSERT_TRUE(group);
      // A missing stream is read as zeros, so the file needs only a few bytes per array.
      auto empty = *group;
      const auto first_array = static_cast<std::ptrdiff_t>(
          std::find_if(
              empty.header.streams.begin(), empty.header.streams.end(),
              [](const auto& entry) { return entry.kind == container::StreamKind::array; }) -
          empty.header.streams.begin());
      empty.header.streams.erase(empty.header.streams.begin() + first_array,
                                 empty.header.streams.end());
      empty.streams.erase(empty.streams.begin() + first_array, empty.streams.end());
      chunk.payload = put_group_together(empty);
      EXPECT_LE(memory_of([&] { (void)decode_in_pieces(put_together(parts)); }), most);

      // The group states the codec mixed_columns for an array that this codec does not support.
      auto mixed = *group;
      mixed.header.streams.back().codec = container::Codec::mixed_columns;
      chunk.payload = put_group_together(mixed);
      EXPECT_LE(memory_of([&] { EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported); }),
                most + kTables);
    }
}

// In groups of the shifts codec, only a limited number of components is predicted from earlier
// values, because these values must be kept in memory. The other components are coded with zstd
// only.
TEST(Hostile, ManyComponentsOfShiftsTakeLittleMemory) {
  constexpr std::size_t kPerComponent = 4 << 10, kRings = 34 << 20;
  for (const Components& many : kManyComponents) {
    SCOPED_TRACE(many.arrays);
    const TestMesh mesh =
        with_components(bent_grid(2, 2, 2), many.arrays, many.components, ScalarType::float32);
    MemorySink sink;
    WriteOptions options;
    options.connectivity = ConnectivityCodec::shifts;
    options.segment_cells = 3;
    EXPECT_LE(memory_of([&] { EXPECT_TRUE(write_mesh(mesh, sink, options)); }),
              std::size_t{128} << 20);
    const Decoded whole = std::move(*decode_in_pieces(sink.bytes));
    const std::size_t most = kRings + 4096 * kPerComponent;
    EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(sink.bytes)); }), most);

    // The group states the codec `differences` for an array that this codec does not support.
    FileParts parts = take_apart(sink.bytes);
    Chunk& chunk = *parts.find(ChunkKind::group);
    auto group = take_group_apart(chunk);
    ASSERT_TRUE(group);
    EXPECT_EQ(group->header.streams.back().codec, container::Codec::shuffled_zstd);
    group->header.streams.back().codec = container::Codec::differences;
    chunk.payload = put_group_together(*group);
    EXPECT_LE(memory_of([&] { EXPECT_EQ(code_of(put_together(parts)), ErrorCode::unsupported); }),
              most);
  }
}

// A file with one segment per cell needs no more memory than a file with a single segment.
TEST(Hostile, ManySegmentsOfShiftsTakeLittleMemory) {
  MemorySink sink;
  WriteOptions options;
  options.connectivity = ConnectivityCodec::shifts;
  options.segment_cells = 1;
  ASSERT_TRUE(write_mesh(bent_grid(6, 6, 6), sink, options));
  EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(sink.bytes)); }), std::size_t{8} << 20);
}

TEST(Hostile, StatedSizesOfShiftsAllocateNothing) {
  // One of the streams declares one gigabyte of data, but ends after this declaration.
  for (const std::size_t stream : {0u, 1u, 2u, 3u}) {
    const Bytes bytes = shifts_with([&](GroupParts& group) {
      group.header.decoded_bytes = std::uint64_t{1} << 30;
      group.header.cells = container::kMaxGroupCells;
      ASSERT_EQ(group.streams.size(), 4u);
      ByteWriter out;
      if (stream == 0) out.put_u8(0);
      out.put_varint(stream == 0 ? std::uint64_t{1} << 30 : std::uint64_t{1} << 26);
      if (stream > 0) {
        const int components = stream == 1 ? 3 : stream == 2 ? 2 : 1;
        out.put_u8(0);
        for (int c = 0; c < components; ++c) {
          out.put_u8(stream == 2 ? 5 : 0);  // integers, or any floating-point numbers
          out.put_signed(0);
          out.put_u8(stream == 2 ? 2 : 4);
        }
        group.header.streams[stream].codec = container::Codec::differences;
      }
      out.put_bytes(zstd_compress(Bytes(100), 1));
      group.streams[stream] = std::move(out.bytes);
    });
    largest_allocation = 0;
    EXPECT_EQ(code_of(bytes), ErrorCode::corrupt) << stream;
    EXPECT_LE(largest_allocation, std::size_t{4} << 20) << stream;
  }
}

TEST(Hostile, QuantizedComponentsShareTheirSchema) {
  TestMesh mesh = with_components(grid(1, 1, 1), 1, 4096, ScalarType::float32);
  Quantization& quantization = mesh.schema.arrays[0].quantization;
  quantization.bits = 16;
  quantization.minimum.assign(4096, 0.0);
  quantization.maximum.assign(4096, 1.0);
  const Bytes bytes = written(mesh);
  EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(bytes)); }), std::size_t{64} << 20);
}

// While a Writer tries codecs, it keeps several copies of the coder of each component, but it
// limits the number of components with match tables. Writing 1.3 MB of values in 4096 components
// therefore does not need gigabytes.
TEST(Hostile, ManyComponentsAreWrittenInBoundedMemory) {
  for (std::size_t i = 0; i < kManyComponents.size(); i += every(2)) {
    const Components& many = kManyComponents[i];
    SCOPED_TRACE(many.arrays);
    const TestMesh mesh =
        with_components(bent_grid(4, 3, 3), many.arrays, many.components, ScalarType::float32);
    WriteOptions options;
    options.level = Level::best;
    MemorySink sink;
    EXPECT_LE(memory_of([&] { EXPECT_TRUE(write_mesh(mesh, sink, options)); }),
              std::size_t{256} << 20);
  }
}

// In groups of the shifts codec, columns (the decoders of arrays) need memory in proportion to the
// size of the ring, which stores recent elements. The ring size is limited by the number of cells
// in the group.
TEST(Hostile, ColumnsOverShiftsTakeLittleMemory) {
  const Bytes bytes = written(with_components(bent_grid(2, 2, 2), 1, 28, ScalarType::float32),
                              65536, ConnectivityCodec::shifts);
  EXPECT_LE(memory_of([&] { EXPECT_TRUE(decode_in_pieces(bytes)); }), std::size_t{16} << 20);
}

}  // namespace
}  // namespace shm
