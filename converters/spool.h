// Spool: large arrays on their way between formats, in bounded memory.
// A PagedArray is an array of fixed-size elements that may be read and written anywhere; what
// does not fit the memory budget goes to an unlinked temporary file, so nothing is left behind
// on any exit. Pages are fetched and evicted least recently used first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace shm::converters {

// Where pages of many arrays live. Shares one memory budget and one temporary file.
class Spool {
 public:
  // `directory`: where the temporary file is made when it is first needed.
  explicit Spool(std::string directory, std::size_t memory_budget = std::size_t{64} << 20);
  ~Spool();
  const std::string& directory() const { return directory_; }
  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;

  static constexpr std::size_t kPageBytes = 64 * 1024;

 private:
  friend class PagedArray;
  struct Page {
    std::unique_ptr<std::byte[]> bytes;
    bool dirty = false;
    std::list<std::uint64_t>::iterator age;
  };
  std::byte* page(std::uint64_t number, bool for_writing);  // valid until the next call
  std::uint64_t reserve_pages(std::uint64_t count);
  void evict_one();

  std::string directory_;
  std::size_t max_pages_;
  int descriptor_ = -1;
  std::uint64_t next_page_ = 0;
  std::list<std::uint64_t> by_age_;  // front: most recent
  std::unordered_map<std::uint64_t, Page> resident_;
};

// Elements of `element_bytes` each, zero until written, growing as they are written.
// Borrowed from its Spool, which must outlive it. Throws Failure when the disk fails.
class PagedArray {
 public:
  PagedArray(Spool& spool, std::size_t element_bytes);

  std::uint64_t size() const { return size_; }  // elements, one past the highest written
  void read(std::uint64_t first, std::uint64_t count, std::byte* out);
  void write(std::uint64_t first, std::uint64_t count, const std::byte* in);
  void append(std::uint64_t count, const std::byte* in) { write(size_, count, in); }
  template <class T>
  T get(std::uint64_t index) {
    T value;
    read(index, 1, reinterpret_cast<std::byte*>(&value));
    return value;
  }
  template <class T>
  void set(std::uint64_t index, const T& value) {
    write(index, 1, reinterpret_cast<const std::byte*>(&value));
  }

 private:
  static constexpr std::uint64_t kExtentPages = 16;  // pages reserved together: 1 MiB of file
  std::byte* at(std::uint64_t byte, bool for_writing);

  Spool* spool_;
  std::size_t element_bytes_;
  std::uint64_t size_ = 0;
  std::vector<std::uint64_t> extents_;  // first page number of each extent
};

}  // namespace shm::converters
