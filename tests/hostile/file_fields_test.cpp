// Tests wrong values in every field of a file, with correct checksums. FieldWalk (file_fields.h),
// which the mutators of the fuzz targets also use, finds the fields of every section. The fields
// found must cover every byte of the file. After any change, the checksums must still be correct,
// so no reader may report a wrong checksum.
#include "support/file_fields.h"

#include <gtest/gtest.h>

#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>

#include "hostile/hostile.h"
#include "shm/archive.h"
#include "shm/mesh_extract.h"
#include "support/golden_files.h"
#include "support/sanitized.h"

namespace shm {
namespace {

FeatureFile golden_file(const std::filesystem::path& path) {
  const std::string bytes = content(path);
  const auto all = std::as_bytes(std::span(bytes));
  return {path.string(), {all.begin(), all.end()}};
}

std::vector<FeatureFile> files_of_all_versions() {
  std::vector<FeatureFile> all = files();
  for (const auto& path : golden_files()) all.push_back(golden_file(path));
  return all;
}

bool is_packed(const Chunk& chunk) {
  return chunk.is(ChunkKind::schema) || chunk.is(ChunkKind::step_times) ||
         chunk.is(ChunkKind::extra) || (chunk.is(ChunkKind::index) && chunk.header.version > 0);
}

std::size_t bytes_of_all(const std::vector<Bytes>& streams) {
  std::size_t sum = 0;
  for (const Bytes& stream : streams) sum += stream.size();
  return sum;
}
/// Returns the number of bytes of coded data that follow the header fields in the payload of a
/// chunk. Only groups and step values have such data.
std::size_t coded_bytes(const Chunk& chunk) {
  constexpr std::size_t kChecksum = 4;
  if (chunk.is(ChunkKind::group)) return kChecksum + bytes_of_all(take_group_apart(chunk)->streams);
  if (chunk.is(ChunkKind::step_values)) return bytes_of_all(take_steps_apart(chunk)->values);
  return 0;
}

void expect_no_gaps(const Section& section, const std::string& name) {
  std::size_t end = 0;
  for (const Field& field : section.fields) {
    EXPECT_EQ(field.begin, end) << name << ", " << field.name;
    EXPECT_TRUE(field.end > field.begin) << name << ", " << field.name;
    end = field.end;
  }
  EXPECT_EQ(end, section.bytes.size()) << name;
}

TEST(FileFields, LeaveNoByteOut) {
  for (const FeatureFile& file : files_of_all_versions()) {
    const FileParts parts = take_apart(file.bytes);
    for (std::size_t c = 0; c <= parts.chunks.size(); ++c) {
      const auto sections = sections_of(parts, c);
      for (const Section& section : sections) expect_no_gaps(section, file.name);
      const bool is_chunk = c < parts.chunks.size();
      ASSERT_EQ(sections.size(), is_chunk && is_packed(parts.chunks[c]) ? 3u : 2u) << file.name;
      EXPECT_EQ(sections.back().bytes_behind, 0u) << file.name;
      if (is_chunk && !parts.chunks[c].is(ChunkKind::extra)) {
        EXPECT_EQ(sections[sections.size() - 2].bytes_behind, coded_bytes(parts.chunks[c]))
            << file.name << ", chunk " << c;
      }
    }
  }
}

// Replacing a field with its current value must not change the contents of the file. Only the
// compressed form of packed data may change.
TEST(FileFields, PutBackAreTheSame) {
  for (const FeatureFile& file : files()) {
    const std::string text = text_of(decode_in_pieces(file.bytes));
    FileParts parts = take_apart(file.bytes);
    for (std::size_t c = 0; c <= parts.chunks.size(); ++c)
      for (const Section& section : sections_of(parts, c)) {
        section.put(parts, section.bytes);
        for (const Field& field : section.fields) {
          if (field.type == FieldType::text || field.type == FieldType::checksum) continue;
          ByteWriter again;
          put_number(again, field.type, section.number(field));
          EXPECT_TRUE(std::ranges::equal(again.bytes, section.bytes_of(field)))
              << file.name << ", " << field.name;
        }
      }
    list_anew(parts);
    EXPECT_EQ(text_of(decode_in_pieces(put_together(parts))), text) << file.name;
  }
}

/// Reads all data of a file, first front to back and then using the index. Returns all error
/// messages.
std::vector<std::string> read_all(const Bytes& bytes) {
  ReadLimits limits;
  limits.max_active_vertices = limits.max_chunk_bytes = limits.max_group_bytes = 1 << 22;
  std::vector<std::string> said;
  const auto hear = [&](const auto& result) {
    if (!result) said.push_back(result.error().message());
    return static_cast<bool>(result);
  };
  hear(decode_in_pieces(bytes, 0, limits));
  MemoryRandomSource source(bytes);
  hear(read_summary(source, limits));
  if (auto mesh = MeshExtractor::open(source, limits); hear(mesh) && hear(mesh->begin({})))
    for (auto part = mesh->next(); hear(part) && *part != nullptr;) part = mesh->next();
  if (!looks_like_archive(bytes)) return said;
  if (const auto archive = ArchiveReader::open(source, limits); hear(archive))
    for (const ArchiveMember& member : archive->members()) {
      SectionSource section(source, member.offset, member.bytes);
      hear(read_summary(section, limits));
    }
  return said;
}

/// Returns files that together contain every kind of field. The golden file of format version 0.9
/// covers version 0 of the chunks, the other files cover version 1.
std::vector<FeatureFile> some_files() {
  std::vector<FeatureFile> some;
  for (const char* name :
       {"steps_and_extras", "arrays_on_some_blocks", "quantized", "bounded", "shifts"})
    some.push_back({name, file(name)});
  some.push_back(golden_file(golden_folder() / "0.9/steps_and_extras.shm"));
  some.push_back(archive_file());
  return some;
}

TEST(FileFields, LieBehindRightChecksums) {
  std::set<std::tuple<std::uint8_t, std::uint8_t, std::string_view>> met;  // chunk, version, field
  std::uint64_t way = 0;
  for (const FeatureFile& file : some_files()) {
    const FileParts whole = take_apart(file.bytes);
    for (std::size_t c = 0; c <= whole.chunks.size(); ++c)
      for (const Section& section : sections_of(whole, c))
        for (const Field& field : section.fields) {
          const bool is_chunk = c < whole.chunks.size();
          const auto [kind, version] =
              is_chunk ? std::pair(whole.chunks[c].header.kind, whole.chunks[c].header.version)
                       : std::pair<std::uint8_t, std::uint8_t>();
          // Replaces the first field of each kind with many values in turn, and each further field
          // of that kind with a single value.
          const bool is_new = met.insert({kind, version, field.name}).second;
          for (std::uint64_t n = is_new ? 64 / every(8) : 1; n > 0; --n) {
            const Bytes other = changed(section, field, way++);
            if (other == section.bytes) continue;
            FileParts parts = whole;
            section.put(parts, other);
            if (c + 1 < parts.chunks.size()) list_anew(parts);
            for (const std::string& sentence :
                 read_all(put_together(parts, Numbering::as_they_are)))
              ASSERT_EQ(sentence.find("checksum"), sentence.npos)
                  << file.name << ", chunk " << c << ", " << field.name << ": " << sentence;
          }
        }
  }
}

}  // namespace
}  // namespace shm
