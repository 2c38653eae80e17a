// Packed blobs: blobs that are stored raw or compressed with zstd, whichever is smaller. Packing
// also tries byte planes for large blobs and a dictionary for small blobs. The unpacking functions
// do not call packing functions, so a program that only reads does not link a compressor.
// spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"

namespace shm {

/// Methods that put_packed() may use.
enum class Packing {
  none,   ///< blobs are stored raw
  plain,  ///< blobs are packed with the methods that readers of format version 0.9 can unpack
  with_dictionary,  ///< blobs are packed with any method, including the dictionary
  bounded,  ///< blobs are packed as with `plain`, but the unpacked size is at most 256 times the
            ///< packed size
};
/// Writes a packed blob. It consists of the method (one byte: 0 raw, 1 zstd, 2 zstd of planes, 3
/// zstd with the dictionary), the unpacked length (not with method 3), the number of planes (only
/// with method 2) and the packed data. A packed blob of n bytes never unpacks to more than
/// most_unpacked(n) bytes.
void put_packed(ByteWriter& out, std::span<const std::byte> blob, Packing packing = Packing::plain);

/// Largest ratio of unpacked to packed size of a blob, in files of version 0.10. Frozen: part of
/// the format.
inline constexpr std::uint64_t kMostUnpackedEach = 256;
inline constexpr std::uint64_t most_unpacked(std::uint64_t packed) {
  constexpr std::uint64_t kAnyway = std::uint64_t{1} << 24;
  return kAnyway + kMostUnpackedEach * packed;
}

/// Memory budget of a reader for the unpacked blobs of a file. Blobs contain everything except the
/// mesh and its values.
class UnpackBudget {
 public:
  /// Sets the memory limit in bytes, `most`, which is ReadLimits::max_unpacked_bytes.
  explicit UnpackBudget(std::uint64_t most) : most_(most) {}

  /// Returns the number of bytes that the reader may still use. `file_bytes` is the size of the
  /// file, or the number of bytes read so far if the size is unknown.
  std::uint64_t left(std::uint64_t file_bytes) const {
    const std::uint64_t all = limit_with(most_, kMostUnpackedEach, file_bytes);
    return all - std::min(taken_, all);
  }
  void take(std::uint64_t bytes) { taken_ += std::min(bytes, ~taken_); }

 private:
  std::uint64_t most_, taken_ = 0;
};

/// Reusable zstd compression context. (Creating a context takes as long as packing a few
/// kilobytes.) Throws std::bad_alloc if zstd runs out of memory.
class ZstdCompressor {
 public:
  ZstdCompressor();
  ~ZstdCompressor();
  ZstdCompressor(ZstdCompressor&&) noexcept;
  ZstdCompressor& operator=(ZstdCompressor&&) noexcept;

  /// Compresses `bytes` and returns one frame, which is valid until the next call.
  std::span<const std::byte> compress(std::span<const std::byte> bytes, int level);

 private:
  struct Context;
  std::unique_ptr<Context> context_;  // zstd context; created by the first call
};

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level);

/// Unpacks all remaining bytes of `in`. Returns nullopt if the bytes are damaged or unpack to more
/// than `limit` bytes. The memory needed grows with the number of bytes actually unpacked, not with
/// the length stated in the blob.
std::optional<std::vector<std::byte>> get_packed(ByteReader& in, std::uint64_t limit);

/// Returns the unpacked length that a blob states, without advancing the caller's reader.
std::uint64_t stated_packed_size(ByteReader in);

/// Reusable zstd decompression context. Throws std::bad_alloc if zstd runs out of memory.
class ZstdDecompressor {
 public:
  ZstdDecompressor();
  ~ZstdDecompressor();
  ZstdDecompressor(ZstdDecompressor&&) noexcept;
  ZstdDecompressor& operator=(ZstdDecompressor&&) noexcept;

  /// Decompresses a single frame into `out`. Returns false unless the output has exactly `size`
  /// bytes.
  bool decompress(std::span<const std::byte> bytes, std::uint64_t size,
                  std::vector<std::byte>& out);

 private:
  struct Context;
  std::unique_ptr<Context> context_;  // zstd context; created by the first call
};

/// Decompresses one frame. Returns nullopt unless the output has exactly `size` bytes.
std::optional<std::vector<std::byte>> zstd_decompress(std::span<const std::byte> bytes,
                                                      std::uint64_t size);

}  // namespace shm
