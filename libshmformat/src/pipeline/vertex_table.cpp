#include "pipeline/vertex_table.h"

#include "format/schema.h"

namespace shm {

VertexTable::VertexTable(const Schema& schema)
    : xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)),
      value_bytes_(xyz_bytes_ + point_data_bytes(schema)) {}

std::uint32_t VertexTable::add(std::uint64_t number, const std::byte* xyz, const std::byte* data) {
  const std::uint32_t e = next_entry();
  if (!by_number_.insert(number, e)) return kNone;
  if (free_.empty()) {
    push_tightly(entries_, Entry());
    push_tightly(in_segment_, kNone);
    expect_more(values_, value_bytes_);
    values_.resize(values_.size() + value_bytes_);
  } else {
    free_.pop_back();
  }
  entries_[e] = Entry{};
  in_segment_[e] = kNone;
  entries_[e].number = number;
  std::byte* values = values_.data() + e * value_bytes_;
  copy_few(values, xyz, xyz_bytes_);
  copy_few(values + xyz_bytes_, data, value_bytes_ - xyz_bytes_);
  return e;
}

std::uint64_t VertexTable::end(std::span<const std::uint32_t> entries, std::uint64_t last_use) {
  std::uint64_t ended = 0;
  for (; last_use != 0; last_use &= last_use - 1)
    ended += end(entries[static_cast<std::size_t>(std::countr_zero(last_use))]) ? 1 : 0;
  return ended;
}

bool VertexTable::end(std::uint32_t e) {
  Entry& entry = entries_[e];
  if (entry.ends) return false;
  entry.ends = true;
  // From now on, the caller may use the number for another vertex, even if cells that use this
  // vertex are still in the delay buffer.
  by_number_.erase(entry.number);
  return true;
}

void VertexTable::free_unused(std::uint32_t e) {
  by_number_.erase(entries_[e].number);
  push_tightly(free_, e);
}

std::vector<std::uint32_t> VertexTable::unused() const {
  std::vector<std::uint32_t> unused;
  for (std::uint32_t e = 0; e < entries_.size(); ++e)
    if (!entries_[e].used && by_number_.find(entries_[e].number) == e) unused.push_back(e);
  std::sort(unused.begin(), unused.end(), [&](std::uint32_t a, std::uint32_t b) {
    return entries_[a].number < entries_[b].number;
  });
  return unused;
}

}  // namespace shm
