// IdMap: from 64-bit numbers to 32-bit slots. Open addressing with linear probing; erasing shifts
// the rest of the run back, so there are no tombstones and memory follows what is alive.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bytes/none.h"
#include "bytes/scatter.h"

namespace shm {

class IdMap {
 public:
  /// The slot of `id`, kNone when absent.
  std::uint32_t find(std::uint64_t id) const {
    if (entries_.empty()) return kNone;
    for (std::size_t i = home(id);; i = (i + 1) & mask()) {
      if (entries_[i].slot == kNone) return kNone;
      if (entries_[i].id == id) return entries_[i].slot;
    }
  }
  /// Must hold: `id` is absent, slot is not kNone.
  void insert(std::uint64_t id, std::uint32_t slot) {
    if ((count_ + 1) * 2 > entries_.size()) grow();
    place({id, slot});
    ++count_;
  }
  /// Must hold: `id` is present.
  void erase(std::uint64_t id) {
    std::size_t hole = home(id);
    while (entries_[hole].id != id || entries_[hole].slot == kNone) hole = (hole + 1) & mask();
    for (std::size_t i = (hole + 1) & mask(); entries_[i].slot != kNone; i = (i + 1) & mask()) {
      // An entry may fill the hole unless its home lies between the hole and itself.
      if (((i - home(entries_[i].id)) & mask()) < ((i - hole) & mask())) continue;
      entries_[hole] = entries_[i];
      hole = i;
    }
    entries_[hole].slot = kNone;
    --count_;
  }
  std::size_t size() const { return count_; }

 private:
  struct Entry {
    std::uint64_t id = 0;
    std::uint32_t slot = kNone;
  };
  std::size_t mask() const { return entries_.size() - 1; }
  std::size_t home(std::uint64_t id) const {
    return static_cast<std::size_t>(scatter_(id)) & mask();
  }
  void place(const Entry& entry) {
    std::size_t i = home(entry.id);
    while (entries_[i].slot != kNone) i = (i + 1) & mask();
    entries_[i] = entry;
  }
  void grow() {
    std::vector<Entry> old(entries_.empty() ? 64 : entries_.size() * 2);
    old.swap(entries_);
    for (const Entry& entry : old)
      if (entry.slot != kNone) place(entry);
  }

  std::vector<Entry> entries_;
  Scatter scatter_;
  std::size_t count_ = 0;
};

}  // namespace shm
