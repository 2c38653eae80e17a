// Spool: large arrays in bounded memory, used while a mesh is converted.
// - PagedArray: an array of fixed-size elements with random access. Pages that do not fit in memory
// go to an unlinked temporary file, so no file is left behind however the program exits.
// - PageFrames: decides which pages are in memory, and how many.
// - NumberTable: a PagedArray of numbers, one per vertex or cell.
// - PageCache: caches pages of data that can be fetched again at any time.
//
// A file may have very many small arrays. An array of at most kSmallBytes bytes is therefore held
// in memory outside the pages, as long as the total of such arrays stays within a separate budget.
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

// Manages the set of pages that are in memory. Recently used pages stay in memory (second-chance
// replacement). The number of frames is small at first. Whenever a page is needed again soon after
// its eviction, the number of frames grows by one, up to a budget. Sequential access therefore
// needs little memory, and random access may use the whole budget.
class PageFrames {
 public:
  struct Frame {
    std::unique_ptr<std::byte[]> bytes;
    std::uint64_t page = 0;
    bool dirty = false;  // set by the caller if the page was changed; initially false
    bool used = false;   // true: the page was used since the clock hand last passed it
  };

  // Initially allows frames of `start_bytes` bytes in total. The total may grow to `budget_bytes`.
  // At least four frames are always allowed.
  PageFrames(std::size_t page_bytes, std::size_t start_bytes, std::size_t budget_bytes)
      : page_bytes_(page_bytes),
        most_(std::max<std::size_t>(std::min(start_bytes, budget_bytes) / page_bytes, 4)),
        most_ever_(std::max(budget_bytes / page_bytes, most_)) {}

  std::uint64_t pages() const { return entries_.size(); }
  // Adds `count` pages that are not in memory. Each page needs 8 bytes of bookkeeping.
  void add_pages(std::uint64_t count) { entries_.resize(entries_.size() + count); }
  std::size_t resident_bytes() const { return frames_.size() * page_bytes_; }

  // Returns the frame of a page, or null if the page is not in memory. The frame is valid until the
  // next bring().
  Frame* find(std::uint64_t page) {
    const std::uint32_t place = entries_[page].place;
    if (place == kAbsent) return nullptr;
    frames_[place].used = true;
    return &frames_[place];
  }
  // Returns true if the page was in memory earlier. Precondition: the page is not in memory now.
  bool was_here(std::uint64_t page) const { return entries_[page].left_at != 0; }
  // Assigns a frame to a page that is not in memory, and returns the frame. The caller must then
  // fill the frame with the bytes of the page. If another page must be evicted, calls leave(frame)
  // for its frame first. If leave() throws, the state is unchanged.
  template <class Leave>
  Frame& bring(std::uint64_t page, Leave&& leave) {
    Entry& entry = entries_[page];
    // If the page was evicted only recently, more frames would have kept it in memory. Allow one
    // more frame.
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
    std::uint32_t place = kAbsent;  // index of the frame that contains the page

    // Value of evictions_ when the page was last evicted; 0 if it was never evicted.
    std::uint32_t left_at = 0;
  };

  std::size_t page_bytes_, most_, most_ever_;  // current and maximum number of frames
  std::vector<Frame> frames_;
  std::vector<Entry> entries_;  // indexed by page
  std::size_t hand_ = 0;
  std::uint32_t evictions_ = 0;
};

// Limits for a mesh that is read through a spool. A mesh that exceeds a limit causes an over_limit
// error.
struct MeshLimits {
  // Maximum number of cells. The same maximum applies to the number of vertices.
  std::uint64_t most = ~std::uint64_t{0};
  // Maximum total size in bytes of coordinates, corner lists and arrays.
  std::uint64_t bytes = ~std::uint64_t{0};
};

// Storage for the pages of many arrays, with one memory budget and one temporary file. Not
// thread-safe.
class Spool {
 public:
  static constexpr std::size_t kPageBytes = 64 * 1024;
  // Maximum size in bytes of an array that is held outside the pages.
  static constexpr std::size_t kSmallBytes = 4 * 1024;
  static constexpr std::size_t kStartBytes = std::size_t{8} << 20;
  static constexpr std::size_t kUsualBudget = std::size_t{256} << 20;

  // The temporary file is created in the folder `directory` when it is first needed.
  // `memory_budget` is the memory limit in bytes for the spool and its users together: half for
  // pages, a quarter for caches, and a quarter for the topology that the library keeps.
  explicit Spool(std::string directory, std::size_t memory_budget = kUsualBudget,
                 const MeshLimits& limits = {});
  ~Spool();
  const std::string& directory() const { return directory_; }
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  std::size_t memory_budget() const { return memory_budget_; }
  const MeshLimits& limits() const { return limits_; }
  // Returns the size in bytes of all pages that have been written at least once.
  std::uint64_t paged_bytes() const { return pages_written_ * kPageBytes; }
  std::size_t resident_bytes() const { return frames_.resident_bytes(); }

 private:
  friend class PagedArray;
  using Frame = PageFrames::Frame;

  // Returns the bytes of a page. The pointer is valid until the next call to page().
  std::byte* page(std::uint64_t number, bool for_writing) {
    Frame* frame = frames_.find(number);
    if (frame == nullptr) frame = load(number);
    if (for_writing && !frame->dirty) begin_writing(*frame);
    return frame->bytes.get();
  }
  std::uint64_t reserve_pages(std::uint64_t count);
  Frame* load(std::uint64_t number);
  void begin_writing(Frame& frame);
  bool take_small(std::size_t bytes);  // returns false if the budget of small arrays is exhausted
  void write_out(const Frame& frame);

  std::string directory_;
  std::size_t memory_budget_;
  MeshLimits limits_;
  PageFrames frames_;
  int descriptor_ = -1;
  std::size_t small_room_;          // remaining budget of small arrays, in bytes
  std::vector<bool> ever_written_;  // for each page: true if it has been written
  std::uint64_t pages_written_ = 0;
};

// Returns the memory limit in bytes for the topology that the library keeps while a mesh is
// converted through `spool`.
inline std::size_t kept_topology_bytes(const Spool& spool) {
  return std::min(spool.memory_budget() / 4, std::size_t{64} << 20);
}
/// Returns the memory limit in bytes for values of earlier time steps (see
/// WriteOptions::kept_steps_bytes).
inline std::size_t kept_steps_bytes(const Spool& spool) { return spool.memory_budget() / 2; }

// An array of elements of `element_bytes` bytes each. Elements are zero until they are written.
// Writing past the end makes the array longer. The array uses its Spool, which must outlive it.
// Throws Failure on a disk error.
class PagedArray {
 public:
  PagedArray(Spool& spool, std::size_t element_bytes);
  PagedArray(PagedArray&&) = default;
  PagedArray& operator=(PagedArray&&) = default;

  std::uint64_t size() const { return size_; }  // number of elements: 1 + highest index written
  void read(std::uint64_t first, std::uint64_t count, std::byte* out);
  void write(std::uint64_t first, std::uint64_t count, const std::byte* in);
  void append(std::uint64_t count, const std::byte* in) { write(size_, count, in); }
  // Reads one element of type T.
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
  // True if no element of type T crosses a page boundary.
  template <class T>
  static constexpr bool kNeverSplit = Spool::kPageBytes % sizeof(T) == 0;
  // Number of consecutive pages that are reserved together. Their total size is 1 MiB.
  static constexpr std::uint64_t kExtentPages = 16;

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
  std::vector<std::byte> small_;        // the bytes of all elements if the array is small (extents_
                                        // is empty)
  std::vector<std::uint64_t> extents_;  // first page number of each extent
};

// A random-access table in a spool with one number per vertex or cell. All numbers are initially
// zero. Each number uses 4 bytes if the largest number fits into 4 bytes, and 8 bytes otherwise.
class NumberTable {
 public:
  static constexpr std::uint64_t kAnyNumber = std::numeric_limits<std::uint64_t>::max();

  // `most` is the largest number that will be written.
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

// A cache for random access to single elements of data that can be read efficiently only in runs.
// Each fetch reads a page of consecutive elements. If accesses are mostly to nearby elements, about
// one fetch per page is needed. The memory is limited by PageFrames.
class PageCache {
 public:
  // Fills `out` with `count` elements, starting at element `first`.
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

  // Returns an element. Precondition: index < elements. The pointer is valid until the next call.
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

// A long list of numbers, which is written front to back and read in runs. If the list begins with
// 0, 1, 2, ..., these numbers need no storage. The numbers after them use 4 bytes each. From the
// first number that does not fit into 4 bytes, all numbers use 8 bytes each.
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
  // Reads `count` numbers into `out`, starting with the number at index `first`. Precondition:
  // first + count <= size().
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
  // Calls visit(index, number) for each number in the list.
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

  // The list consists of three parts. The first `counted_` numbers are 0, 1, 2, ... and are not
  // stored. The next numbers are in `narrow_`, with 4 bytes each. The rest, from the first number
  // that needs more than 4 bytes on, are in `wide_`, with 8 bytes each.
  std::uint64_t counted_ = 0;
  PagedArray narrow_, wide_;
  std::uint64_t size_ = 0;
  std::vector<std::uint64_t> tail_;   // most recently added numbers, not yet in narrow_ or wide_
  std::vector<std::uint32_t> piece_;  // buffer
};

// Returns the inverse of the permutation `order`: a table that contains the position of each number
// in `order`. Throws Failure (corrupt) unless `order` contains each number below `size` exactly
// once. `what` is the kind of the numbers for the error message, e.g. "vertex".
NumberTable invert(NumberList& order, std::uint64_t size, const char* what, Spool& spool);

}  // namespace shm::converters
