// SortedValues: the magnitudes that a component has met so far, ascending, and what came with each:
// the nearest to a given one, and the one of a given rank. For recalled values and for partners.
// RecalledValues: the values of a component so far, by size and by number, and where the elements
// of a class found theirs: whoever found one goes on there, forwards or backwards.
// spec: "Recalled values", "Partners"
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace shm {

class SortedValues {
 public:
  /// Frozen, part of the format: one with more begins anew, empty.
  static constexpr std::size_t kMost = std::size_t{1} << 15;

  struct Entry {
    std::uint64_t magnitude = 0;  ///< of a double: its bits without the sign; these ascend with it
    double value = 0.0;           ///< what came with it the last time
  };

  static std::uint64_t magnitude_of(double value) {
    return std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63);
  }

  std::size_t size() const { return old_.size() + recent_.size(); }
  /// How many are below a magnitude.
  std::size_t rank_of(std::uint64_t magnitude) const {
    return static_cast<std::size_t>(place(old_, magnitude) + place(recent_, magnitude));
  }
  /// Must hold: rank < size().
  const Entry& at(std::size_t rank) const {
    // As many of the recent ones before it as there are places where both lists agree on the rank.
    std::size_t low = rank > old_.size() ? rank - old_.size() : 0;
    std::size_t high = std::min(rank, recent_.size());
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (recent_[middle].magnitude < old_[rank - middle - 1].magnitude)
        low = middle + 1;
      else
        high = middle;
    }
    const std::size_t in_old = rank - low;
    if (in_old == old_.size()) return recent_[low];
    if (low == recent_.size()) return old_[in_old];
    return recent_[low].magnitude < old_[in_old].magnitude ? recent_[low] : old_[in_old];
  }
  /// Null where there is none; the smaller of two equally near.
  const Entry* nearest(std::uint64_t magnitude) const {
    const Entry* found = nullptr;
    for (const auto* list : {&old_, &recent_}) {
      const auto at = static_cast<std::size_t>(place(*list, magnitude));
      for (std::size_t i = at == 0 ? 0 : at - 1; i < list->size() && i <= at; ++i)
        if (!found || is_nearer((*list)[i].magnitude, found->magnitude, magnitude))
          found = &(*list)[i];
    }
    return found;
  }

  void add(std::uint64_t magnitude, double value) {
    for (auto* list : {&old_, &recent_}) {
      const auto at = static_cast<std::size_t>(place(*list, magnitude));
      if (at == list->size() || (*list)[at].magnitude != magnitude) continue;
      (*list)[at].value = value;
      return;
    }
    if (size() == kMost) clear();
    recent_.insert(recent_.begin() + place(recent_, magnitude), {magnitude, value});
    if (recent_.size() == kRecent) merge();
  }
  void clear() {
    old_.clear();
    recent_.clear();
  }

 private:
  using List = std::vector<Entry>;  // ascending, no magnitude twice
  static constexpr std::size_t kRecent = 256;

  static std::ptrdiff_t place(const List& list, std::uint64_t magnitude) {
    const auto below = [](const Entry& it, std::uint64_t m) { return it.magnitude < m; };
    return std::lower_bound(list.begin(), list.end(), magnitude, below) - list.begin();
  }
  static bool is_nearer(std::uint64_t one, std::uint64_t than, std::uint64_t to) {
    const auto distance = [to](std::uint64_t m) { return m < to ? to - m : m - to; };
    if (distance(one) != distance(than)) return distance(one) < distance(than);
    return one < than;
  }
  void merge() {
    const auto middle = static_cast<std::ptrdiff_t>(old_.size());
    if (old_.capacity() < old_.size() + kRecent && 2 * old_.size() >= kMost / 2)
      old_.reserve(kMost);
    old_.insert(old_.end(), recent_.begin(), recent_.end());
    std::inplace_merge(old_.begin(), old_.begin() + middle, old_.end(),
                       [](const Entry& a, const Entry& b) { return a.magnitude < b.magnitude; });
    recent_.clear();
  }

  List old_, recent_;  // no magnitude in both
};

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
