// ClassNumbers: neighbourhoods of which the same is known and that stand alike are a class; its
// number is how many other classes came before it. Classes of one family know the same of their own
// hexahedron, and differ in what is beyond it; families are numbered likewise. spec: "Classes"
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "values/neighbourhood.h"

namespace shm {

/// Of the elements of a tile the numbers of their classes, and of each class that of its family.
struct TileClasses {
  std::span<const std::uint16_t> of_item, families;
};

class ClassNumbers {
 public:
  static constexpr std::uint32_t kMost = 65535;

  /// `counts`: bits of Neighbourhood::known that count.
  std::uint16_t of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t key = key_of(item, counts);
    std::size_t at = place(key);
    while (entries_[at].key != key) {
      if (entries_[at].key == kFree) return add(key, at);
      at = (at + 1) & (entries_.size() - 1);
    }
    return entries_[at].number;
  }
  /// By class: the number of its family.
  std::span<const std::uint16_t> families() const { return families_; }

 private:
  static constexpr std::uint32_t kFree = ~std::uint32_t{0};
  struct Entry {
    std::uint32_t key = kFree;
    std::uint16_t number = 0;
  };

  /// What is known but for what is farther; the corner; the kind.
  static std::uint32_t key_of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t known = item.traits(counts);
    return (known & 0x3ffu) | (known >> 13 & 7u) << 10 | std::uint32_t{item.corner} << 13 |
           std::uint32_t{item.kind} << 16;
  }
  /// What is known within the hexahedron; the corner; the kind: 13 bits.
  static std::uint16_t family_key(std::uint32_t key) {
    return static_cast<std::uint16_t>((key & Neighbourhood::kLattice) | (key >> 13 & 63u) << 7);
  }
  std::size_t place(std::uint32_t key) const {
    return (key * 0x9e3779b1u >> 8) & (entries_.size() - 1);
  }
  std::uint16_t add(std::uint32_t key, std::size_t at) {
    const auto number = static_cast<std::uint16_t>(count_ < kMost ? count_++ : count_ - 1);
    entries_[at] = {key, number};
    if (number == families_.size()) {
      const auto found = std::find(family_keys_.begin(), family_keys_.end(), family_key(key));
      families_.push_back(static_cast<std::uint16_t>(found - family_keys_.begin()));
      if (found == family_keys_.end()) family_keys_.push_back(family_key(key));
    }
    if (2 * ++used_ > entries_.size()) grow();
    return number;
  }
  void grow() {
    std::vector<Entry> old(2 * entries_.size());
    old.swap(entries_);
    for (const Entry& entry : old) {
      if (entry.key == kFree) continue;
      std::size_t at = place(entry.key);
      while (entries_[at].key != kFree) at = (at + 1) & (entries_.size() - 1);
      entries_[at] = entry;
    }
  }

  std::vector<Entry> entries_ = std::vector<Entry>(64);
  std::vector<std::uint16_t> families_;     // by class
  std::vector<std::uint16_t> family_keys_;  // in order of number: at most 8192
  std::uint32_t count_ = 0;
  std::size_t used_ = 0;
};

}  // namespace shm
