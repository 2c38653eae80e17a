// Maps from arbitrary 64-bit numbers, which come from files, to 32-bit slots.
// - Scatter: computes the position of a number in a hash table.
// - IdMap: a map for unrelated numbers.
// - NumberMap: a map for numbers that are often consecutive and are removed after a while.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/lists.h"

namespace shm {

/// Hash function that computes the position of a number in a table. Numbers come from files, and
/// the author of a file could choose numbers that all have the same position. The positions
/// therefore also depend on the address of the table in memory, which the author cannot know. Coded
/// data never depends on the positions.
class Scatter {
 public:
  Scatter()
      : seed_(static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(this)) * kFirstFactor) {}

  /// Returns a 32-bit hash value whose bits are well mixed, so that the caller may use only its
  /// lowest bits.
  std::uint64_t operator()(std::uint64_t number) const {
    std::uint64_t x = (number ^ seed_) * kFirstFactor;
    x = (x ^ x >> 32) * kSecondFactor;
    return x >> 32;
  }

 private:
  static constexpr std::uint64_t kFirstFactor = 0x9e3779b97f4a7c15u,
                                 kSecondFactor = 0xd6e8feb86659fd93u;
  std::uint64_t seed_;
};

/// Hash map with open addressing and linear probing. When erase() removes an entry, it moves the
/// following entries back into the hole. There are thus no tombstones, and the size of the table
/// depends only on the number of entries.
class IdMap {
 public:
  /// Returns the slot of `id`, or kNone if `id` is absent.
  std::uint32_t find(std::uint64_t id) const {
    if (entries_.empty()) return kNone;
    for (std::size_t i = home(id);; i = (i + 1) & mask()) {
      if (entries_[i].slot == kNone) return kNone;
      if (entries_[i].id == id) return entries_[i].slot;
    }
  }
  /// Inserts `id`. Precondition: `id` is absent, `slot` is not kNone.
  void insert(std::uint64_t id, std::uint32_t slot) {
    if ((count_ + 1) * 2 > entries_.size()) grow();
    place({id, slot});
    ++count_;
  }
  /// Removes `id`. Precondition: `id` is present.
  void erase(std::uint64_t id) {
    std::size_t hole = home(id);
    while (entries_[hole].id != id || entries_[hole].slot == kNone) hole = (hole + 1) & mask();
    for (std::size_t i = (hole + 1) & mask(); entries_[i].slot != kNone; i = (i + 1) & mask()) {
      // An entry may be moved into the hole unless its home position is between the hole and the
      // entry.
      if (((i - home(entries_[i].id)) & mask()) < ((i - hole) & mask())) continue;
      entries_[hole] = entries_[i];
      hole = i;
    }
    entries_[hole].slot = kNone;
    --count_;
  }
  std::size_t size() const { return count_; }
  /// Returns the number of bytes of memory that the map uses.
  std::uint64_t memory() const { return entries_.capacity() * sizeof(Entry); }

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

/// Map that stores numbers in lines of sixteen consecutive numbers. Each line is a separate cache
/// line, so that consecutive numbers are stored next to each other. The IdMap has one entry per
/// line instead of one per number. An isolated number needs about 90 bytes. If all numbers of a
/// line are present, each needs about 6 bytes.
class NumberMap {
 public:
  /// Returns the slot of `number`, or kNone if `number` is absent.
  std::uint32_t find(std::uint64_t number) const {
    const std::uint32_t line = find_line(number);
    return line == kNone ? kNone : lines_[line].slot[number % kLine];
  }
  /// Inserts `number`. If `number` is present, returns false and changes nothing. Precondition:
  /// `slot` is not kNone.
  bool insert(std::uint64_t number, std::uint32_t slot) {
    std::uint32_t line = find_line(number);
    if (line == kNone) line = add_line(number);
    std::uint32_t& place = lines_[line].slot[number % kLine];
    if (place != kNone) return false;
    place = slot;
    ++counts_[line];
    return true;
  }
  /// Removes `number`. Precondition: `number` is present.
  void erase(std::uint64_t number) {
    const std::uint32_t line = find_line(number);
    lines_[line].slot[number % kLine] = kNone;
    if (--counts_[line] != 0) return;
    table_.erase(number / kLine);
    free_.push_back(line);
    found_at(number / kLine).line = kNone;
  }
  /// Returns the number of bytes of memory that the map uses.
  std::uint64_t memory() const {
    return table_.memory() + lines_.capacity() * sizeof(Line) + counts_.capacity() +
           free_.capacity() * sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint64_t kLine = 16;
  struct Line {
    std::array<std::uint32_t, kLine> slot{};
  };

  /// Cached result of an earlier search for a line (a group of consecutive numbers).
  struct Found {
    std::uint64_t number = 0;
    std::uint32_t line = kNone;
  };
  Found& found_at(std::uint64_t number) const { return found_[(number ^ number >> 6) % kFound]; }

  std::uint32_t find_line(std::uint64_t number) const {
    const std::uint64_t wanted = number / kLine;
    Found& found = found_at(wanted);
    if (found.line != kNone && found.number == wanted) return found.line;
    const std::uint32_t line = table_.find(wanted);
    if (line != kNone) found = {wanted, line};
    return line;
  }
  std::uint32_t add_line(std::uint64_t number) {
    auto line = static_cast<std::uint32_t>(lines_.size());
    if (free_.empty()) {
      lines_.emplace_back();
      counts_.push_back(0);
    } else {
      line = free_.back();
      free_.pop_back();
    }
    lines_[line].slot.fill(kNone);
    table_.insert(number / kLine, line);
    return line;
  }

  IdMap table_;  // map from number / kLine to the index of a line in lines_
  std::vector<Line> lines_;
  std::vector<std::uint8_t> counts_;  // number of numbers present in each line
  std::vector<std::uint32_t> free_;
  static constexpr std::size_t kFound = 64;
  // Cache of recent search results. It helps because consecutive cells of a row use the same few
  // lines.
  mutable std::array<Found, kFound> found_{};
};

}  // namespace shm
