// Tests of inconsistent data with correct checksums in groups whose cells are coded with the shifts
// codec.
#include <limits>
#include <string>
#include <unordered_set>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/shared/codec_id.h"
#include "hostile/hostile.h"
#include "hostile/watched_memory.h"
#include "shm/appender.h"
#include "support/sanitized.h"

namespace shm {
namespace {

/// The unpacked connectivity stream of a group of the shifts codec.
struct ShiftWords {
  Bytes words, symbols;
};
ShiftWords words_of(const GroupParts& group) {
  ByteReader in(group.streams[0]);
  (void)in.get_u8();  // size of the ring
  const std::uint64_t words = in.get_varint();
  const auto all = zstd_decompress(in.get_bytes(in.left()), words + group.header.cells);
  EXPECT_TRUE(all.has_value());
  if (!all) return {};
  const auto middle = all->begin() + static_cast<std::ptrdiff_t>(words);
  return {Bytes(all->begin(), middle), Bytes(middle, all->end())};
}
Bytes bytes_of(const ShiftWords& parts, std::uint8_t ring_bits = 0) {
  ByteWriter out, all;
  out.put_u8(ring_bits);
  out.put_varint(parts.words.size());
  all.put_bytes(parts.words);
  all.put_bytes(parts.symbols);
  out.put_bytes(zstd_compress(all.bytes, 1));
  return std::move(out.bytes);
}

// The reader must refuse a group in which a vertex is introduced twice, is used while it is not
// live, or is not imported although an earlier segment contains it.
void expect_shifts_refuse_lies(const char* name) {
  SCOPED_TRACE(name);
  EXPECT_EQ(text_of(decode_in_pieces(shifts_with([](GroupParts&) {}, name))),
            text_of(decode_in_pieces(file(name))));
  using Shift = std::vector<std::uint64_t>;  // block, nodes, births, imports, last uses
  const auto with_first = [&](const std::function<void(Shift&)>& lie) {
    return shifts_with(
        [&](GroupParts& group) {
          ShiftWords parts = words_of(group);
          ByteReader in(parts.words);
          Shift first;
          for (int i = 0; i < 12; ++i) first.push_back(in.get_varint());
          lie(first);
          ByteWriter out;
          for (const std::uint64_t it : first) out.put_varint(it);
          out.put_bytes(in.get_bytes(in.left()));
          parts.words = std::move(out.bytes);
          group.streams[0] = bytes_of(parts);
        },
        name);
  };
  EXPECT_TRUE(decode_in_pieces(with_first([](Shift&) {})));
  constexpr std::size_t kBirths = 9, kImports = 10, kLastUse = 11;
  const std::vector<std::function<void(Shift&)>> lies = {
      [](Shift& s) { s[0] = 1; },                      // no such block
      [](Shift& s) { s[1] += 2; },                     // another vertex
      [](Shift& s) { s[1] = s[2]; },                   // introduced twice
      [](Shift& s) { s[1] = 1 << 20; },                // imported but not in an earlier segment
      [](Shift& s) { s[1] = ~std::uint64_t{1}; },      // the same
      [](Shift& s) { s[kBirths] &= s[kBirths] - 1; },  // used but not introduced
      [](Shift& s) { s[kBirths] = s[kImports] = 0; },  // no vertex is introduced
      [](Shift& s) {
        s[kImports] &= s[kImports] - 1;
      },  // not imported although an earlier segment contains the vertex
      [](Shift& s) { s[kImports] = 0; },      // all of them
      [](Shift& s) { s[kImports] = 0xff; },   // imported although this segment introduced it
      [](Shift& s) { s[kLastUse] = 0xff; },   // used later
      [](Shift& s) { s[kBirths] |= 0x100; },  // a node that does not exist
      [](Shift& s) { s[kLastUse] |= std::uint64_t{1} << 63; },  // the same
  };
  for (std::size_t i = 0; i < lies.size(); ++i)
    EXPECT_EQ(code_of(with_first(lies[i])), ErrorCode::corrupt) << "change " << i;

  const auto with_symbols = [&](const std::function<void(Bytes&)>& lie) {
    return shifts_with(
        [&](GroupParts& group) {
          ShiftWords parts = words_of(group);
          lie(parts.symbols);
          group.streams[0] = bytes_of(parts);
        },
        name);
  };
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s[0] = std::byte{0}; })), ErrorCode::corrupt);
  // One more new shift than declared.
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) {
              const auto old =
                  std::find_if(s.begin(), s.end(), [](std::byte b) { return b != std::byte{255}; });
              ASSERT_NE(old, s.end());
              *old = std::byte{255};
            })),
            ErrorCode::corrupt);
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s.back() = std::byte{254}; })), ErrorCode::corrupt);
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s.pop_back(); })), ErrorCode::corrupt);
  EXPECT_EQ(code_of(with_symbols([](Bytes& s) { s.push_back(s.back()); })), ErrorCode::corrupt);
}
TEST(Hostile, LyingShifts) { expect_shifts_refuse_lies("shifts"); }
TEST(Hostile, LyingShiftsOfOrderStream) { expect_shifts_refuse_lies("shifts_stream"); }

// If vertices are numbered in the order in which they are introduced, each new vertex must get
// exactly the next number.
TEST(Hostile, ShiftsThatLeaveNumbersOut) {
  TestMesh mesh = with_order(grid(1, 1, 1), Order::stream, false, 0);
  const Bytes valid = written(mesh, 65536, ConnectivityCodec::shifts, Level::fast);
  const auto with_numbers = [&](const std::vector<std::uint64_t>& numbers, std::uint64_t imports) {
    FileParts parts = take_apart(valid);
    Chunk* chunk = parts.find(ChunkKind::group, 0);
    auto group = take_group_apart(*chunk);
    ByteWriter words;
    words.put_varint(0);
    for (const std::uint64_t number : numbers) words.put_signed(static_cast<std::int64_t>(number));
    words.put_varint(0xff);
    if (imports > 0) words.put_varint(imports);
    words.put_varint(0xff);
    group->streams[0] = bytes_of({std::move(words.bytes), {std::byte{255}}});
    chunk->payload = put_group_together(*group);
    return put_together(parts);
  };
  const std::uint64_t import = std::uint64_t{1} << 63;
  EXPECT_EQ(with_numbers({0, 1, 2, 3, 4, 5, 6, 7}, 0), valid);
  using Numbers = std::vector<std::uint64_t>;
  for (const Numbers& numbers :
       {Numbers{1, 2, 3, 4, 5, 6, 7, 8}, Numbers{0, 1, 2, 3, 4, 5, 6, 8},
        Numbers{0, 1, 2, 3, 4, 5, 7, 6}, Numbers{0, 1, 2, 3, 4, 5, 6, 6},
        Numbers{import, 1, 2, 3, 4, 5, 6, 7}, Numbers{0, 1, 2, 3, 4, 5, 6, import},
        Numbers{0, 1, 2, 3, 4, 5, 6, ~std::uint64_t{0}}})
    EXPECT_EQ(code_of(with_numbers(numbers, 0)), ErrorCode::corrupt);
  // The first segment cannot import vertices.
  EXPECT_EQ(code_of(with_numbers({0, 1, 2, 3, 4, 5, 6, import}, 0x80)), ErrorCode::corrupt);
}

// Stream numbers of imported vertices.
TEST(Hostile, LyingNumbersOfImportsOfShifts) {
  const auto code_with = [](const std::function<void(GroupParts&)>& change) {
    return code_of(shifts_with(change, "shifts_stream"));
  };
  const auto is_there = [](GroupParts& group) {
    ASSERT_EQ(group.header.streams[1].kind, container::StreamKind::vertex_numbers);
  };
  EXPECT_EQ(code_with([&](GroupParts& group) {  // the same number again and again
              is_there(group);
              group.streams.erase(group.streams.begin() + 1);
              group.header.streams.erase(group.header.streams.begin() + 1);
            }),
            ErrorCode::corrupt);
  for (std::size_t byte = 0; byte < 256; ++byte) {  // other numbers, own numbers, invalid numbers
    const auto code = code_with([&](GroupParts& group) {
      is_there(group);
      group.streams[1] = Bytes(20, static_cast<std::byte>(byte));
    });
    EXPECT_EQ(code, ErrorCode::corrupt) << byte;
  }
  EXPECT_EQ(code_with([&](GroupParts& group) {
              is_there(group);
              group.header.streams[1].codec = container::Codec::shifts;
            }),
            ErrorCode::unsupported);
  // A stream of vertex numbers is refused in the first segment, because it imports no vertices from
  // earlier segments. It is also refused in files of order `keep`.
  for (const char* name : {"shifts_stream", "shifts"}) {
    FileParts parts = take_apart(file(name));
    for (const std::size_t nth : {0u, 2u}) {
      if (nth == 2 && std::string(name) == "shifts_stream") continue;
      FileParts changed = parts;
      Chunk* chunk = changed.find(ChunkKind::group, nth);
      auto group = take_group_apart(*chunk);
      ASSERT_TRUE(group);
      container::StreamEntry entry;
      entry.kind = container::StreamKind::vertex_numbers;
      entry.codec = container::Codec::predictive;
      group->header.streams.insert(group->header.streams.begin() + 1, entry);
      group->streams.insert(group->streams.begin() + 1, Bytes(3));
      chunk->payload = put_group_together(*group);
      EXPECT_EQ(code_of(put_together(changed)), ErrorCode::corrupt) << name << nth;
    }
  }
}

/// Returns the file "shifts_columns" after the ring size of group `nth`, counted from 0, has been
/// set to 2^ring_bits.
Bytes with_ring(std::size_t nth, int ring_bits) {
  FileParts parts = take_apart(file("shifts_columns"));
  Chunk* chunk = parts.find(ChunkKind::group, nth);
  auto group = take_group_apart(*chunk);
  EXPECT_TRUE(group);
  if (!group) return {};
  group->streams[0][0] = static_cast<std::byte>(ring_bits);
  chunk->payload = put_group_together(*group);
  return put_together(parts);
}

TEST(Hostile, RingsOfShiftsAreNoLargerThanTheirGroups) {
  const int ring = std::to_integer<int>(
      take_group_apart(*take_apart(file("shifts_columns")).find(ChunkKind::group))->streams[0][0]);
  ASSERT_EQ(ring, 5);  // for twelve cells: at most 48 positions
  EXPECT_EQ(text_of(decode_in_pieces(with_ring(0, ring))),
            text_of(decode_in_pieces(file("shifts_columns"))));
  for (const std::size_t nth : {0u, 1u}) {
    for (const int bits : {ring + 1, 19, 20, 63, 64, 255}) {
      largest_allocation = 0;
      EXPECT_EQ(code_of(with_ring(nth, bits)), ErrorCode::corrupt) << bits;
      EXPECT_LE(largest_allocation, std::size_t{1} << 20) << bits;
    }
    // Values are in columns that need neighbourhoods.
    EXPECT_EQ(code_of(with_ring(nth, 0)), ErrorCode::unsupported);
    // A reader cannot detect that a smaller ring size is wrong. Decoding may return wrong values or
    // an error, but must not crash.
    for (int bits = 1; bits < ring; ++bits) (void)decode_in_pieces(with_ring(nth, bits));
  }
}

TEST(Hostile, StreamsOfShiftsMissingRepeatedOrSwapped) {
  const std::size_t streams = 4;
  for (std::size_t at = 0; at < streams; ++at) {
    const auto place = static_cast<std::ptrdiff_t>(at);
    const auto refused = [&](const std::function<void(GroupParts&)>& lie) {
      EXPECT_FALSE(decode_in_pieces(shifts_with(lie))) << at;
    };
    refused([&](GroupParts& group) {
      ASSERT_EQ(group.streams.size(), streams);
      group.streams.erase(group.streams.begin() + place);
      group.header.streams.erase(group.header.streams.begin() + place);
    });
    refused([&](GroupParts& group) {
      group.streams.insert(group.streams.begin() + place, group.streams[at]);
      group.header.streams.insert(group.header.streams.begin() + place, group.header.streams[at]);
    });
    if (at > 0) {
      refused([&](GroupParts& group) {
        std::swap(group.streams[at], group.streams[at - 1]);
        std::swap(group.header.streams[at], group.header.streams[at - 1]);
      });
    }
    for (const auto codec : {container::Codec::predictive, container::Codec::paper,
                             container::Codec::mixed_columns, container::Codec::shifts,
                             container::Codec::differences, static_cast<container::Codec>(99)})
      refused([&](GroupParts& group) {
        auto& is = group.header.streams[at].codec;
        is = is == codec ? static_cast<container::Codec>(98) : codec;
      });
  }
  // A segment must not contain both groups of the shifts codec and groups of another codec.
  for (const auto codec : {container::Codec::predictive, container::Codec::paper}) {
    FileParts parts = take_apart(file("shifts"));
    for (const std::size_t nth : {0u, 1u}) {
      FileParts changed = parts;
      Chunk* chunk = changed.find(ChunkKind::group, nth);
      auto group = take_group_apart(*chunk);
      ASSERT_TRUE(group);
      group->header.streams[0].codec = codec;
      chunk->payload = put_group_together(*group);
      EXPECT_FALSE(decode_in_pieces(put_together(changed))) << nth;
    }
  }
}

// The cells of a group are coded with the shifts codec, but the schema either does not allow this
// codec or contradicts the contents of the group.
TEST(Hostile, ShiftsOfAnotherSchema) {
  const auto code_with = [](const std::function<void(Schema&)>& change) {
    TestMesh mesh = bent_grid(3, 2, 2);
    const Bytes valid = written(mesh, 65536, ConnectivityCodec::shifts);
    change(mesh.schema);
    FileParts parts = take_apart(valid);
    parts.chunks[0].payload = schema_payload(mesh.schema);
    return code_of(put_together(parts));
  };
  EXPECT_EQ(code_with([](Schema& s) { s.order = Order::stream; }), ErrorCode::corrupt);
  EXPECT_EQ(code_with([](Schema& s) { s.order = Order::free; }), ErrorCode::corrupt);
  EXPECT_EQ(code_with([](Schema& s) { s.delay = 5; }), ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) { s.blocks[0].nodes_per_cell = 0; }), ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) { s.blocks[0].nodes_per_cell = 65; }), ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) {
              s.arrays.push_back(array_of("a", Location::cell, ScalarType::int8, 33));
              s.arrays[0].per_step = true;
            }),
            ErrorCode::unsupported);
  EXPECT_EQ(code_with([](Schema& s) { s.blocks[0].nodes_per_cell = 7; }), ErrorCode::corrupt);
  EXPECT_EQ(code_with([](Schema& s) { s.coordinate_type = ScalarType::float64; }),
            ErrorCode::corrupt);
}

// A program that appends steps decodes the groups again. If the schema does not allow the shifts
// codec or contradicts the contents of a group, the program must report the same error as a reader.
TEST(Hostile, ShiftsOfAnotherSchemaAreNotDecodedAgain) {
  const auto appends_with = [](const std::function<void(Schema&)>& change) {
    TestMesh mesh = bent_grid(3, 2, 2);
    mesh.schema.arrays.push_back(array_of("a", Location::cell, ScalarType::int8, 1));
    mesh.schema.arrays[0].per_step = true;
    const Bytes valid = written(mesh, 65536, ConnectivityCodec::shifts);
    change(mesh.schema);
    FileParts parts = take_apart(valid);
    parts.chunks[0].payload = schema_payload(mesh.schema);
    const Bytes changed = put_together(parts);
    MemoryRandomSource source(changed);
    MemorySink sink;
    AppendOptions options;
    options.waiting_bytes = 0;  // no bundles: they can be encoded without the mesh
    auto appender = Appender::open(source, sink, options);
    if (!appender) return false;
    const Bytes values(12 * mesh.schema.arrays[0].components);
    const auto added = appender->add_step_values(0, 0, values);
    EXPECT_TRUE(added || added.error().code == ErrorCode::unsupported ||
                added.error().code == ErrorCode::corrupt);
    return bool(added);
  };
  EXPECT_TRUE(appends_with([](Schema&) {}));
  EXPECT_FALSE(appends_with([](Schema& s) { s.delay = 5; }));
  EXPECT_FALSE(appends_with([](Schema& s) { s.blocks[0].nodes_per_cell = 65; }));
  EXPECT_FALSE(appends_with([](Schema& s) { s.blocks[0].nodes_per_cell = 1000; }));
  EXPECT_FALSE(appends_with([](Schema& s) { s.blocks[0].nodes_per_cell = 0; }));
  EXPECT_FALSE(appends_with([](Schema& s) { s.arrays[0].components = 33; }));
}

// If the schema declares no blocks, a group cannot contain cells, whatever its header states.
TEST(Hostile, ShiftsWithoutAnyBlock) {
  Schema schema;
  schema.coordinate_type = ScalarType::float32;
  for (const std::uint8_t symbol : {std::uint8_t{255}, std::uint8_t{0}}) {
    ByteWriter connectivity;
    connectivity.put_u8(0);      // no ring
    connectivity.put_varint(0);  // no words
    connectivity.put_bytes(zstd_compress(Bytes(1, std::byte{symbol}), 1));
    GroupParts group;
    group.header.cells = 1;
    group.header.max_active_vertices = 8;
    group.header.decoded_bytes = 1000;
    container::StreamEntry entry;
    entry.kind = container::StreamKind::connectivity;
    entry.codec = container::Codec::shifts;
    group.header.streams.push_back(entry);
    group.streams.push_back(std::move(connectivity.bytes));
    const Bytes bytes = file_of({{ChunkKind::schema, schema_payload(schema)},
                                 {ChunkKind::group, put_group_together(group)}});
    const auto decoded = decode_in_pieces(bytes);
    ASSERT_FALSE(decoded);
    EXPECT_EQ(decoded.error().code, ErrorCode::corrupt);
    EXPECT_NE(decoded.error().message().find("a cell of no block"), std::string::npos)
        << decoded.error().message();
  }
}

}  // namespace
}  // namespace shm
