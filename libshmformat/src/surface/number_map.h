// NumberMap: from 64-bit numbers to 32-bit slots, for numbers that live and die in runs.
// Numbers are kept by sixteens, each on a cache line of its own, so that neighbours are found
// side by side and the table of an IdMap changes once for all of them. Memory follows what is
// alive: some 90 bytes for a number that is alone, some 6 for one of a run.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bytes/none.h"
#include "surface/id_map.h"

namespace shm {

class NumberMap {
 public:
  /// The slot of `number`, kNone when absent.
  std::uint32_t find(std::uint64_t number) const {
    const std::uint32_t line = find_line(number);
    return line == kNone ? kNone : lines_[line].slot[number % kLine];
  }
  /// False, and nothing changes, where `number` is present. Must hold: slot is not kNone.
  bool insert(std::uint64_t number, std::uint32_t slot) {
    std::uint32_t line = find_line(number);
    if (line == kNone) line = add_line(number);
    std::uint32_t& place = lines_[line].slot[number % kLine];
    if (place != kNone) return false;
    place = slot;
    ++counts_[line];
    return true;
  }
  /// Must hold: `number` is present.
  void erase(std::uint64_t number) {
    const std::uint32_t line = find_line(number);
    lines_[line].slot[number % kLine] = kNone;
    if (--counts_[line] != 0) return;
    table_.erase(number / kLine);
    free_.push_back(line);
    found_at(number / kLine).line = kNone;
  }

 private:
  static constexpr std::uint64_t kLine = 16;
  struct Line {
    std::array<std::uint32_t, kLine> slot{};
  };

  /// A line that was found before.
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

  IdMap table_;  // by number / kLine
  std::vector<Line> lines_;
  std::vector<std::uint8_t> counts_;  // of live numbers, by line
  std::vector<std::uint32_t> free_;
  static constexpr std::size_t kFound = 64;
  mutable std::array<Found, kFound> found_{};  // cells of a row need the same few lines
};

}  // namespace shm
