// PageFrames: which pages of something larger are in memory. Those used of late stay (second
// chance). The room begins small, and grows, up to a budget, by each page that is wanted again soon
// after it had to leave: what is read front to back stays in little memory, what is read without
// order takes what it is given.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace shm::converters {

class PageFrames {
 public:
  struct Frame {
    std::unique_ptr<std::byte[]> bytes;
    std::uint64_t page = 0;
    bool dirty = false;  // for the caller; false at first
    bool used = false;   // since the hand came by
  };

  // Room for `start_bytes` at first, `budget_bytes` at most, and four pages at least.
  PageFrames(std::size_t page_bytes, std::size_t start_bytes, std::size_t budget_bytes)
      : page_bytes_(page_bytes),
        most_(std::max<std::size_t>(std::min(start_bytes, budget_bytes) / page_bytes, 4)),
        most_ever_(std::max(budget_bytes / page_bytes, most_)) {}

  std::uint64_t pages() const { return entries_.size(); }
  // There are `count` more pages, none of them here. 8 bytes each.
  void add_pages(std::uint64_t count) { entries_.resize(entries_.size() + count); }
  std::size_t resident_bytes() const { return frames_.size() * page_bytes_; }

  // Null when the page is not here. Valid until bring().
  Frame* find(std::uint64_t page) {
    const std::uint32_t place = entries_[page].place;
    if (place == kAbsent) return nullptr;
    frames_[place].used = true;
    return &frames_[place];
  }
  // Whether a page that is not here was.
  bool was_here(std::uint64_t page) const { return entries_[page].left_at != 0; }
  // A frame for a page that is not here; its bytes are for the caller to fill. leave(frame) comes
  // before another page gives its frame up. When it throws, nothing has changed.
  template <class Leave>
  Frame& bring(std::uint64_t page, Leave&& leave) {
    Entry& entry = entries_[page];
    // It would still be here if there were somewhat more room.
    if (was_here(page) && evictions_ - entry.left_at < 2 * most_ && most_ < most_ever_) ++most_;
    if (frames_.size() < most_) {
      entry.place = static_cast<std::uint32_t>(frames_.size());
      frames_.push_back(
          {std::make_unique_for_overwrite<std::byte[]>(page_bytes_), page, false, true});
      return frames_.back();
    }
    const auto step = [&] { hand_ = hand_ + 1 == frames_.size() ? 0 : hand_ + 1; };
    for (; frames_[hand_].used; step()) frames_[hand_].used = false;
    Frame& frame = frames_[hand_];
    leave(frame);
    if (++evictions_ == 0) evictions_ = 1;
    entries_[frame.page] = {kAbsent, evictions_};
    entry.place = static_cast<std::uint32_t>(hand_);
    step();
    frame.page = page;
    frame.dirty = false;
    frame.used = true;
    return frame;
  }

 private:
  static constexpr std::uint32_t kAbsent = ~std::uint32_t{0};
  struct Entry {
    std::uint32_t place = kAbsent;  // of its frame
    std::uint32_t left_at = 0;      // which eviction it was, from 1; 0: it never left
  };

  std::size_t page_bytes_, most_, most_ever_;  // frames: now, and at the end of growth
  std::vector<Frame> frames_;
  std::vector<Entry> entries_;  // by page
  std::size_t hand_ = 0;
  std::uint32_t evictions_ = 0;
};

}  // namespace shm::converters
