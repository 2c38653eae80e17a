// Ranks: the processes that share the work on one mesh. The ranks continue or fail together: after
// an exception on one rank, the next call to agree() throws on all ranks. Otherwise a rank could
// wait forever for a rank that has failed. The class Ranks itself represents a single process;
// mpi/mpi_ranks.h implements the ranks of an MPI program.
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

// An exception that is thrown on all ranks; only rank 0 reports it to the user.
class SharedFailure : public Failure {
 public:
  using Failure::Failure;
};

// Converts the current exception to an Error. Must be called in a catch block.
Error current_error();

class Ranks {
 public:
  Ranks() = default;  // a single process
  virtual ~Ranks() = default;
  Ranks(const Ranks&) = delete;
  Ranks& operator=(const Ranks&) = delete;

  std::size_t rank() const { return rank_; }
  std::size_t size() const { return size_; }
  bool first() const { return rank_ == 0; }

  // Runs `work` on every rank. If `work` throws on any rank, SharedFailure is thrown on all ranks,
  // with the error of the lowest rank that failed. `work` must not communicate with other ranks,
  // with one exception. It may call functions that communicate if these functions call agree()
  // before any other communication, if all ranks call them in the same order, and if the calls are
  // inside uninterrupted().
  void together(const std::function<void()>& work);
  // Runs `calls`, a function that communicates with other ranks. If `calls` throws anything other
  // than SharedFailure, all processes are terminated. If there is only one process, any exception
  // is passed on.
  virtual void uninterrupted(const std::function<void()>& calls) { calls(); }
  // Collective. Like together(), but the work has already been done. `error` is the error that
  // occurred on this rank, or empty if its work succeeded.
  virtual void agree(const std::optional<Error>& error) {
    if (error) throw SharedFailure(*error);
  }

  // largest() and all functions below are collective: every rank must call them. Returns the
  // largest value of all ranks.
  virtual std::uint64_t largest(std::uint64_t value) { return value; }
  virtual std::uint64_t smallest(std::uint64_t value) { return value; }
  // Sums across ranks, one for each value: `before` contains the sums over all lower ranks, `all`
  // the sums over all ranks.
  struct Sums {
    std::vector<std::uint64_t> before, all;
  };
  virtual Sums sums(std::vector<std::uint64_t> values) {
    return {std::vector<std::uint64_t>(values.size()), std::move(values)};
  }
  // Returns, on all ranks, the value that the rank `from` has passed.
  virtual std::uint64_t broadcast(std::uint64_t value, std::size_t /*from*/ = 0) { return value; }
  virtual std::vector<std::byte> broadcast(std::vector<std::byte> bytes, std::size_t /*from*/ = 0) {
    return bytes;
  }
  // Sends `bytes` of each rank to rank 0. Rank 0 calls take(rank, bytes) for each rank, in order of
  // the ranks. Other ranks do not call take().
  virtual void gather(std::span<const std::byte> bytes,
                      const std::function<void(std::size_t, std::vector<std::byte>)>& take) {
    take(0, {bytes.begin(), bytes.end()});
  }
  // Sends the items in to[r] to rank r, for each rank r. Element r of the result contains the items
  // that rank r has sent to this rank. All items for one rank must fit in a single message.
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
    std::size_t offset = 0;
    for (std::size_t r = 0; r < size_; offset += bytes[r++]) {
      from[r].resize(bytes[r] / sizeof(Item));
      const auto out = std::as_writable_bytes(std::span(from[r]));
      std::copy_n(got.begin() + static_cast<std::ptrdiff_t>(offset), out.size(), out.begin());
    }
    return from;
  }

 protected:
  Ranks(std::size_t rank, std::size_t size) : rank_(rank), size_(size) {}

 private:
  // `bytes` contains the number of bytes to send to each rank. When the function returns, it
  // contains the number of bytes received from each rank.
  virtual std::vector<std::byte> exchange_bytes(std::vector<std::byte> packed,
                                                std::vector<std::size_t>& /*bytes*/) {
    return packed;
  }

  std::size_t rank_ = 0, size_ = 1;
};

}  // namespace shm::converters
