// An archive whose list of members lies, behind right checksums: names that lead elsewhere, sizes
// that do not fit, members that are damaged. What ArchiveReader says must be what is promised of
// names and places, and each member can be read or is refused. What ArchiveWriter is given to name
// a member it takes only where a reader would.
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

/// By hand: what a name may never be, whatever the library says.
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

/// What follows the list of members, after the members themselves.
struct List {
  std::size_t begin = 0;  // of its chunk
  shm::container::MemberList list;
};
bool find_list(std::span<const std::byte> file, List& out) {
  if (file.size() < shm::container::kTrailerBytes) return false;
  shm::ByteReader end(file.last(shm::container::kTrailerBytes));
  std::uint64_t begin = 0;
  if (!shm::container::get_trailer(end, begin) || begin >= file.size()) return false;
  shm::ByteReader in(file.subspan(static_cast<std::size_t>(begin)));
  shm::container::ChunkHeader header;
  if (in.left() < shm::container::kLongHeaderBytes + shm::container::kTrailerBytes) return false;
  if (shm::container::get(in, header) != shm::container::HeaderState::good) return false;
  shm::ByteReader payload(in.get_bytes(in.left() - shm::container::kTrailerBytes));
  out.begin = static_cast<std::size_t>(begin);
  return shm::container::get(payload, out.list);
}

/// Members stay; the list says something else of them, or has a member that is not there.
void mutate_list(shm::container::MemberList& list, Random& random) {
  static const std::string kNames[] = {"../../x",
                                       "/etc/passwd",
                                       "..",
                                       ".",
                                       "",
                                       "a/b",
                                       "a\\b",
                                       "con\0x",
                                       "x",
                                       "a\nb",
                                       "~",
                                       "$HOME",
                                       "-rf",
                                       "*",
                                       std::string(256, 'x'),
                                       std::string("a\0b", 3)};
  auto& members = list.members;
  if (members.empty() || random() % 8 == 0) members.push_back({"new", random() % 100});
  auto& member = members[random() % members.size()];
  switch (random() % 8) {
    case 0: shm_fuzz::disturb(member.bytes, random); break;
    case 1: std::swap(member, members[random() % members.size()]); break;
    case 2: member.name = members[random() % members.size()].name; break;
    case 3: members.erase(members.begin()); break;
    case 4: shm_fuzz::disturb(list.start.minor, random); break;
    case 5: list.start.needed_features ^= 1u << random() % 5; break;
    default: member.name = kNames[random() % std::size(kNames)];
  }
}

Bytes mutated(std::span<const std::byte> file, Random& random, std::size_t room) {
  List it;
  if (!find_list(file, it)) return {};
  Bytes out;
  if (random() % 2 == 0) {  // a member is damaged
    auto& members = it.list.members;
    const std::size_t at = members.empty() ? 0 : random() % members.size();
    out.assign(file.begin(), file.begin() + shm::container::kFileStartBytes);
    std::size_t begin = out.size();
    for (std::size_t m = 0; m < members.size(); ++m) {
      if (members[m].bytes > it.begin - begin) return {};
      const auto bytes = file.subspan(begin, static_cast<std::size_t>(members[m].bytes));
      begin += bytes.size();
      Bytes damaged = m == at ? shm_fuzz::mutated_file(bytes, random, room) : Bytes();
      if (damaged.empty()) damaged.assign(bytes.begin(), bytes.end());
      members[m].bytes = damaged.size();
      out.insert(out.end(), damaged.begin(), damaged.end());
    }
  } else {
    out.assign(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(it.begin));
    mutate_list(it.list, random);
  }
  const std::size_t begin = out.size();
  shm::ByteWriter list, end;
  shm::container::put(list, it.list);
  shm::container::ChunkHeader header;
  header.kind = static_cast<std::uint8_t>(shm::container::ChunkKind::members);
  header.payload_bytes = list.bytes.size();
  header.payload_checksum = shm::checksum(list.bytes);
  shm::container::put(end, header);
  end.put_bytes(list.bytes);
  shm::container::put_trailer(end, begin);
  out.insert(out.end(), end.bytes.begin(), end.bytes.end());
  return out;
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
  // What stands there, as a name.
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
