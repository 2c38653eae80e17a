#include "packing.h"

#include <zstd.h>

#include <algorithm>
#include <memory>

namespace shm {

namespace {

// Room for what is stated is made at once while it is no more than a small multiple of the input.
constexpr std::uint64_t kTrustedFactor = 32, kTrustedBytes = std::uint64_t{1} << 17;

struct FreeContext {
  void operator()(ZSTD_CCtx* it) const { ZSTD_freeCCtx(it); }
  void operator()(ZSTD_DCtx* it) const { ZSTD_freeDCtx(it); }
};

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
    if (ZSTD_isError(state) != 0) return false;
    if (state == 0) break;
    if (piece.pos == 0 && in.pos == in.size) return false;  // ends too early
  }
  return in.pos == in.size && out.size() == size;
}

}  // namespace

struct Zstd::Contexts {
  std::unique_ptr<ZSTD_CCtx, FreeContext> compress;
  std::unique_ptr<ZSTD_DCtx, FreeContext> decompress;
};

Zstd::Zstd() : contexts_(std::make_unique<Contexts>()) {}
Zstd::~Zstd() = default;
Zstd::Zstd(Zstd&&) noexcept = default;
Zstd& Zstd::operator=(Zstd&&) noexcept = default;

void Zstd::compress(std::span<const std::byte> bytes, int level, std::vector<std::byte>& out) {
  auto& context = contexts_->compress;
  if (!context) context.reset(ZSTD_createCCtx());
  if (!context) return;
  const std::size_t before = out.size();
  out.resize(before + ZSTD_compressBound(bytes.size()));
  const std::size_t n = ZSTD_compressCCtx(context.get(), out.data() + before, out.size() - before,
                                          bytes.data(), bytes.size(), level);
  out.resize(before + (ZSTD_isError(n) != 0 ? 0 : n));
}

bool Zstd::decompress(std::span<const std::byte> bytes, std::uint64_t size,
                      std::vector<std::byte>& out) {
  auto& context = contexts_->decompress;
  if (!context) context.reset(ZSTD_createDCtx());
  if (!context) return false;
  ZSTD_DCtx_reset(context.get(), ZSTD_reset_session_only);
  if (size > kTrustedBytes + kTrustedFactor * bytes.size())
    return decompress_in_steps(context.get(), bytes, size, out);
  const std::size_t frame = ZSTD_findFrameCompressedSize(bytes.data(), bytes.size());
  if (ZSTD_isError(frame) != 0 || frame != bytes.size()) return false;
  if ((ByteReader(bytes).get_u32() & 0xfffffff0u) == ZSTD_MAGIC_SKIPPABLE_START) return false;
  out.resize(static_cast<std::size_t>(size));
  const std::size_t n =
      ZSTD_decompressDCtx(context.get(), out.data(), out.size(), bytes.data(), bytes.size());
  return ZSTD_isError(n) == 0 && n == size;
}

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level) {
  std::vector<std::byte> out;
  Zstd().compress(bytes, level, out);
  return out;
}

std::optional<std::vector<std::byte>> zstd_decompress(std::span<const std::byte> bytes,
                                                      std::uint64_t size) {
  std::vector<std::byte> out;
  if (!Zstd().decompress(bytes, size, out)) return std::nullopt;
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
