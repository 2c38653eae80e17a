// MpiRanks: the processes of an MPI program.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "exodus/parts/ranks.h"

namespace shm::converters {

class MpiRanks final : public Ranks {
 public:
  // Initializes MPI. The destructor finalizes MPI. A process may create only one MpiRanks object.
  MpiRanks(int* argc, char*** argv);
  ~MpiRanks() override;
  // Ends all processes immediately. Call this if an error occurs on one rank outside of together(),
  // the function in which ranks agree on errors.
  [[noreturn]] static void abort(int code);
  // Calls `complain`, which must report an error and return an exit code. Then ends all processes
  // with this exit code. If `complain` runs out of memory, abort_with() reports that instead.
  [[noreturn]] static void abort_with(const std::function<int()>& complain) noexcept;

  void uninterrupted(const std::function<void()>& calls) override;
  void agree(const std::optional<Error>& error) override;
  std::uint64_t largest(std::uint64_t value) override;
  std::uint64_t smallest(std::uint64_t value) override;
  Sums sums(std::vector<std::uint64_t> values) override;
  std::uint64_t broadcast(std::uint64_t value, std::size_t from = 0) override;
  std::vector<std::byte> broadcast(std::vector<std::byte> bytes, std::size_t from = 0) override;
  void gather(std::span<const std::byte> bytes,
              const std::function<void(std::size_t, std::vector<std::byte>)>& take) override;

 private:
  using Place = std::pair<std::size_t, std::size_t>;  // rank and number of ranks
  explicit MpiRanks(Place place) : Ranks(place.first, place.second) {}

  std::vector<std::byte> exchange_bytes(std::vector<std::byte> packed,
                                        std::vector<std::size_t>& bytes) override;
};

}  // namespace shm::converters
