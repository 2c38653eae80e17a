// Blobs are packed: as they stand or under zstd, whichever is smaller; large ones also with their
// bytes in planes, small ones with the dictionary. What unpacks them needs nothing of what packs
// them, so that a program that only reads links no compressor. spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"

namespace shm {

/// Which methods a blob may be packed by.
enum class Packing {
  none,             ///< as it stands
  plain,            ///< those that readers of 0.9 know
  with_dictionary,  ///< all
  bounded,          ///< those of plain, so that it unpacks to at most 256 times its bytes
};
/// One byte of method (0 raw, 1 zstd, 2 zstd of planes, 3 zstd with the dictionary), but for 3 the
/// unpacked length, for planes how many there are, the bytes. No more is made of it than
/// most_unpacked() of these.
void put_packed(ByteWriter& out, std::span<const std::byte> blob, Packing packing = Packing::plain);

/// What a blob of so many packed bytes may unpack to in files of 0.10. Frozen: part of the format.
inline constexpr std::uint64_t kMostUnpackedEach = 256;
inline constexpr std::uint64_t most_unpacked(std::uint64_t packed) {
  constexpr std::uint64_t kAnyway = std::uint64_t{1} << 24;
  return kAnyway + kMostUnpackedEach * packed;
}

/// What a file holds beside its mesh and values takes no more memory than there is budget for.
class UnpackBudget {
 public:
  /// `most`: ReadLimits::max_unpacked_bytes.
  explicit UnpackBudget(std::uint64_t most) : most_(most) {}

  /// What is left where the file has so many bytes, or so many have been read of it.
  std::uint64_t left(std::uint64_t file_bytes) const {
    const std::uint64_t all = limit_with(most_, kMostUnpackedEach, file_bytes);
    return all - std::min(taken_, all);
  }
  void take(std::uint64_t bytes) { taken_ += std::min(bytes, ~taken_); }

 private:
  std::uint64_t most_, taken_ = 0;
};

/// A context of zstd that is used again: making one costs as much as packing some kilobytes. Where
/// zstd has no memory, std::bad_alloc.
class ZstdCompressor {
 public:
  ZstdCompressor();
  ~ZstdCompressor();
  ZstdCompressor(ZstdCompressor&&) noexcept;
  ZstdCompressor& operator=(ZstdCompressor&&) noexcept;

  /// One frame; valid until the next one.
  std::span<const std::byte> compress(std::span<const std::byte> bytes, int level);

 private:
  struct Context;
  std::unique_ptr<Context> context_;  // from the first call on
};

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level);

/// Takes all that is left of `in`; nothing when it is damaged or longer than `limit`.
/// Memory grows with what really comes out, not with what the header states.
std::optional<std::vector<std::byte>> get_packed(ByteReader& in, std::uint64_t limit);

/// The unpacked length that a blob states; takes nothing from `in`.
std::uint64_t stated_packed_size(ByteReader in);

/// A context of zstd that is used again. Where zstd has no memory, std::bad_alloc.
class ZstdDecompressor {
 public:
  ZstdDecompressor();
  ~ZstdDecompressor();
  ZstdDecompressor(ZstdDecompressor&&) noexcept;
  ZstdDecompressor& operator=(ZstdDecompressor&&) noexcept;

  /// Exactly `size` bytes into `out`; false where the one frame gives others.
  bool decompress(std::span<const std::byte> bytes, std::uint64_t size,
                  std::vector<std::byte>& out);

 private:
  struct Context;
  std::unique_ptr<Context> context_;  // from the first call on
};

/// Exactly `size` bytes, or nothing.
std::optional<std::vector<std::byte>> zstd_decompress(std::span<const std::byte> bytes,
                                                      std::uint64_t size);

}  // namespace shm
