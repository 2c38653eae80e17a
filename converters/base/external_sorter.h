// ExternalSorter: records by their keys, however many there are, in bounded memory.
// Runs that fit the memory are sorted and go to a temporary file, one behind the other; they come
// back merged, front to back, so the disk is never read in any order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <queue>
#include <string>
#include <utility>
#include <vector>

#include "base/spool.h"

namespace shm::converters {

class ExternalSorter {
 public:
  // `record_bytes`: of a record without its key; may be 0. `memory`: bytes, for at least one record
  // and a page of each of two runs. `directory`: of the temporary file, made when it is needed.
  ExternalSorter(std::string directory, std::size_t record_bytes, std::size_t memory);

  std::uint64_t size() const { return size_; }
  // Must not come after next(). Throws Failure when the disk fails, as next() does.
  void add(std::uint64_t key, const std::byte* record);
  // The records in ascending order of keys, equal ones in the order in which they were added.
  // False at the end. `record` is valid until the next call.
  bool next(std::uint64_t& key, const std::byte*& record);

 private:
  struct Entry {
    std::uint64_t key;
    std::uint32_t place;  // in records_
    bool operator<(const Entry& other) const {
      return key != other.key ? key < other.key : place < other.place;
    }
  };
  // Sorted records in the file, of which some are in memory.
  struct Run {
    std::uint64_t next = 0, end = 0;  // of what is still in the file
    std::vector<std::byte> held;
    std::size_t at = 0;  // in held
  };
  using Head = std::pair<std::uint64_t, std::size_t>;  // key, run: the earlier of equal ones first

  std::size_t stored_bytes() const { return sizeof(std::uint64_t) + record_bytes_; }
  std::size_t most_runs() const;
  void sort_held();
  void write_run();
  void begin_merge();
  // Merges runs [first, last) from the file.
  void open_runs(std::size_t first, std::size_t last);
  bool next_merged(std::uint64_t& key, const std::byte*& record);
  bool fill(Run& run);

  std::string directory_;
  std::size_t record_bytes_, memory_;
  std::uint64_t size_ = 0;
  std::vector<Entry> entries_;
  std::vector<std::byte> records_;
  std::size_t at_ = 0;  // in entries_, where all is in memory
  bool ended_ = false;

  std::unique_ptr<Spool> spool_;
  std::unique_ptr<PagedArray> file_;                             // runs, in bytes
  std::vector<std::pair<std::uint64_t, std::uint64_t>> extent_;  // of each run in the file
  std::vector<Run> runs_;                                        // those that are being merged
  std::size_t run_bytes_ = 0;                                    // of each in memory
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::size_t last_ = 0;  // the run whose record was handed out
  bool any_ = false;      // there is one
};

}  // namespace shm::converters
