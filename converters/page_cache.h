// PageCache: elements of an array that is read in runs, asked for one by one in any order.
// Keeps the pages used of late (second chance), at most `budget_bytes` of them; neighbouring
// elements come with one fetch, so coherent orders cost one fetch a page.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace shm::converters {

class PageCache {
 public:
  // Fills `out` with `count` elements from element `first`.
  using Fetch = std::function<void(std::uint64_t first, std::uint64_t count, std::byte* out)>;

  PageCache(std::uint64_t elements, std::size_t element_bytes, std::size_t budget_bytes,
            Fetch fetch)
      : elements_(elements),
        element_bytes_(element_bytes),
        page_bits_(std::countr_zero(std::min(
            std::bit_floor(std::clamp<std::size_t>(kPageBytes / element_bytes, 1, kMostElements)),
            static_cast<std::size_t>(
                std::bit_ceil(std::clamp<std::uint64_t>(elements, 1, kMostElements)))))),
        slot_of_page_((elements >> page_bits_) + 1, kAbsent),
        most_slots_(std::max<std::size_t>(budget_bytes / (element_bytes << page_bits_), 4)),
        fetch_(std::move(fetch)) {}

  // Must hold: index < elements. Valid until the next call.
  const std::byte* operator[](std::uint64_t index) {
    const std::uint64_t page = index >> page_bits_;
    std::uint32_t slot = slot_of_page_[page];
    if (slot == kAbsent) slot = load(page);
    slots_[slot].used = true;
    const std::uint64_t place = index & ((std::uint64_t{1} << page_bits_) - 1);
    return slots_[slot].bytes.get() + place * element_bytes_;
  }

 private:
  static constexpr std::size_t kPageBytes = std::size_t{128} << 10;
  static constexpr std::size_t kMostElements = 4096;
  static constexpr std::uint32_t kAbsent = ~std::uint32_t{0};
  struct Slot {
    std::unique_ptr<std::byte[]> bytes;
    std::uint64_t page = 0;
    bool used = false;
  };

  std::uint32_t load(std::uint64_t page) {
    const std::uint32_t slot = free_slot();
    const std::uint64_t first = page << page_bits_;
    const std::uint64_t count = std::min(std::uint64_t{1} << page_bits_, elements_ - first);
    fetch_(first, count, slots_[slot].bytes.get());
    slots_[slot].page = page;
    slot_of_page_[page] = slot;
    return slot;
  }

  std::uint32_t free_slot() {
    if (slots_.size() < most_slots_) {
      slots_.push_back({std::make_unique<std::byte[]>(element_bytes_ << page_bits_), 0, false});
      return static_cast<std::uint32_t>(slots_.size() - 1);
    }
    while (slots_[hand_].used) {
      slots_[hand_].used = false;
      hand_ = (hand_ + 1) % slots_.size();
    }
    slot_of_page_[slots_[hand_].page] = kAbsent;
    const auto slot = static_cast<std::uint32_t>(hand_);
    hand_ = (hand_ + 1) % slots_.size();
    return slot;
  }

  std::uint64_t elements_;
  std::size_t element_bytes_;
  int page_bits_;
  std::vector<std::uint32_t> slot_of_page_;  // 4 bytes for each page of up to 4096 elements
  std::size_t most_slots_;
  Fetch fetch_;
  std::vector<Slot> slots_;
  std::size_t hand_ = 0;
};

}  // namespace shm::converters
