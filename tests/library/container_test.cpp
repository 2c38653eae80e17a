// Tests of the structs of the file format. get() must restore the struct that put() stored, and
// structs of fixed size must be stored as exactly the bytes in the specification.
#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include "base/binary.h"
#include "codecs/shared/codec_id.h"
#include "format/chunk_writer.h"
#include "format/format.h"
#include "support/file_surgery.h"

namespace shm::container {
namespace {

std::vector<std::byte> bytes_of(std::initializer_list<int> values) {
  std::vector<std::byte> bytes;
  for (int v : values) bytes.push_back(static_cast<std::byte>(v));
  return bytes;
}

TEST(Container, FileStart) {
  ByteWriter out;
  put(out, FileStart{0x0102, 0x0304, 0x05060708});
  EXPECT_EQ(out.bytes,
            bytes_of({0x89, 'S', 'H', 'M', '\r', '\n', 0x1a, '\n', 2, 1, 4, 3, 8, 7, 6, 5}));
  EXPECT_EQ(out.bytes.size(), kFileStartBytes);
  ByteReader in(out.bytes);
  FileStart start;
  EXPECT_TRUE(get(in, start));
  EXPECT_EQ(start, (FileStart{0x0102, 0x0304, 0x05060708}));
  for (std::size_t i = 0; i < 8; ++i) {
    auto wrong = out.bytes;
    wrong[i] ^= std::byte{1};
    ByteReader again(wrong);
    EXPECT_FALSE(get(again, start)) << i;
  }
}

void expect_chunk_header(const ChunkHeader& header, const std::vector<std::byte>& expected) {
  ByteWriter out;
  put(out, header);
  ASSERT_EQ(out.bytes.size(), header.bytes());
  ASSERT_EQ(expected.size(), header.bytes() - 4);
  EXPECT_TRUE(std::equal(expected.begin(), expected.end(), out.bytes.begin()));
  EXPECT_EQ(header_bytes(out.bytes), header.bytes());
  ChunkHeader back;
  ByteReader in(out.bytes);
  EXPECT_EQ(get(in, back), HeaderState::good);
  EXPECT_EQ(in.left(), 0u);
  EXPECT_EQ(back.kind, header.kind);
  EXPECT_EQ(back.version, header.version);
  EXPECT_EQ(back.flags, header.flags);
  EXPECT_EQ(back.is_long, header.is_long);
  EXPECT_EQ(back.sequence, header.sequence);
  EXPECT_EQ(back.segment, header.segment);
  EXPECT_EQ(back.payload_bytes, header.payload_bytes);
  EXPECT_EQ(back.payload_checksum, header.payload_checksum);
  for (std::size_t i = 0; i < header.bytes(); ++i) {
    auto wrong = out.bytes;
    wrong[i] ^= std::byte{0x10};
    ByteReader again(wrong);
    EXPECT_EQ(get(again, back), i < 4 ? HeaderState::bad_mark : HeaderState::bad_checksum) << i;
  }
  auto other_mark = out.bytes;
  other_mark[3] ^= std::byte{0x20};
  other_mark.resize(kLongHeaderBytes);
  ByteReader again(other_mark);
  EXPECT_EQ(get(again, back), HeaderState::bad_checksum);
  for (std::size_t cut = kShortHeaderBytes; cut < header.bytes(); ++cut) {
    ByteReader of_less(std::span(out.bytes).first(cut));
    EXPECT_EQ(get(of_less, back), HeaderState::bad_checksum) << cut;
  }
}

TEST(Container, ChunkHeaders) {
  const ChunkHeader longer{3, 4, 1, true, 0x11121314, 0x21222324, 0x3132333435363738, 0x41424344};
  expect_chunk_header(longer, bytes_of({'S',  'H',  'M',  'C',  3,    4,    1,    0,    0x14, 0x13,
                                        0x12, 0x11, 0x24, 0x23, 0x22, 0x21, 0x38, 0x37, 0x36, 0x35,
                                        0x34, 0x33, 0x32, 0x31, 0x44, 0x43, 0x42, 0x41}));
  const ChunkHeader shorter{3, 4, 1, false, 0x11121314, 0x2122, 0x313233, 0x41424344};
  expect_chunk_header(shorter, bytes_of({'S', 'H', 'M', 'c', 0xc3, 0x33, 0x32, 0x31, 0x14, 0x13,
                                         0x12, 0x11, 0x22, 0x21, 0x44, 0x43, 0x42, 0x41}));
}

TEST(Container, WhatDoesNotFitHasALongHeader) {
  const auto is_long = [](auto&& change, std::uint16_t minor = kMinor) {
    ChunkHeader header{15, 7, 1, false, ~0u, 0xffff, 0xffffff, ~0u};
    change(header);
    return has_long_header(header, FileStart{kMajor, minor, 0});
  };
  EXPECT_FALSE(is_long([](ChunkHeader&) {}));
  EXPECT_TRUE(is_long([](ChunkHeader&) {}, 9));
  EXPECT_TRUE(is_long([](ChunkHeader& header) { ++header.kind; }));
  EXPECT_TRUE(is_long([](ChunkHeader& header) { ++header.version; }));
  EXPECT_TRUE(is_long([](ChunkHeader& header) { ++header.flags; }));
  EXPECT_TRUE(is_long([](ChunkHeader& header) { ++header.segment; }));
  EXPECT_TRUE(is_long([](ChunkHeader& header) { ++header.payload_bytes; }));
}

GroupHeader any_group() {
  GroupHeader header;
  header.first_cell = 1000000000000;
  header.first_vertex = 2000000000000;
  header.cells = kMaxGroupCells;
  header.vertices = 300;
  header.unused_vertices = 7;
  header.max_active_vertices = 99;
  header.decoded_bytes = 123456;
  header.box = {-1, -2, -3, 1, 2, std::numeric_limits<double>::infinity()};
  header.streams = {{StreamKind::connectivity, 0, Codec::rows, 0, 10, 11},
                    {StreamKind::geometry, 0, Codec::predictive, 2, 1 << 20, 12},
                    {StreamKind::array, 5000, Codec::predictive, 2, 0, 0xffffffff}};
  return header;
}

TEST(Container, GroupHeader) {
  for (const std::uint8_t version : {std::uint8_t{0}, std::uint8_t{1}}) {
    GroupHeader header = any_group();
    header.version = version;
    ByteWriter out;
    put(out, header);
    ByteReader in(out.bytes);
    GroupHeader back;
    ASSERT_TRUE(get(in, back, version));
    EXPECT_EQ(in.left(), 0u);
    EXPECT_EQ(back.first_cell, header.first_cell);
    EXPECT_EQ(back.first_vertex, header.first_vertex);
    EXPECT_EQ(back.cells, header.cells);
    EXPECT_EQ(back.vertices, header.vertices);
    EXPECT_EQ(back.unused_vertices, header.unused_vertices);
    EXPECT_EQ(back.max_active_vertices, header.max_active_vertices);
    EXPECT_EQ(back.decoded_bytes, header.decoded_bytes);
    EXPECT_EQ(back.box, header.box);
    ASSERT_EQ(back.streams.size(), 3u);
    for (std::size_t s = 0; s < 3; ++s) {
      EXPECT_EQ(back.streams[s].kind, header.streams[s].kind);
      EXPECT_EQ(back.streams[s].array, header.streams[s].array);
      EXPECT_EQ(back.streams[s].codec, header.streams[s].codec);
      EXPECT_EQ(back.streams[s].needs, version == 0 ? header.streams[s].needs : 0);
      EXPECT_EQ(back.streams[s].bytes, header.streams[s].bytes);
      EXPECT_EQ(back.streams[s].checksum, header.streams[s].checksum);
    }
    for (std::size_t size = 0; size < out.bytes.size(); ++size) {
      ByteReader cut(std::span<const std::byte>(out.bytes).first(size));
      EXPECT_FALSE(get(cut, back, version)) << size;
    }
  }
}

TEST(Container, GroupHeaderThatCannotBe) {
  const auto refused = [](auto&& lie) {
    GroupHeader header = any_group();
    lie(header);
    ByteWriter out;
    put(out, header);
    ByteReader in(out.bytes);
    EXPECT_FALSE(get(in, header, header.version));
  };
  refused([](GroupHeader& h) { h.cells = kMaxGroupCells + 1; });
  refused([](GroupHeader& h) { h.unused_vertices = h.vertices + 1; });
}

std::vector<StepPart> any_parts() {
  const StepHeader header{3,
                          1 << 20,
                          1,
                          1,
                          1 << 19,
                          StepReference::trend,
                          77,
                          std::uint64_t{1} << 33,
                          Codec::shuffled_zstd};
  StepHeader before = header, alone = header;
  before.array = 1;
  before.group = 0;
  before.reference = StepReference::before;
  alone.step = alone.reference_step = 0xffffffff;
  alone.reference = StepReference::nothing;
  StepHeader on_base = header;
  on_base.reference = StepReference::base;
  on_base.reference_step = 0;
  return {{header, 5}, {before, 0}, {alone, 1000}, {on_base, 7}};
}

void expect_same(const StepPart& one, const StepPart& other) {
  const StepHeader &a = one.header, &b = other.header;
  EXPECT_EQ(std::tie(a.array, a.step, a.reference_step, a.reference, a.group, a.count, a.codec),
            std::tie(b.array, b.step, b.reference_step, b.reference, b.group, b.count, b.codec));
  EXPECT_EQ(one.bytes, other.bytes);
}

TEST(Container, HeadsOfStepValues) {
  const std::vector<StepPart> all = any_parts();
  for (const std::uint8_t version : {std::uint8_t{0}, std::uint8_t{1}}) {
    const auto parts = std::span(all).first(version == 0 ? 1 : all.size());
    std::uint64_t values = 0;
    for (const StepPart& part : parts) values += part.bytes;
    ByteWriter out;
    put(out, parts, version);
    EXPECT_LE(out.bytes.size(), kMostStepHeadBytes);
    ByteReader in(out.bytes);
    std::vector<StepPart> back;
    ASSERT_TRUE(get(in, back, version, out.bytes.size() + values));
    EXPECT_EQ(in.left(), 0u);
    ASSERT_EQ(back.size(), parts.size());
    for (std::size_t p = 0; p < back.size(); ++p) expect_same(back[p], parts[p]);
    for (std::size_t size = 0; size < out.bytes.size(); ++size) {
      ByteReader cut(std::span<const std::byte>(out.bytes).first(size));
      EXPECT_FALSE(get(cut, back, version, out.bytes.size() + values)) << size;
    }
    for (const std::uint64_t other : {values - 1, values + 1}) {
      ByteReader again(out.bytes);
      EXPECT_EQ(get(again, back, version, out.bytes.size() + other), version == 0);
    }
  }
}

TEST(Container, HeadsOfStepValuesThatCannotBe) {
  const auto refused = [](const std::vector<StepPart>& parts) {
    std::uint64_t values = 0;
    for (const StepPart& part : parts) values += part.bytes;
    ByteWriter out;
    put(out, parts, 1);
    ByteReader in(out.bytes);
    std::vector<StepPart> back;
    return !get(in, back, 1, out.bytes.size() + values);
  };
  EXPECT_FALSE(refused(any_parts()));
  EXPECT_FALSE(refused(std::vector<StepPart>(kMostStepParts, any_parts()[0])));
  EXPECT_TRUE(refused(std::vector<StepPart>(kMostStepParts + 1, any_parts()[0])));
  EXPECT_TRUE(refused({}));
  const auto lies = [&](const std::function<void(StepPart&)>& lie) {
    std::vector<StepPart> parts = any_parts();
    lie(parts[1]);
    return refused(parts);
  };
  EXPECT_TRUE(lies([](StepPart& part) { part.header.count = 0; }));
  EXPECT_TRUE(lies([](StepPart& part) { part.header.step = std::uint64_t{1} << 32; }));
  EXPECT_TRUE(lies([](StepPart& part) { part.header.reference_step = part.header.step + 1; }));
  EXPECT_TRUE(lies([](StepPart& part) { part.bytes = ~std::uint64_t{0} - 2; }));
}

Index any_index() {
  Index index;
  index.previous_index = 0;
  index.vertices = 5;
  index.cells = 6;
  index.hexahedra = 4;
  index.max_active_vertices = 3;
  index.steps = 2;
  index.block_cells = {4, 2};
  index.streams = {{"geometry", 100}, {"array:point/ü", 1}};
  index.ranges = {{1, {-1, 0}, {1, 2}}, {4, {}, {}}};
  IndexEntry group, steps, extra;
  group.kind = static_cast<std::uint8_t>(ChunkKind::group);
  group.offset = 16;
  group.bytes = 1000;
  group.first_cell = 1, group.cells = 2, group.first_vertex = 3, group.vertices = 4;
  group.box = {0, 1, 2, 3, 4, 5};
  steps.kind = static_cast<std::uint8_t>(ChunkKind::step_values);
  steps.offset = 1016;
  steps.bytes = 44;
  steps.parts.resize(1);
  StepEntry& values = steps.parts[0];
  values.array = 9, values.step = 10, values.first = 11, values.count = 12;
  extra.kind = static_cast<std::uint8_t>(ChunkKind::extra);
  extra.offset = std::uint64_t{1} << 40;
  extra.bytes = 1;
  index.entries = {group, steps, extra};
  return index;
}

TEST(Container, IndexOfVersion0) {
  Index index = any_index();
  index.version = 0;
  ByteWriter out;
  put(out, index);
  ByteReader in(out.bytes);
  Index back;
  ASSERT_TRUE(get(in, back, 0, 3));
  ByteWriter again;
  put(again, back);
  EXPECT_EQ(again.bytes, out.bytes);
  EXPECT_EQ(back.block_cells, index.block_cells);
  EXPECT_EQ(back.streams[1].name, "array:point/ü");
  EXPECT_EQ(back.ranges[0].maximum, index.ranges[0].maximum);
  EXPECT_EQ(back.ranges[1].array, 4u);
  EXPECT_EQ(back.entries[0].box, index.entries[0].box);
  EXPECT_EQ(back.entries[1].parts[0].step, 10u);
  EXPECT_EQ(back.entries[2].offset, std::uint64_t{1} << 40);
  ByteReader fewer(out.bytes);
  EXPECT_FALSE(get(fewer, back, 0, 2));
  for (std::size_t size = 0; size < out.bytes.size(); ++size) {
    ByteReader cut(std::span<const std::byte>(out.bytes).first(size));
    EXPECT_FALSE(get(cut, back, 0, 3)) << size;
  }
  out.put_u8(0);
  ByteReader longer(out.bytes);
  EXPECT_FALSE(get(longer, back, 0, 3));
}

// An index of version 1 omits the fields that can be computed from other fields: offsets, and the
// first element of a group or of step values. It stores all other fields.
TEST(Container, PackedIndex) {
  Index index = any_index();
  IndexEntry more = index.entries[1];
  more.parts[0].group = 1;
  more.parts[0].count = 3;
  more.parts.push_back({9, 11, 0, 12, 1, 1, 0, StepReference::trend, Codec::shuffled_zstd});
  index.entries.insert(index.entries.begin() + 2, more);
  index.entries.back().bytes = kShortHeaderBytes;  // the smallest chunk
  ByteWriter out;
  put(out, index);
  ByteReader in(out.bytes);
  Index back;
  ASSERT_TRUE(get(in, back, 1, 4));
  ByteWriter again;
  put(again, back);
  EXPECT_EQ(again.bytes, out.bytes);
  EXPECT_EQ(back.block_cells, index.block_cells);
  EXPECT_TRUE(back.streams.empty());
  EXPECT_TRUE(back.ranges.empty());
  EXPECT_EQ(back.entries[0].box, index.entries[0].box);
  EXPECT_EQ(back.entries[0].vertices, 4u);
  ASSERT_EQ(back.entries[1].parts.size(), 1u);
  EXPECT_EQ(back.entries[1].parts[0].step, 10u);
  EXPECT_EQ(back.entries[1].offset, 1016u);
  EXPECT_EQ(back.entries[1].parts[0].first, 0u);
  ASSERT_EQ(back.entries[2].parts.size(), 2u);
  EXPECT_EQ(back.entries[2].parts[0].first, 12u);
  EXPECT_EQ(back.entries[2].parts[0].group, 1u);
  EXPECT_EQ(back.entries[2].parts[1].step, 11u);
  EXPECT_EQ(back.entries[2].parts[1].first, 0u);
  EXPECT_EQ(back.entries[2].parts[1].group, 0u);
  EXPECT_EQ(back.entries[2].parts[1].reference, StepReference::trend);
  EXPECT_EQ(back.entries[2].parts[1].codec, Codec::shuffled_zstd);
  EXPECT_EQ(back.entries[3].offset, 1016u + 44 + 44);
  ByteReader fewer(out.bytes);
  EXPECT_FALSE(get(fewer, back, 1, 3));
  for (std::size_t size = 0; size < out.bytes.size(); ++size) {
    ByteReader cut(std::span<const std::byte>(out.bytes).first(size));
    EXPECT_FALSE(get(cut, back, 1, 4)) << size;
  }
  out.put_u8(0);
  ByteReader longer(out.bytes);
  EXPECT_FALSE(get(longer, back, 1, 4));
}

TEST(Container, Trailer) {
  ByteWriter out;
  put_trailer(out, 0x0102030405060708);
  ASSERT_EQ(out.bytes.size(), kTrailerBytes);
  EXPECT_EQ(out.bytes[12], std::byte{'S'});
  std::uint64_t offset = 0;
  ByteReader in(out.bytes);
  EXPECT_TRUE(get_trailer(in, offset));
  EXPECT_EQ(offset, 0x0102030405060708u);
  for (std::size_t i = 0; i < kTrailerBytes; ++i) {
    auto wrong = out.bytes;
    wrong[i] ^= std::byte{0x80};
    ByteReader again(wrong);
    EXPECT_FALSE(get_trailer(again, offset)) << i;
  }
}

TEST(Container, NamesOfEverything) {
  EXPECT_EQ(chunk_name(1), "schema");
  EXPECT_EQ(chunk_name(6), "index");
  EXPECT_EQ(chunk_name(200), "chunk of kind 200");
  EXPECT_EQ(stream_name(StreamKind::corner_order), "corner order");
  EXPECT_EQ(stream_name(static_cast<StreamKind>(0)), "unknown stream");
}

TEST(ChunkWriter, NumbersChecksumsAndRemembers) {
  MemorySink sink;
  ChunkWriter writer(sink);
  const auto payload = bytes_of({1, 2, 3});
  ASSERT_TRUE(writer.start({}));
  ASSERT_TRUE(writer.write(ChunkKind::schema, payload));
  ASSERT_TRUE(writer.write(ChunkKind::extra, {}));
  EXPECT_EQ(writer.offset(), 16u + 22 + 3 + 22);
  ASSERT_TRUE(writer.finish({}));
  EXPECT_EQ(writer.offset(), sink.bytes.size());
  const FileParts parts = take_apart(sink.bytes);
  ASSERT_EQ(parts.chunks.size(), 3u);
  for (std::uint32_t i = 0; i < 3; ++i) {
    const Chunk& chunk = parts.chunks[i];
    EXPECT_EQ(chunk.header.sequence, i);
    std::vector<std::byte> whole_payload = chunk.payload;
    if (chunk.has_trailer()) {
      ByteWriter trailer;
      put_trailer(trailer, parts.last_offset());
      whole_payload.insert(whole_payload.end(), trailer.bytes.begin(), trailer.bytes.end());
    }
    EXPECT_EQ(chunk.header.payload_bytes, whole_payload.size());
    EXPECT_EQ(chunk.header.payload_checksum, checksum(whole_payload));
  }
  EXPECT_EQ(parts.chunks[0].payload, payload);
  ByteReader in(parts.chunks[2].payload);
  Index index;
  ASSERT_TRUE(get(in, index, parts.chunks[2].header.version, 2));
  ASSERT_EQ(index.entries.size(), 2u);
  EXPECT_EQ(index.entries[0].offset, 16u);
  EXPECT_EQ(index.entries[0].bytes, 25u);
  EXPECT_EQ(index.entries[1].offset, 41u);
  EXPECT_EQ(put_together(parts), sink.bytes);
}

struct FailingSink final : ByteSink {
  Result<void> write(std::span<const std::byte>) override {
    return Error{ErrorCode::output, "full", {}, kNoOffset, {}};
  }
};

TEST(ChunkWriter, PassesOnTheErrorOfTheSink) {
  FailingSink sink;
  ChunkWriter writer(sink);
  EXPECT_EQ(writer.start({}).error().code, ErrorCode::output);
  EXPECT_EQ(writer.write(ChunkKind::extra, {}).error().code, ErrorCode::output);
  EXPECT_EQ(writer.finish({}).error().code, ErrorCode::output);
}

}  // namespace
}  // namespace shm::container
