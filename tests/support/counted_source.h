// In-memory sources that record which bytes of a file are read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/io.h"

namespace shm {

/// Counts the bytes that are read.
class CountedSource final : public RandomSource {
 public:
  explicit CountedSource(std::span<const std::byte> file) : source_(file) {}
  std::uint64_t size() const override { return source_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    bytes += into.size();
    return source_.read_at(offset, into);
  }
  std::uint64_t bytes = 0;

 private:
  MemoryRandomSource source_;
};

/// Counts the calls to prefetch(), and the bytes that are read although no earlier call to
/// prefetch() announced them.
class ToldSource final : public RandomSource {
 public:
  explicit ToldSource(std::span<const std::byte> file) : source_(file) {}
  std::uint64_t size() const override { return source_.size(); }
  void prefetch(std::span<const ByteRange> ranges) override {
    ++calls;
    told_.insert(told_.end(), ranges.begin(), ranges.end());
  }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    for (std::uint64_t byte = offset; byte < offset + into.size(); ++byte)
      untold += std::none_of(told_.begin(), told_.end(), [&](const ByteRange& range) {
        return byte >= range.offset && byte - range.offset < range.bytes;
      });
    return source_.read_at(offset, into);
  }
  std::uint64_t untold = 0, calls = 0;

 private:
  MemoryRandomSource source_;
  std::vector<ByteRange> told_;
};

/// Remembers which bytes were read.
class WatchedSource final : public RandomSource {
 public:
  explicit WatchedSource(std::span<const std::byte> file) : touched(file.size()), source_(file) {}
  std::uint64_t size() const override { return source_.size(); }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    if (auto status = source_.read_at(offset, into); !status) return status;
    for (std::size_t i = 0; i < into.size(); ++i) touched[offset + i] = true;
    return {};
  }
  void forget() { touched.assign(touched.size(), false); }
  std::vector<bool> touched;

 private:
  MemoryRandomSource source_;
};

}  // namespace shm
