// Packed blobs out again, and frames of zstd. The mirror of packing.h. spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"

namespace shm {

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
