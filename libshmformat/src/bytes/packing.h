// Packing: blobs (schema, extras, step times) as they stand or under zstd, whichever is smaller;
// large ones also with their bytes in planes.
// spec: "Packed blobs"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"

namespace shm {

/// One byte of method (0 raw, 1 zstd, 2 zstd of planes), the unpacked length, for planes how many
/// there are, the bytes.
void put_packed(ByteWriter& out, std::span<const std::byte> blob);
/// Takes all that is left of `in`; nothing when it is damaged or longer than `limit`.
/// Memory grows with what really comes out, not with what the header states.
std::optional<std::vector<std::byte>> get_packed(ByteReader& in, std::uint64_t limit);

/// The unpacked length that a blob states; takes nothing from `in`.
std::uint64_t stated_packed_size(ByteReader in);

/// Contexts of zstd that are used again: making one costs as much as packing some kilobytes. Where
/// zstd has no memory, std::bad_alloc.
class Zstd {
 public:
  Zstd();
  ~Zstd();
  Zstd(Zstd&&) noexcept;
  Zstd& operator=(Zstd&&) noexcept;

  /// Appends one frame to `out`.
  void compress(std::span<const std::byte> bytes, int level, std::vector<std::byte>& out);
  /// Exactly `size` bytes into `out`; false where the one frame gives others.
  bool decompress(std::span<const std::byte> bytes, std::uint64_t size,
                  std::vector<std::byte>& out);

 private:
  struct Contexts;
  std::unique_ptr<Contexts> contexts_;
};

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level);
/// Exactly `size` bytes, or nothing.
std::optional<std::vector<std::byte>> zstd_decompress(std::span<const std::byte> bytes,
                                                      std::uint64_t size);

}  // namespace shm
