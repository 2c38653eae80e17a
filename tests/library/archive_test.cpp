// Tests of archives: each member is read back under its name, and no other file is mistaken for an
// archive.
#include "shm/archive.h"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "format/chunk_writer.h"
#include "format/format.h"
#include "support/feature_files.h"
#include "support/item_text.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

const Bytes& mesh() {
  static const Bytes bytes = [] {
    for (const FeatureFile& feature : feature_files())
      if (feature.name == "one_hexahedron") return feature.bytes;
    return Bytes();
  }();
  return bytes;
}

Result<ArchiveReader> read(const Bytes& bytes) {
  MemoryRandomSource source(bytes);
  return ArchiveReader::open(source);
}

ErrorCode code_of(const Result<ByteSink*>& result) {
  return result ? ErrorCode::io : result.error().code;
}

// Returns an archive whose list of members is supplied by the test.
Bytes with_list(const std::vector<container::Member>& members, std::size_t meshes) {
  MemorySink sink;
  container::MemberList list{{}, members};
  list.start.needed_features = container::kArchiveFeature;
  ByteWriter start, payload, trailer;
  container::put(start, list.start);
  container::put(payload, list);
  EXPECT_TRUE(sink.write(start.bytes));
  for (std::size_t i = 0; i < meshes; ++i) EXPECT_TRUE(sink.write(mesh()));
  container::put_trailer(trailer, sink.bytes.size());
  container::ChunkWriter chunks(sink);
  EXPECT_TRUE(chunks.write(container::ChunkKind::members, payload.bytes));
  EXPECT_TRUE(sink.write(trailer.bytes));
  return std::move(sink.bytes);
}

TEST(Archive, MembersComeBackAsTheyWere) {
  MemorySink sink;
  ArchiveWriter writer = ArchiveWriter::create(sink).value();
  const std::vector<FeatureFile> files = feature_files();
  for (const FeatureFile& file : files) {
    ByteSink* member = writer.add_member(file.name).value();
    const auto half = std::span(file.bytes).first(file.bytes.size() / 2);
    ASSERT_TRUE(member->write(half));
    ASSERT_TRUE(member->write(std::span(file.bytes).subspan(half.size())));
  }
  const std::uint64_t size = writer.finish().value();
  EXPECT_EQ(size, sink.bytes.size());

  MemoryRandomSource source(sink.bytes);
  const ArchiveReader archive = ArchiveReader::open(source).value();
  ASSERT_EQ(archive.members().size(), files.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const ArchiveMember& member = archive.members()[i];
    EXPECT_EQ(member.name, files[i].name);
    EXPECT_EQ(archive.find(files[i].name), &member);
    SectionSource section(source, member.offset, member.bytes);
    Bytes bytes(member.bytes + 1);
    EXPECT_EQ(section.read(bytes).value(), member.bytes);
    EXPECT_EQ(section.read(bytes).value(), 0u);
    bytes.pop_back();
    EXPECT_EQ(bytes, files[i].bytes);
  }
  EXPECT_EQ(archive.find("nobody"), nullptr);
}

TEST(Archive, MayBeEmpty) {
  MemorySink sink;
  ASSERT_TRUE(ArchiveWriter::create(sink).value().finish());
  EXPECT_TRUE(looks_like_archive(sink.bytes));
  EXPECT_TRUE(read(sink.bytes).value().members().empty());
}

TEST(Archive, SectionEndsWhereItSays) {
  const Bytes bytes(10, std::byte{7});
  MemoryRandomSource source(bytes);
  SectionSource section(source, 4, 5);
  EXPECT_EQ(section.size(), 5u);
  Bytes out(2);
  EXPECT_TRUE(section.read_at(3, out));
  EXPECT_FALSE(section.read_at(4, out));
  EXPECT_FALSE(section.read_at(~std::uint64_t{0}, out));
  SectionSource beyond(source, 8, 5);
  EXPECT_EQ(beyond.read(out).value(), 2u);
  EXPECT_FALSE(beyond.read(out));
}

TEST(Archive, NamesAreOfFiles) {
  for (const char* name : {"a", "rotor.e.4.0", "run.e-s002", "with space.vtk", "..."})
    EXPECT_TRUE(is_member_name(name)) << name;
  for (const char* bad : {"", ".", "..", "a/b", "/", "../a", "a\\b", "a\nb", "\x7f"})
    EXPECT_FALSE(is_member_name(bad)) << bad;
  EXPECT_TRUE(is_member_name(std::string(255, 'x')));
  EXPECT_FALSE(is_member_name(std::string(256, 'x')));
  EXPECT_FALSE(is_member_name(std::string("a\0b", 3)));
}

TEST(Archive, WriterSaysWhatIsWrong) {
  const auto fresh = [](MemorySink& sink) { return ArchiveWriter::create(sink).value(); };
  MemorySink sink;
  ArchiveWriter names = fresh(sink);
  EXPECT_EQ(code_of(names.add_member("a/b")), ErrorCode::misuse);
  EXPECT_EQ(code_of(names.add_member("a")), ErrorCode::misuse) << "the first error sticks";

  ArchiveWriter twice = fresh(sink);
  EXPECT_TRUE(twice.add_member("a").value()->write(mesh()));
  EXPECT_EQ(code_of(twice.add_member("a")), ErrorCode::misuse);

  ArchiveWriter nothing = fresh(sink);
  EXPECT_TRUE(nothing.add_member("a"));
  EXPECT_FALSE(nothing.finish());

  ArchiveWriter nested = fresh(sink);
  EXPECT_TRUE(nested.add_member("a").value()->write(archive_file().bytes));
  EXPECT_FALSE(nested.finish());

  ArchiveWriter late = fresh(sink);
  ByteSink* member = late.add_member("a").value();
  EXPECT_TRUE(member->write(mesh()));
  EXPECT_TRUE(late.finish());
  EXPECT_FALSE(member->write(mesh()));
  EXPECT_FALSE(late.finish());
}

TEST(Archive, ErrorsOfTheSinkStick) {
  class FullSink final : public ByteSink {
   public:
    Result<void> write(std::span<const std::byte> bytes) override {
      if (bytes.size() > 100) return Error{ErrorCode::output, "full", {}, kNoOffset, {}};
      return {};
    }
  };
  FullSink sink;
  ArchiveWriter archive = ArchiveWriter::create(sink).value();
  ByteSink* member = archive.add_member("a").value();
  EXPECT_TRUE(member->write(std::span(mesh()).first(50)));
  EXPECT_FALSE(member->write(std::span(mesh()).subspan(50)));
  EXPECT_FALSE(member->write(std::span(mesh()).first(50)));
  EXPECT_FALSE(archive.finish());
}

TEST(Archive, IsNoMesh) {
  const auto decoded = decode_in_pieces(archive_file().bytes);
  ASSERT_FALSE(decoded);
  EXPECT_EQ(decoded.error().code, ErrorCode::unsupported);
  EXPECT_NE(decoded.error().message().find("archive"), std::string::npos);
  EXPECT_FALSE(looks_like_archive(mesh()));
  EXPECT_FALSE(read(mesh()));
}

TEST(Archive, EveryTruncationIsNoticed) {
  const Bytes whole = archive_file().bytes;
  for (std::size_t size = 0; size < whole.size(); ++size)
    ASSERT_FALSE(read({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)})) << size;
}

TEST(Archive, EveryFlippedBitOfTheFrameIsNoticed) {
  const Bytes whole = archive_file().bytes;
  const ArchiveReader archive = read(whole).value();
  const std::size_t members_end = archive.members().back().offset + archive.members().back().bytes;
  for (std::size_t at = 0; at < whole.size(); at = at == 15 ? members_end : at + 1)
    for (int bit = 0; bit < 8; ++bit) {
      Bytes bent = whole;
      bent[at] ^= static_cast<std::byte>(1 << bit);
      ASSERT_FALSE(read(bent)) << at;
    }
}

TEST(Archive, LyingListsAreRefused) {
  const std::uint64_t size = mesh().size();
  ASSERT_TRUE(read(with_list({{"a", size}, {"b", size}}, 2)));
  const std::vector<std::vector<container::Member>> lies = {
      {{"a", size}},
      {{"a", size}, {"b", size + 1}},
      {{"a", size}, {"b", size - 1}},
      {{"a", size}, {"b", size}, {"c", 1}},
      {{"a", ~std::uint64_t{0}}, {"b", 2 * size + 1}},
      {{"a", size}, {"a", size}},
      {{"a", size}, {"../b", size}},
      {{"", size}, {"b", size}},
  };
  for (const auto& lie : lies) {
    const auto archive = read(with_list(lie, 2));
    ASSERT_FALSE(archive);
    EXPECT_EQ(archive.error().code, ErrorCode::corrupt);
  }
}

}  // namespace
}  // namespace shm
