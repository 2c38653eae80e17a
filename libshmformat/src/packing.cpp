#include "packing.h"

#include <zstd.h>

#include <algorithm>
#include <memory>

namespace shm {

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level) {
  std::vector<std::byte> out(ZSTD_compressBound(bytes.size()));
  const std::size_t n = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
  out.resize(ZSTD_isError(n) != 0 ? 0 : n);
  return out;
}

std::optional<std::vector<std::byte>> zstd_decompress(std::span<const std::byte> bytes,
                                                      std::uint64_t size) {
  const std::unique_ptr<ZSTD_DStream, decltype(&ZSTD_freeDStream)> stream(ZSTD_createDStream(),
                                                                          &ZSTD_freeDStream);
  if (!stream) return std::nullopt;
  std::vector<std::byte> out;
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  while (true) {
    const std::size_t before = out.size();
    const std::size_t step = std::clamp<std::size_t>(before, 1 << 16, 1 << 24);
    if (before > size) return std::nullopt;
    out.resize(before + step);
    ZSTD_outBuffer piece{out.data() + before, step, 0};
    const std::size_t state = ZSTD_decompressStream(stream.get(), &piece, &in);
    out.resize(before + piece.pos);
    if (ZSTD_isError(state) != 0) return std::nullopt;
    if (state == 0) break;
    if (piece.pos == 0 && in.pos == in.size) return std::nullopt;  // ends too early
  }
  if (in.pos != in.size || out.size() != size) return std::nullopt;
  return out;
}

void put_packed(ByteWriter& out, std::span<const std::byte> blob) {
  std::vector<std::byte> packed;
  if (blob.size() > 64) packed = zstd_compress(blob, 19);
  const bool smaller = !packed.empty() && packed.size() < blob.size();
  out.put_u8(smaller ? 1 : 0);
  out.put_varint(blob.size());
  out.put_bytes(smaller ? std::span<const std::byte>(packed) : blob);
}

std::uint64_t stated_packed_size(ByteReader in) {
  in.get_u8();
  return in.get_varint();
}

std::optional<std::vector<std::byte>> get_packed(ByteReader& in, std::uint64_t limit) {
  const std::uint8_t method = in.get_u8();
  const std::uint64_t size = in.get_varint();
  const auto bytes = in.get_bytes(in.left());
  if (!in.ok() || size > limit || method > 1) return std::nullopt;
  if (method == 1) return zstd_decompress(bytes, size);
  if (bytes.size() != size) return std::nullopt;
  return std::vector<std::byte>(bytes.begin(), bytes.end());
}

}  // namespace shm
