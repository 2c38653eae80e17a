// Spool: large arrays on their way between formats, in bounded memory.
// A PagedArray is an array of fixed-size elements that may be read and written anywhere; what
// does not fit the memory goes to an unlinked temporary file, so nothing is left behind on any
// exit. How much memory that is, PageFrames says. Arrays that fit in a small part of a page stay
// out of pages while they fit the budget once more: a file may have very many.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "base/page_frames.h"

namespace shm::converters {

// Where pages of many arrays live. Shares one memory budget and one temporary file. For one thread.
class Spool {
 public:
  static constexpr std::size_t kPageBytes = 64 * 1024;
  static constexpr std::size_t kSmallBytes = 4 * 1024;  // arrays up to here need no page
  static constexpr std::size_t kStartBytes = std::size_t{8} << 20;
  static constexpr std::size_t kUsualBudget = std::size_t{256} << 20;

  // `directory`: where the temporary file is made when it is first needed. `memory_budget`: bytes
  // that pages here take at most, with what others hold beside them: half of it is for pages, a
  // quarter for caches, a quarter for what the library keeps.
  explicit Spool(std::string directory, std::size_t memory_budget = kUsualBudget);
  ~Spool();
  const std::string& directory() const { return directory_; }
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  std::size_t memory_budget() const { return memory_budget_; }
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

}  // namespace shm::converters
