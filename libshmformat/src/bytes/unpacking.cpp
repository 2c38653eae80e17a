#include "bytes/unpacking.h"

#include <zstd.h>

#include <algorithm>
#include <array>

#include "bytes/packed_blobs.h"

namespace shm {
namespace {

// Room for what is stated is made at once while it is no more than a small multiple of the input.
constexpr std::uint64_t kTrustedFactor = 32, kTrustedBytes = std::uint64_t{1} << 17;

/// The window that a frame needs, which no decoder may have to hold beyond this. What is no
/// frame at all is left to zstd. RFC 8878, 3.1.1.1
constexpr std::uint64_t kMostWindow = std::uint64_t{1} << 27;
bool has_small_window(std::span<const std::byte> frame) {
  ByteReader in(frame);
  if (in.get_u32() != ZSTD_MAGICNUMBER) return true;
  const std::uint8_t descriptor = in.get_u8();
  const bool single_segment = (descriptor & 0x20) != 0;
  if (!single_segment) {
    const std::uint8_t window = in.get_u8();
    const std::uint64_t base = std::uint64_t{1} << (10 + (window >> 3));
    return base + base / 8 * (window & 7) <= kMostWindow;
  }
  constexpr std::array<std::size_t, 4> kIdBytes = {0, 1, 2, 4}, kSizeBytes = {1, 2, 4, 8};
  (void)in.get_bytes(kIdBytes[descriptor & 3]);
  std::uint64_t size = 0;
  const std::size_t bytes = kSizeBytes[descriptor >> 6];
  for (std::size_t i = 0; i < bytes; ++i) size |= std::uint64_t{in.get_u8()} << (8 * i);
  return size <= kMostWindow;
}

/// Whether all of `bytes` is one frame, which is not one to be skipped.
bool is_one_frame(std::span<const std::byte> bytes) {
  const std::size_t frame = ZSTD_findFrameCompressedSize(bytes.data(), bytes.size());
  if (ZSTD_isError(frame) != 0 || frame != bytes.size()) return false;
  return (ByteReader(bytes).get_u32() & 0xfffffff0u) != ZSTD_MAGIC_SKIPPABLE_START;
}

/// For frames that state more than is believed: memory grows with what comes out.
bool decompress_in_steps(ZSTD_DCtx* context, std::span<const std::byte> bytes, std::uint64_t size,
                         std::vector<std::byte>& out) {
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  out.clear();
  while (true) {
    const std::size_t before = out.size();
    const std::size_t step = std::clamp<std::size_t>(before, 1 << 16, 1 << 24);
    if (before > size) return false;
    out.resize(before + step);
    ZSTD_outBuffer piece{out.data() + before, step, 0};
    const std::size_t state = ZSTD_decompressStream(context, &piece, &in);
    out.resize(before + piece.pos);
    if (zstd_failed(state)) return false;
    if (state == 0) break;
    if (piece.pos == 0 && in.pos == in.size) return false;  // ends too early
  }
  return in.pos == in.size && out.size() == size;
}

}  // namespace

struct ZstdDecompressor::Context {
  Context() : zstd(made_by_zstd(ZSTD_createDCtx())) {}
  ~Context() { ZSTD_freeDCtx(zstd); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ZSTD_DCtx* zstd;
};

ZstdDecompressor::ZstdDecompressor() = default;
ZstdDecompressor::~ZstdDecompressor() = default;
ZstdDecompressor::ZstdDecompressor(ZstdDecompressor&&) noexcept = default;
ZstdDecompressor& ZstdDecompressor::operator=(ZstdDecompressor&&) noexcept = default;

bool ZstdDecompressor::decompress(std::span<const std::byte> bytes, std::uint64_t size,
                                  std::vector<std::byte>& out) {
  if (!has_small_window(bytes)) return false;
  if (!context_) context_ = std::make_unique<Context>();
  ZSTD_DCtx_reset(context_->zstd, ZSTD_reset_session_only);
  if (size > kTrustedBytes + kTrustedFactor * bytes.size())
    return decompress_in_steps(context_->zstd, bytes, size, out);
  if (!is_one_frame(bytes)) return false;
  out.resize(static_cast<std::size_t>(size));
  const std::size_t n =
      ZSTD_decompressDCtx(context_->zstd, out.data(), out.size(), bytes.data(), bytes.size());
  return !zstd_failed(n) && n == size;
}

std::optional<std::vector<std::byte>> zstd_decompress(std::span<const std::byte> bytes,
                                                      std::uint64_t size) {
  std::vector<std::byte> out;
  if (!ZstdDecompressor().decompress(bytes, size, out)) return std::nullopt;
  return out;
}

namespace {

std::vector<std::byte> from_planes(std::span<const std::byte> planes, std::size_t width) {
  std::vector<std::byte> blob(planes.size());
  std::size_t next = 0;
  for (std::size_t plane = 0; plane < width; ++plane)
    for (std::size_t at = plane; at < blob.size(); at += width) blob[at] = planes[next++];
  return blob;
}

std::vector<std::byte> with_magic(std::span<const std::byte> bytes) {
  std::vector<std::byte> frame(kMagic.size() + bytes.size());
  std::copy(bytes.begin(), bytes.end(), std::copy(kMagic.begin(), kMagic.end(), frame.begin()));
  return frame;
}
/// What a frame without its magic number unpacks to, if it says so.
std::optional<std::uint64_t> stated_by_frame(std::span<const std::byte> bytes) {
  constexpr std::size_t kMostHeader = 14;
  const auto head = with_magic(bytes.first(std::min(bytes.size(), kMostHeader)));
  const unsigned long long size = ZSTD_getFrameContentSize(head.data(), head.size());
  if (size >= ZSTD_CONTENTSIZE_ERROR) return std::nullopt;
  return size;
}

/// What a frame holds that was made with the dictionary: as much as it states, `limit` at most.
std::optional<std::vector<std::byte>> unpack_with_dictionary(std::span<const std::byte> bytes,
                                                             std::uint64_t limit) {
  const std::vector<std::byte> frame = with_magic(bytes);
  const auto size = stated_by_frame(bytes);
  if (!size || *size > std::min(limit, kMostWithDictionary)) return std::nullopt;
  if (!has_small_window(frame) || !is_one_frame(frame)) return std::nullopt;
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(
      made_by_zstd(ZSTD_createDCtx()), &ZSTD_freeDCtx);
  std::vector<std::byte> blob(static_cast<std::size_t>(*size));
  const auto& with = the_dictionary();
  const std::size_t n =
      ZSTD_decompress_usingDict(context.get(), blob.data(), blob.size(), frame.data(), frame.size(),
                                with.data(), with.size());
  if (zstd_failed(n) || n != *size) return std::nullopt;
  return blob;
}

}  // namespace

std::uint64_t stated_packed_size(ByteReader in) {
  if (in.get_u8() != kWithDictionary) return in.get_varint();
  return stated_by_frame(in.get_bytes(in.left())).value_or(0);
}

std::optional<std::vector<std::byte>> get_packed(ByteReader& in, std::uint64_t limit) {
  const std::uint8_t method = in.get_u8();
  if (method == kWithDictionary) return unpack_with_dictionary(in.get_bytes(in.left()), limit);
  const std::uint64_t size = in.get_varint();
  const std::size_t width = method == kPlanes ? in.get_u8() : 1;
  const auto bytes = in.get_bytes(in.left());
  if (!in.ok() || size > limit || method > kPlanes || width == 0) return std::nullopt;
  if (method == kRaw) {
    if (bytes.size() != size) return std::nullopt;
    return std::vector<std::byte>(bytes.begin(), bytes.end());
  }
  auto blob = zstd_decompress(bytes, size);
  if (blob && width > 1) blob = from_planes(*blob, width);
  return blob;
}

}  // namespace shm
