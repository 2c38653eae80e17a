#include "pipeline/stream_numbers.h"

#include "base/binary.h"
#include "codecs/shared/codec_id.h"
#include "codecs/shared/digest.h"

namespace shm {

std::uint32_t StreamNumbers::new_ticket() {
  if (free_.empty()) {
    free_.push_back(static_cast<std::uint32_t>(numbers_.size()));
    numbers_.push_back(0);
  }
  const std::uint32_t ticket = free_.back();
  free_.pop_back();
  return ticket;
}

void StreamNumbers::set_imported(std::span<const std::uint64_t> numbers) {
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers_[imported_[i]] = numbers[i];
}

void StreamNumbers::complete(EncodedGroup& group) {
  store_own(group);
  for (const EncodedGroup::LateNode& node : group.late_nodes)
    group.header.digest += digest_of_word(node.key, numbers_[node.ticket]);
  const std::vector<std::byte> bytes = code_imports(group);
  if (bytes.empty()) return;
  container::GroupHeader& header = group.header;
  container::StreamEntry entry;
  entry.kind = container::StreamKind::vertex_numbers;
  entry.codec = container::Codec::predictive;
  entry.bytes = bytes.size();
  entry.checksum = checksum(bytes);
  std::size_t index = 0;
  while (index < header.streams.size() && header.streams[index].kind < entry.kind) ++index;
  const auto place = static_cast<std::ptrdiff_t>(index);
  header.streams.insert(header.streams.begin() + place, entry);
  group.streams.insert(group.streams.begin() + place, bytes);
}

void StreamNumbers::store_own(const EncodedGroup& group) {
  for (std::size_t i = 0; i < group.own.size(); ++i)
    if (group.own[i].ticket != kNone) numbers_[group.own[i].ticket] = group.header.first_vertex + i;
}

/// Codes the numbers of the vertices that the group imports; earlier groups own these vertices.
/// Then frees the tickets of vertices whose last use is in the group.
std::vector<std::byte> StreamNumbers::code_imports(const EncodedGroup& group) {
  for (const EncodedGroup::Import& import : group.imports)
    column_.code(coder_, import.stencil, import.slot, numbers_[import.ticket]);
  const std::uint64_t cells_done = group.header.first_cell + group.header.cells;
  for (; !ending_.empty() && ending_.front().first < cells_done; ending_.pop_front())
    free_.push_back(ending_.front().second);
  return coder_.finish();
}

}  // namespace shm
