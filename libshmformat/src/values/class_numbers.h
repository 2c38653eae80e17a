// ClassNumbers: neighbourhoods of which the same is known and that stand alike are a class; its
// number is how many other classes came before it. spec: "Classes"
#pragma once

#include <cstdint>
#include <vector>

#include "values/neighbourhood.h"

namespace shm {

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

 private:
  static constexpr std::uint32_t kFree = ~std::uint32_t{0};
  struct Entry {
    std::uint32_t key = kFree;
    std::uint16_t number = 0;
  };

  /// What is known but for what is farther; the corner; the kind.
  static std::uint32_t key_of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t known = item.known & counts;
    return (known & 0x3ffu) | (known >> 13 & 7u) << 10 | std::uint32_t{item.corner} << 13 |
           std::uint32_t{item.kind} << 16;
  }
  std::size_t place(std::uint32_t key) const {
    return (key * 0x9e3779b1u >> 8) & (entries_.size() - 1);
  }
  std::uint16_t add(std::uint32_t key, std::size_t at) {
    const auto number = static_cast<std::uint16_t>(count_ < kMost ? count_++ : count_ - 1);
    entries_[at] = {key, number};
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
  std::uint32_t count_ = 0;
  std::size_t used_ = 0;
};

}  // namespace shm
