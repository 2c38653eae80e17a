// ExternalSorter: sorts any number of records by key in bounded memory. Records are collected in
// memory. When the memory is full, they are sorted and appended to a temporary file as a run. At
// the end the runs are merged. Each run is read front to back, so the disk accesses are sequential.
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
  // `record_bytes` is the size of a record without its key; it may be 0. `memory` is a budget in
  // bytes. The sorter needs memory for one record and for one page of each of two runs, even if
  // this exceeds the budget. The temporary file is created in the folder `directory` when it is
  // first needed.
  ExternalSorter(std::string directory, std::size_t record_bytes, std::size_t memory);

  std::uint64_t size() const { return size_; }
  // Adds a record. Must not be called after next(). Like next(), throws Failure on a disk error.
  void add(std::uint64_t key, const std::byte* record);
  // Stores the next record and its key in `record` and `key`. Returns false after the last of the
  // records. Records arrive in ascending order of their keys; records with equal keys arrive in the
  // order in which they were added. `record` is valid until the next call.
  bool next(std::uint64_t& key, const std::byte*& record);

 private:
  struct Entry {
    std::uint64_t key;
    std::uint32_t place;  // index of the record in records_
    bool operator<(const Entry& other) const {
      return key != other.key ? key < other.key : place < other.place;
    }
  };
  // A run: sorted records in the file, of which the next few are buffered in memory.
  struct Run {
    // byte range, in the file, of the unread part of the run
    std::uint64_t next = 0, end = 0;
    std::vector<std::byte> held;
    std::size_t at = 0;  // position in `held`
  };
  // Key of a run's next record, and index of the run. If two keys are equal, the run with the lower
  // index comes first.
  using Head = std::pair<std::uint64_t, std::size_t>;

  std::size_t stored_bytes() const { return sizeof(std::uint64_t) + record_bytes_; }
  std::size_t most_runs() const;
  void sort_held();
  void write_run();
  void begin_merge();
  // Opens the runs `first` to `last` - 1 of the file for merging.
  void open_runs(std::size_t first, std::size_t last);
  bool next_merged(std::uint64_t& key, const std::byte*& record);
  bool fill(Run& run);

  std::string directory_;
  std::size_t record_bytes_, memory_;
  std::uint64_t size_ = 0;
  std::vector<Entry> entries_;
  std::vector<std::byte> records_;
  std::size_t at_ = 0;  // index of the next entry in entries_; used if all records fit in memory
  bool ended_ = false;

  std::unique_ptr<Spool> spool_;
  std::unique_ptr<PagedArray> file_;                             // all runs, as bytes
  std::vector<std::pair<std::uint64_t, std::uint64_t>> extent_;  // byte range of each run
  std::vector<Run> runs_;                                        // runs that are being merged
  std::size_t run_bytes_ = 0;                                    // buffer size of each run
  std::priority_queue<Head, std::vector<Head>, std::greater<>> heads_;
  std::size_t last_ = 0;  // index of the run whose record next_merged() returned most recently
  bool any_ = false;      // true: next_merged() has returned a record
};

}  // namespace shm::converters
