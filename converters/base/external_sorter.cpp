#include "base/external_sorter.h"

#include <algorithm>
#include <cstring>
#include <limits>

namespace shm::converters {
namespace {

// Size in bytes of the cache for the temporary file. Runs are written and read front to back, so a
// few pages suffice.
constexpr std::size_t kFileBytes = 8 * Spool::kPageBytes;
constexpr std::size_t kMostHeld = std::numeric_limits<std::uint32_t>::max();

}  // namespace

ExternalSorter::ExternalSorter(std::string directory, std::size_t record_bytes, std::size_t memory)
    : directory_(std::move(directory)), record_bytes_(record_bytes), memory_(memory) {}

void ExternalSorter::add(std::uint64_t key, const std::byte* record) {
  // Size of the address space to reserve, in bytes. Memory is needed only for pages that have been
  // written.
  constexpr std::size_t kReserved = std::size_t{1} << 28;
  const std::size_t held = entries_.size(), bytes = sizeof(Entry) + record_bytes_;
  const std::size_t most = std::clamp<std::size_t>(memory_ / bytes, 1, kMostHeld);
  if (held >= most) write_run();
  if (entries_.size() == entries_.capacity()) {
    const std::size_t room = std::min(most, std::max(2 * held, kReserved / bytes));
    entries_.reserve(room);
    records_.reserve(room * record_bytes_);
  }
  entries_.push_back({key, static_cast<std::uint32_t>(entries_.size())});
  if (record_bytes_ > 0) records_.insert(records_.end(), record, record + record_bytes_);
  ++size_;
}

void ExternalSorter::sort_held() { std::sort(entries_.begin(), entries_.end()); }

void ExternalSorter::write_run() {
  if (!spool_) {
    spool_ = std::make_unique<Spool>(directory_, kFileBytes);
    file_ = std::make_unique<PagedArray>(*spool_, 1);
  }
  sort_held();
  const std::uint64_t begin = file_->size();
  std::vector<std::byte> piece;
  const std::size_t stride = stored_bytes();
  const std::size_t most = std::max<std::size_t>(Spool::kPageBytes / stride, 1);
  for (std::size_t first = 0; first < entries_.size(); first += most) {
    const std::size_t count = std::min(most, entries_.size() - first);
    piece.resize(count * stride);
    for (std::size_t i = 0; i < count; ++i) {
      const Entry& entry = entries_[first + i];
      std::byte* out = piece.data() + i * stride;
      std::memcpy(out, &entry.key, sizeof entry.key);
      if (record_bytes_ > 0)
        std::memcpy(out + sizeof entry.key, records_.data() + entry.place * record_bytes_,
                    record_bytes_);
    }
    file_->append(piece.size(), piece.data());
  }
  extent_.emplace_back(begin, file_->size());
  entries_.clear();
  records_.clear();
}

std::size_t ExternalSorter::most_runs() const {
  return std::max<std::size_t>(memory_ / std::max(Spool::kPageBytes, stored_bytes()), 2);
}

// Merges runs until few enough remain to merge all of them in one final pass. Only adjacent runs
// are merged, in order, so records with equal keys keep their order.
void ExternalSorter::begin_merge() {
  if (!entries_.empty()) write_run();
  // Assigning a new vector frees the memory; assigning {} would keep it.
  entries_ = decltype(entries_)();
  records_ = decltype(records_)();
  std::vector<std::byte> piece;
  while (extent_.size() > most_runs()) {
    std::vector<std::pair<std::uint64_t, std::uint64_t>> merged;
    for (std::size_t first = 0; first < extent_.size(); first += most_runs()) {
      open_runs(first, std::min(first + most_runs(), extent_.size()));
      const std::uint64_t begin = file_->size();
      std::uint64_t key;
      const std::byte* record;
      while (next_merged(key, record)) {
        const auto* bytes = reinterpret_cast<const std::byte*>(&key);
        piece.insert(piece.end(), bytes, bytes + sizeof key);
        if (record_bytes_ > 0) piece.insert(piece.end(), record, record + record_bytes_);
        if (piece.size() < Spool::kPageBytes) continue;
        file_->append(piece.size(), piece.data());
        piece.clear();
      }
      file_->append(piece.size(), piece.data());
      piece.clear();
      merged.emplace_back(begin, file_->size());
    }
    extent_ = std::move(merged);
  }
  open_runs(0, extent_.size());
}

void ExternalSorter::open_runs(std::size_t first, std::size_t last) {
  const std::size_t stride = stored_bytes();
  run_bytes_ = std::max(memory_ / (last - first) / stride, std::size_t{1}) * stride;
  runs_.clear();
  any_ = false;
  for (std::size_t i = first; i < last; ++i) {
    runs_.push_back({extent_[i].first, extent_[i].second, {}, 0});
    if (!fill(runs_.back())) continue;
    std::uint64_t key;
    std::memcpy(&key, runs_.back().held.data(), sizeof key);
    heads_.emplace(key, runs_.size() - 1);
  }
}

// Buffers the next records of a run. Returns false at the end of the run.
bool ExternalSorter::fill(Run& run) {
  const std::uint64_t bytes = std::min<std::uint64_t>(run_bytes_, run.end - run.next);
  run.at = 0;
  if (bytes == 0) {
    run.held = std::vector<std::byte>();
    return false;
  }
  run.held.resize(bytes);
  file_->read(run.next, bytes, run.held.data());
  run.next += bytes;
  return true;
}

bool ExternalSorter::next_merged(std::uint64_t& key, const std::byte*& record) {
  if (any_) {
    Run& run = runs_[last_];
    run.at += stored_bytes();
    any_ = false;
    if (run.at < run.held.size() || fill(run)) {
      std::uint64_t head;
      std::memcpy(&head, run.held.data() + run.at, sizeof head);
      heads_.emplace(head, last_);
    }
  }
  if (heads_.empty()) return false;
  last_ = heads_.top().second;
  heads_.pop();
  any_ = true;
  const std::byte* stored = runs_[last_].held.data() + runs_[last_].at;
  std::memcpy(&key, stored, sizeof key);
  record = stored + sizeof key;
  return true;
}

bool ExternalSorter::next(std::uint64_t& key, const std::byte*& record) {
  if (!ended_) {
    ended_ = true;
    if (spool_)
      begin_merge();
    else
      sort_held();
  }
  if (spool_) return next_merged(key, record);
  if (at_ == entries_.size()) return false;
  const Entry& entry = entries_[at_++];
  key = entry.key;
  record = records_.data() + entry.place * record_bytes_;
  return true;
}

}  // namespace shm::converters
