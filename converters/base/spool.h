// Spool: large arrays on their way between formats, in bounded memory.
// A PagedArray is an array of fixed-size elements that may be read and written anywhere; what
// does not fit the memory goes to an unlinked temporary file, so nothing is left behind on any
// exit. PageFrames decide how much memory that is. Arrays that fit in a small part of a page stay
// out of pages while they fit the budget once more: a file may have very many. A NumberTable is one
// of numbers of vertices or cells. A PageCache holds pages of what can be read anywhere again.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace shm::converters {

// Which pages of something larger are in memory. Those used of late stay (second chance). The room
// begins small, and grows, up to a budget, by each page that is wanted again soon after it had to
// leave: what is read front to back stays in little memory, what is read without order takes what
// it is given.
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

// Where pages of many arrays live. Shares one memory budget and one temporary file. For one thread.
// What a mesh may come to that goes through a spool; more is over_limit.
struct MeshLimits {
  std::uint64_t most = ~std::uint64_t{0};   // of cells, and of vertices
  std::uint64_t bytes = ~std::uint64_t{0};  // of its numbers
};

class Spool {
 public:
  static constexpr std::size_t kPageBytes = 64 * 1024;
  static constexpr std::size_t kSmallBytes = 4 * 1024;  // arrays up to here need no page
  static constexpr std::size_t kStartBytes = std::size_t{8} << 20;
  static constexpr std::size_t kUsualBudget = std::size_t{256} << 20;

  // `directory`: where the temporary file is made when it is first needed. `memory_budget`: bytes
  // that pages here take at most, with what others hold beside them: half of it is for pages, a
  // quarter for caches, a quarter for what the library keeps.
  explicit Spool(std::string directory, std::size_t memory_budget = kUsualBudget,
                 const MeshLimits& limits = {});
  ~Spool();
  const std::string& directory() const { return directory_; }
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  std::size_t memory_budget() const { return memory_budget_; }
  const MeshLimits& limits() const { return limits_; }
  // Bytes of the pages that were ever written.
  std::uint64_t paged_bytes() const { return pages_written_ * kPageBytes; }
  std::size_t resident_bytes() const { return frames_.resident_bytes(); }

 private:
  friend class PagedArray;
  using Frame = PageFrames::Frame;

  // Valid until the next call.
  std::byte* page(std::uint64_t number, bool for_writing) {
    Frame* frame = frames_.find(number);
    if (frame == nullptr) frame = load(number);
    if (for_writing && !frame->dirty) begin_writing(*frame);
    return frame->bytes.get();
  }
  std::uint64_t reserve_pages(std::uint64_t count);
  Frame* load(std::uint64_t number);
  void begin_writing(Frame& frame);
  bool take_small(std::size_t bytes);  // false: there is no room for more
  void write_out(const Frame& frame);

  std::string directory_;
  std::size_t memory_budget_;
  MeshLimits limits_;
  PageFrames frames_;
  int descriptor_ = -1;
  std::size_t small_room_;          // bytes that small arrays may still take
  std::vector<bool> ever_written_;  // of each page
  std::uint64_t pages_written_ = 0;
};

// What the library may keep of the topology beside such a spool.
inline std::size_t kept_topology_bytes(const Spool& spool) {
  return std::min(spool.memory_budget() / 4, std::size_t{64} << 20);
}

// Elements of `element_bytes` each, zero until written, growing as they are written.
// Borrowed from its Spool, which must outlive it. Throws Failure when the disk fails.
class PagedArray {
 public:
  PagedArray(Spool& spool, std::size_t element_bytes);
  PagedArray(PagedArray&&) = default;
  PagedArray& operator=(PagedArray&&) = default;

  std::uint64_t size() const { return size_; }  // elements, one past the highest written
  void read(std::uint64_t first, std::uint64_t count, std::byte* out);
  void write(std::uint64_t first, std::uint64_t count, const std::byte* in);
  void append(std::uint64_t count, const std::byte* in) { write(size_, count, in); }
  // One element, which is a T.
  template <class T>
  T get(std::uint64_t index) {
    static_assert(std::is_trivially_copyable_v<T>);
    T value;
    if (kNeverSplit<T> && !is_small())
      std::memcpy(&value, at(index * sizeof(T), false), sizeof(T));
    else
      read(index, 1, reinterpret_cast<std::byte*>(&value));
    return value;
  }
  template <class T>
  void set(std::uint64_t index, const T& value) {
    static_assert(std::is_trivially_copyable_v<T>);
    if (!kNeverSplit<T> || is_small())
      return write(index, 1, reinterpret_cast<const std::byte*>(&value));
    std::memcpy(at(index * sizeof(T), true), &value, sizeof(T));
    if (index >= size_) size_ = index + 1;
  }

 private:
  // Whether an element lies in one page.
  template <class T>
  static constexpr bool kNeverSplit = Spool::kPageBytes % sizeof(T) == 0;
  static constexpr std::uint64_t kExtentPages = 16;  // pages reserved together: 1 MiB of file

  std::byte* at(std::uint64_t byte, bool for_writing) {
    const std::uint64_t page = byte / Spool::kPageBytes;
    if (page / kExtentPages >= extents_.size()) reserve(page);
    const std::uint64_t number = extents_[page / kExtentPages] + page % kExtentPages;
    return spool_->page(number, for_writing) + byte % Spool::kPageBytes;
  }
  void reserve(std::uint64_t page);
  bool is_small() const { return extents_.empty(); }
  bool write_small(std::uint64_t byte, std::uint64_t bytes, const std::byte* in);
  void write_paged(std::uint64_t byte, std::uint64_t bytes, const std::byte* in);

  Spool* spool_;
  std::size_t element_bytes_;
  std::uint64_t size_ = 0;
  std::vector<std::byte> small_;        // all there is, while there are no extents
  std::vector<std::uint64_t> extents_;  // first page number of each extent
};

// A number for each vertex or cell, zero at first, read and written anywhere, in the spool. Numbers
// take 4 bytes each where none can be larger than that.
class NumberTable {
 public:
  static constexpr std::uint64_t kAnyNumber = std::numeric_limits<std::uint64_t>::max();

  // `most`: the largest number that will be written.
  NumberTable(Spool& spool, std::uint64_t size, std::uint64_t most = kAnyNumber)
      : size_(size),
        narrow_(most <= std::numeric_limits<std::uint32_t>::max()),
        paged_(spool, narrow_ ? sizeof(std::uint32_t) : sizeof(std::uint64_t)) {}
  std::uint64_t size() const { return size_; }
  std::uint64_t get(std::uint64_t index) {
    return narrow_ ? paged_.get<std::uint32_t>(index) : paged_.get<std::uint64_t>(index);
  }
  void set(std::uint64_t index, std::uint64_t value) {
    if (narrow_)
      paged_.set(index, static_cast<std::uint32_t>(value));
    else
      paged_.set(index, value);
  }

 private:
  std::uint64_t size_;
  bool narrow_;
  PagedArray paged_;
};

// Elements of an array that is read in runs, asked for one by one in any order. Neighbouring
// elements come with one fetch, so coherent orders cost one fetch a page. Memory as of PageFrames.
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

// A long list of numbers, written front to back and read in pieces. While the numbers count up from
// 0 they take no room, and 4 bytes each while they fit.
class NumberList {
 public:
  explicit NumberList(Spool& spool)
      : narrow_(spool, sizeof(std::uint32_t)), wide_(spool, sizeof(std::uint64_t)) {}
  void push_back(std::uint64_t number) {
    if (number == size_ && size_ == counted_) {
      counted_ = ++size_;
      return;
    }
    tail_.push_back(number);
    ++size_;
    if (tail_.size() == kTail) flush();
  }
  std::uint64_t size() const { return size_; }
  // `count` numbers from number `first`. Must hold: there are so many.
  void read(std::uint64_t first, std::uint64_t count, std::vector<std::uint64_t>& out) {
    flush();
    out.resize(count);
    std::uint64_t done = 0;
    for (; done < count && first + done < counted_; ++done) out[done] = first + done;
    const std::uint64_t wide_from = counted_ + narrow_.size();
    if (done < count && first + done < wide_from) {
      piece_.resize(std::min(count - done, wide_from - first - done));
      narrow_.read(first + done - counted_, piece_.size(),
                   reinterpret_cast<std::byte*>(piece_.data()));
      std::copy(piece_.begin(), piece_.end(), out.begin() + static_cast<std::ptrdiff_t>(done));
      done += piece_.size();
    }
    if (done < count)
      wide_.read(first + done - wide_from, count - done,
                 reinterpret_cast<std::byte*>(out.data() + done));
  }
  // Calls visit(position, number) for all of them.
  template <class Visit>
  void for_each(Visit&& visit) {
    std::vector<std::uint64_t> piece;
    const std::uint64_t end = size();
    for (std::uint64_t first = 0; first < end; first += piece.size()) {
      read(first, std::min<std::uint64_t>(kTail, end - first), piece);
      for (std::size_t i = 0; i < piece.size(); ++i) visit(first + i, piece[i]);
    }
  }

 private:
  static constexpr std::size_t kTail = 8192;
  void flush() {
    constexpr std::uint64_t kNarrow = std::numeric_limits<std::uint32_t>::max();
    std::size_t done = 0;
    piece_.clear();
    if (wide_.size() == 0)
      for (; done < tail_.size() && tail_[done] <= kNarrow; ++done)
        piece_.push_back(static_cast<std::uint32_t>(tail_[done]));
    narrow_.append(piece_.size(), reinterpret_cast<const std::byte*>(piece_.data()));
    wide_.append(tail_.size() - done, reinterpret_cast<const std::byte*>(tail_.data() + done));
    tail_.clear();
  }

  // One behind the other: what counts up, narrow numbers, and all from the first wide one on.
  std::uint64_t counted_ = 0;
  PagedArray narrow_, wide_;
  std::uint64_t size_ = 0;
  std::vector<std::uint64_t> tail_;   // of these, what has not been sorted in
  std::vector<std::uint32_t> piece_;  // on its way
};

// position[number] for a list of numbers below `size`. Throws corrupt unless the list holds each
// number below `size` exactly once; `what` names them in the complaint.
NumberTable invert(NumberList& order, std::uint64_t size, const char* what, Spool& spool);

}  // namespace shm::converters
