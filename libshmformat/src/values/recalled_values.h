// RecalledValues: the values of a component so far, by size and by number, and where the elements
// of a class found theirs: whoever found one goes on there, forwards or backwards.
// spec: "Recalled values"
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "values/sorted_values.h"

namespace shm {

class RecalledValues {
 public:
  bool empty() const { return list_.size() == 0; }
  const SortedValues& list() const { return list_; }

  /// From where the rank of a value is coded.
  struct Start {
    std::size_t rank = 0;
    bool by_source = false;  ///< of the value that follows the last source of the class
  };
  Start start(std::uint32_t of_class, std::uint64_t predicted) const {
    if (of_class < sources_.size() && sources_[of_class].trust >= kTrusted)
      if (const std::uint64_t* next = next_of(sources_[of_class]))
        return {list_.rank_of(*next), true};
    return {list_.rank_of(predicted), false};
  }
  /// The value at hand, which is not added yet, was about as large as the one of that rank.
  void take(std::uint32_t of_class, std::size_t rank) {
    if (of_class >= sources_.size()) sources_.resize(of_class + std::size_t{1});
    Source& it = sources_[of_class];
    const SortedValues::Entry& entry = list_.at(rank);
    const auto found = static_cast<std::int64_t>(entry.value);
    const auto here = static_cast<std::int64_t>(count_);
    if (it.known) {
      const std::uint64_t* next = next_of(it);
      if (next != nullptr && *next == entry.magnitude)
        it.trust = static_cast<std::uint8_t>(std::min(it.trust + 1, kMostTrust));
      else
        it.trust = static_cast<std::uint8_t>(std::max(it.trust - 1, 0));
      const std::int64_t gone = here - it.here;
      if (found - it.there == gone) it.direction = 1;
      if (found - it.there == -gone) it.direction = -1;
    }
    it.known = true;
    it.here = here;
    it.there = found;
  }
  /// The value at hand.
  void add(std::uint64_t magnitude) {
    if (by_number_.size() < SortedValues::kMost)
      by_number_.push_back(magnitude);
    else
      by_number_[count_ % SortedValues::kMost] = magnitude;
    list_.add(magnitude, static_cast<double>(count_));
    ++count_;
  }

 private:
  static constexpr int kTrusted = 2, kMostTrust = 3;
  /// Of a class: where its last recalled value was, and the earlier one that it was about as large
  /// as.
  struct Source {
    std::int64_t here = 0, there = 0;
    std::int8_t direction = 1;
    std::uint8_t trust = 0;  // how often what follows was right lately
    bool known = false;
  };

  /// The magnitude that the value at hand has if it goes on like the last one; null where there is
  /// none any more.
  const std::uint64_t* next_of(const Source& it) const {
    const auto here = static_cast<std::int64_t>(count_);
    const std::int64_t next = it.there + it.direction * (here - it.here);
    if (next < 0 || next >= here) return nullptr;
    if (here - next > static_cast<std::int64_t>(SortedValues::kMost)) return nullptr;
    return &by_number_[static_cast<std::size_t>(next) % SortedValues::kMost];
  }

  SortedValues list_;                     // with the numbers of the last elements that had them
  std::vector<std::uint64_t> by_number_;  // the last magnitudes, by number modulo kMost
  std::vector<Source> sources_;           // by class
  std::uint64_t count_ = 0;
};

}  // namespace shm
