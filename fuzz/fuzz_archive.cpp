// Reads archives with valid checksums whose member list is wrong: names that lead out of the output
// folder, sizes larger than the file, damaged members. Checks that the names and offsets that
// ArchiveReader returns are valid. Each member must be readable or refused with an error.
// ArchiveWriter must not accept a member name that a reader refuses.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "damaged_file.h"
#include "shm/archive.h"
#include "shm/summary.h"

namespace {

using shm_fuzz::Bytes, shm_fuzz::Random;

void expect(bool good) {
  if (!good) std::abort();
}

/// Returns true if a member name does not lead out of the output folder. Does not use the function
/// of the library that checks this.
bool leads_nowhere_else(const std::string& name) {
  return !name.empty() && name.size() <= 255 && name != "." && name != ".." &&
         name.find_first_of(std::string("/\\\0\n\r", 5)) == name.npos;
}

void read_all(shm::SectionSource& member) {
  shm::ReadLimits limits = shm_fuzz::small_limits();
  (void)shm::read_summary(member, limits);
  auto reader = shm::Reader::open(member, limits);
  if (!reader) return;
  while (true) {
    const auto item = reader->next();
    if (!item || *item == nullptr) return;
  }
}

/// Returns a damaged archive. Either one member is damaged, and the member list is updated to its
/// new size; or a field of the archive itself (e.g. of the member list) is damaged.
Bytes mutated(std::span<const std::byte> file, Random& random, std::size_t room) {
  auto parts = shm::take_apart(file);
  shm::Chunk* const chunk = parts.find(shm::container::ChunkKind::members);
  if (chunk == nullptr) return {};
  shm::ByteReader in(chunk->payload);
  shm::container::MemberList list;
  if (random() % 2 == 0 && shm::container::get(in, list) && !list.members.empty()) {
    const std::size_t at = random() % list.members.size();
    shm::ByteReader before(parts.members);
    shm::ByteWriter members, payload;
    for (std::size_t m = 0; m < list.members.size(); ++m) {
      const auto bytes = before.get_bytes(list.members[m].bytes);
      const Bytes other = m == at ? shm_fuzz::mutated_file(bytes, random, room) : Bytes();
      members.put_bytes(other.empty() ? bytes : other);
      list.members[m].bytes = other.empty() ? bytes.size() : other.size();
    }
    shm::container::put(payload, list);
    parts.members = std::move(members.bytes);
    chunk->payload = std::move(payload.bytes);
  } else {
    const std::size_t chunks = parts.chunks.size();
    shm_fuzz::mutate_field(parts, random() % 4 == 0 ? chunks : random() % chunks, random);
  }
  return shm::put_together(std::move(parts), shm::Numbering::as_they_are);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto all = std::as_bytes(std::span(data, size)).subspan(1);
  const Bytes file(all.begin(), all.end());
  shm::MemoryRandomSource source(file);
  (void)shm::looks_like_archive(file);
  const auto archive = shm::ArchiveReader::open(source, shm_fuzz::small_limits());
  if (archive) {
    std::set<std::string> names;
    for (const shm::ArchiveMember& member : archive->members()) {
      expect(leads_nowhere_else(member.name) && names.insert(member.name).second);
      expect(member.offset <= file.size() && member.bytes <= file.size() - member.offset);
      expect(archive->find(member.name) == &member);
      shm::SectionSource section(source, member.offset, member.bytes);
      read_all(section);
    }
  }
  // Uses the bytes of the input as a member name, and passes this name to ArchiveWriter.
  shm::NullSink sink;
  auto writer = shm::ArchiveWriter::create(sink);
  const std::string name(reinterpret_cast<const char*>(data), std::min<std::size_t>(size, 300));
  const auto member = writer->add_member(name);
  expect(!member || leads_nowhere_else(name));
  if (member) (void)(*member)->write(file);
  (void)writer->add_member("second");
  (void)writer->finish();
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  Random random(seed);
  if (size < 2 || random() % 16 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const Bytes file = mutated(std::as_bytes(std::span(data + 1, size - 1)), random,
                             max_size > size ? max_size - size : 0);
  if (file.empty() || file.size() + 1 > max_size) return LLVMFuzzerMutate(data, size, max_size);
  std::memcpy(data + 1, file.data(), file.size());
  return file.size() + 1;
}
