// StepStore and StepBytes: values of earlier steps, in memory up to a limit. Values beyond the
// limit are in a StepSpace.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "shm/result.h"

namespace shm {

/// Storage outside of memory, which can be written and read at any offset.
class StepSpace {
 public:
  virtual ~StepSpace() = default;
  virtual Result<void> write(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
  /// Fills the whole of `into` with the bytes at `offset`. Precondition: they have been written.
  virtual Result<void> read(std::uint64_t offset, std::span<std::byte> into) = 0;
};

/// Where values of earlier steps are stored.
struct KeptSteps {
  std::uint64_t memory = std::uint64_t{1} << 27;  ///< memory limit in bytes
  /// Creates the space for values that exceed the limit. If it is empty, they are an error.
  std::function<Result<std::unique_ptr<StepSpace>>()> make_space;
};

/// The memory and the space that several StepBytes share.
class StepStore {
 public:
  explicit StepStore(KeptSteps kept) : kept_(std::move(kept)), memory_left_(kept_.memory) {}
  std::uint64_t memory_left() const { return memory_left_; }

 private:
  friend class StepBytes;

  Result<std::uint64_t> allocate(std::uint64_t bytes);

  KeptSteps kept_;
  std::uint64_t memory_left_;
  std::unique_ptr<StepSpace> space_;
  std::uint64_t space_end_ = 0;
};

/// A sequence of bytes that is written in pieces, and read at any offset.
class StepBytes {
 public:
  /// Creates an empty sequence. `store` must outlive it. `capacity` is the largest size in bytes.
  /// The sequence is in memory if `capacity` bytes of memory are left.
  StepBytes(StepStore& store, std::uint64_t capacity);
  ~StepBytes();
  StepBytes(StepBytes&& other) noexcept;
  StepBytes& operator=(StepBytes&&) = delete;

  std::uint64_t size() const { return size_; }
  std::uint64_t capacity() const { return capacity_; }
  /// Writes bytes at `offset`. Precondition: `offset` is at most size().
  Result<void> write(std::uint64_t offset, std::span<const std::byte> bytes);
  /// Returns `count` bytes from `offset`. The result is valid until the next call of a function of
  /// this object. Precondition: they have been written.
  Result<std::span<const std::byte>> read(std::uint64_t offset, std::size_t count);

 private:
  StepStore* store_;
  std::uint64_t capacity_, size_ = 0;
  bool in_memory_;
  std::vector<std::byte> bytes_;        // all bytes, or those that were read most recently
  std::optional<std::uint64_t> begin_;  // offset of the sequence in the space
};

}  // namespace shm
