// SortedValues: the magnitudes that have occurred so far in a component, in ascending order, each
// with an associated value. It finds the entry nearest to a magnitude, and the entry with a given
// rank. It is used for recalled values and for partners.
//
// RecalledValues: the earlier values of a component, by magnitude and by number. For each class it
// also stores the source of the last recalled value: the next recalled value of the class probably
// continues from this source, forwards or backwards.
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
  /// Largest number of entries. A full list is emptied before the next entry is added. Frozen: part
  /// of the format.
  static constexpr std::size_t kMost = std::size_t{1} << 15;

  struct Entry {
    /// Bits of a double without the sign bit; these have the order of the magnitudes
    std::uint64_t magnitude = 0;
    double value = 0.0;  ///< value added most recently with this magnitude
  };

  static std::uint64_t magnitude_of(double value) {
    return std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63);
  }

  std::size_t size() const { return old_.size() + recent_.size(); }
  /// Returns the number of entries whose magnitude is smaller.
  std::size_t rank_of(std::uint64_t magnitude) const {
    return static_cast<std::size_t>(place(old_, magnitude) + place(recent_, magnitude));
  }
  /// Returns the entry with a rank. Must hold: rank < size().
  const Entry& at(std::size_t rank) const {
    // Find `low`, the number of recent entries before this rank, by binary search.
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
  /// Returns the entry with the nearest magnitude; of two equally near entries, the smaller.
  /// Returns null if the list is empty.
  const Entry* nearest(std::uint64_t magnitude) const {
    const Entry* found = nullptr;
    for (const auto* list : {&old_, &recent_}) {
      const auto position = static_cast<std::size_t>(place(*list, magnitude));
      for (std::size_t i = position == 0 ? 0 : position - 1; i < list->size() && i <= position; ++i)
        if (!found || is_nearer((*list)[i].magnitude, found->magnitude, magnitude))
          found = &(*list)[i];
    }
    return found;
  }

  void add(std::uint64_t magnitude, double value) {
    for (auto* list : {&old_, &recent_}) {
      const auto position = static_cast<std::size_t>(place(*list, magnitude));
      if (position == list->size() || (*list)[position].magnitude != magnitude) continue;
      (*list)[position].value = value;
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
  using List = std::vector<Entry>;  // entries in ascending order; each magnitude occurs once
  static constexpr std::size_t kRecent = 256;

  static std::ptrdiff_t place(const List& list, std::uint64_t magnitude) {
    const auto below = [](const Entry& entry, std::uint64_t m) { return entry.magnitude < m; };
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

  List old_, recent_;  // no magnitude occurs in both lists
};

class RecalledValues {
 public:
  bool empty() const { return list_.size() == 0; }
  const SortedValues& list() const { return list_; }

  /// The expected rank, relative to which the rank of a recalled value is coded.
  struct Start {
    std::size_t rank = 0;
    bool by_source = false;  ///< true: rank of the value that follows the last source
  };
  Start start(std::uint32_t of_class, std::uint64_t predicted) const {
    if (of_class < sources_.size() && sources_[of_class].trust >= kTrusted)
      if (const std::uint64_t* next = next_of(sources_[of_class]))
        return {list_.rank_of(*next), true};
    return {list_.rank_of(predicted), false};
  }
  /// Records that the current value was coded relative to the entry with this rank. Call it before
  /// add() adds the current value.
  void take(std::uint32_t of_class, std::size_t rank) {
    if (of_class >= sources_.size()) sources_.resize(of_class + std::size_t{1});
    Source& source = sources_[of_class];
    const SortedValues::Entry& entry = list_.at(rank);
    const auto found = static_cast<std::int64_t>(entry.value);
    const auto here = static_cast<std::int64_t>(count_);
    if (source.known) {
      const std::uint64_t* next = next_of(source);
      if (next != nullptr && *next == entry.magnitude)
        source.trust = static_cast<std::uint8_t>(std::min(source.trust + 1, kMostTrust));
      else
        source.trust = static_cast<std::uint8_t>(std::max(source.trust - 1, 0));
      const std::int64_t gone = here - source.here;
      if (found - source.there == gone) source.direction = 1;
      if (found - source.there == -gone) source.direction = -1;
    }
    source.known = true;
    source.here = here;
    source.there = found;
  }
  /// Adds the current value.
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
  /// The last recalled value of a class (`here`) and the earlier value from which it was recalled
  /// (`there`), as numbers of values.
  struct Source {
    std::int64_t here = 0, there = 0;
    std::int8_t direction = 1;
    std::uint8_t trust = 0;  // counter of correct continuations, from 0 to kMostTrust
    bool known = false;
  };

  /// Returns the magnitude that the current value has if the class continues from its last source;
  /// null if that earlier value is out of range.
  const std::uint64_t* next_of(const Source& source) const {
    const auto here = static_cast<std::int64_t>(count_);
    const std::int64_t next = source.there + source.direction * (here - source.here);
    if (next < 0 || next >= here) return nullptr;
    if (here - next > static_cast<std::int64_t>(SortedValues::kMost)) return nullptr;
    return &by_number_[static_cast<std::size_t>(next) % SortedValues::kMost];
  }

  SortedValues list_;  // value of an entry: number of the last element with that magnitude
  std::vector<std::uint64_t> by_number_;  // recent magnitudes, by number modulo kMost
  std::vector<Source> sources_;           // sources of the classes, by class
  std::uint64_t count_ = 0;
};

}  // namespace shm
