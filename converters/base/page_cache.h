// PageCache: elements of an array that is read in runs, asked for one by one in any order.
// Neighbouring elements come with one fetch, so coherent orders cost one fetch a page. Memory as
// PageFrames says.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <utility>

#include "base/page_frames.h"

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
        frames_(element_bytes << page_bits_, kStartBytes, budget_bytes),
        fetch_(std::move(fetch)) {
    frames_.add_pages((elements >> page_bits_) + 1);
  }

  // Must hold: index < elements. Valid until the next call.
  const std::byte* operator[](std::uint64_t index) {
    const std::uint64_t page = index >> page_bits_;
    PageFrames::Frame* frame = frames_.find(page);
    if (frame == nullptr) frame = load(page);
    const std::uint64_t place = index & ((std::uint64_t{1} << page_bits_) - 1);
    return frame->bytes.get() + place * element_bytes_;
  }

 private:
  static constexpr std::size_t kPageBytes = std::size_t{128} << 10;
  static constexpr std::size_t kMostElements = 4096;
  static constexpr std::size_t kStartBytes = std::size_t{1} << 20;

  PageFrames::Frame* load(std::uint64_t page) {
    PageFrames::Frame& frame = frames_.bring(page, [](const PageFrames::Frame&) {});
    const std::uint64_t first = page << page_bits_;
    fetch_(first, std::min(std::uint64_t{1} << page_bits_, elements_ - first), frame.bytes.get());
    return &frame;
  }

  std::uint64_t elements_;
  std::size_t element_bytes_;
  int page_bits_;
  PageFrames frames_;
  Fetch fetch_;
};

}  // namespace shm::converters
