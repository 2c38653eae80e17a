// Ranks: the processes that share the work on one mesh, and how they go on or fail together. What
// goes wrong on one rank is thrown on all, where they next agree, so that no rank waits for one
// that has left. As it stands here, one process alone; those of an MPI program are mpi/mpi_ranks.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/failure.h"

namespace shm::converters {

// Thrown on all ranks alike; reported by rank 0 alone.
class SharedFailure : public Failure {
 public:
  using Failure::Failure;
};

// What a caught exception is to the tool; inside of a catch only.
Error current_error();

class Ranks {
 public:
  Ranks() = default;  // one process alone
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  std::size_t rank() const { return rank_; }
  std::size_t size() const { return size_; }
  bool first() const { return rank_ == 0; }

  // Every rank runs its `work`; throws SharedFailure on all where it threw on any, that of the
  // lowest rank. `work` must not call other ranks, unless all do it in
  // the same order, by calls that begin with agree() and are uninterrupted().
  void together(const std::function<void()>& work);
  // Ends all processes where anything but SharedFailure is thrown between calls of other ranks; one
  // alone may throw what it likes.
  virtual void uninterrupted(const std::function<void()>& calls) { calls(); }
  // The same as together() where the work has been done, and has failed or not.
  virtual void agree(const std::optional<Error>& error) {
    if (error) throw SharedFailure(*error);
  }

  // Collective, as all that follows.
  virtual std::uint64_t largest(std::uint64_t value) { return value; }
  virtual std::uint64_t smallest(std::uint64_t value) { return value; }
  // By place: what ranks before this one have in sum, and what all have.
  struct Sums {
    std::vector<std::uint64_t> before, all;
  };
  virtual Sums sums(std::vector<std::uint64_t> values) {
    return {std::vector<std::uint64_t>(values.size()), std::move(values)};
  }
  // The values of the rank `from` to all.
  virtual std::uint64_t broadcast(std::uint64_t value, std::size_t /*from*/ = 0) { return value; }
  virtual std::vector<std::byte> broadcast(std::vector<std::byte> bytes, std::size_t /*from*/ = 0) {
    return bytes;
  }
  // take(rank, bytes) for each rank, in order, on rank 0 alone.
  virtual void gather(std::span<const std::byte> bytes,
                      const std::function<void(std::size_t, std::vector<std::byte>)>& take) {
    take(0, {bytes.begin(), bytes.end()});
  }
  // to[r] goes to rank r; returns what has come from each. Few enough for one message.
  template <class Item>
  std::vector<std::vector<Item>> exchange(const std::vector<std::vector<Item>>& to) {
    static_assert(std::is_trivially_copyable_v<Item>);
    std::vector<std::size_t> bytes(size_);
    std::vector<std::byte> packed;
    for (std::size_t r = 0; r < size_; ++r) {
      const auto part = std::as_bytes(std::span(to[r]));
      packed.insert(packed.end(), part.begin(), part.end());
      bytes[r] = part.size();
    }
    const std::vector<std::byte> got = exchange_bytes(std::move(packed), bytes);
    std::vector<std::vector<Item>> from(size_);
    std::size_t at = 0;
    for (std::size_t r = 0; r < size_; at += bytes[r++]) {
      from[r].resize(bytes[r] / sizeof(Item));
      const auto out = std::as_writable_bytes(std::span(from[r]));
      std::copy_n(got.begin() + static_cast<std::ptrdiff_t>(at), out.size(), out.begin());
    }
    return from;
  }

 protected:
  Ranks(std::size_t rank, std::size_t size) : rank_(rank), size_(size) {}

 private:
  // `bytes`: how many go to each rank; then, how many came from each.
  virtual std::vector<std::byte> exchange_bytes(std::vector<std::byte> packed,
                                                std::vector<std::size_t>& /*bytes*/) {
    return packed;
  }

  std::size_t rank_ = 0, size_ = 1;
};

}  // namespace shm::converters
