#include "bytes/packing.h"

#define ZSTD_STATIC_LINKING_ONLY  // allocators
#include <zstd.h>

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "bytes/packed_blobs.h"

namespace shm {

struct ZstdCompressor::Context {
  Context() : zstd(made_by_zstd(ZSTD_createCCtx())) {}
  ~Context() { ZSTD_freeCCtx(zstd); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ZSTD_CCtx* zstd;
};

ZstdCompressor::ZstdCompressor() = default;
ZstdCompressor::~ZstdCompressor() = default;
ZstdCompressor::ZstdCompressor(ZstdCompressor&&) noexcept = default;
ZstdCompressor& ZstdCompressor::operator=(ZstdCompressor&&) noexcept = default;

void ZstdCompressor::compress(std::span<const std::byte> bytes, int level,
                              std::vector<std::byte>& out) {
  if (!context_) context_ = std::make_unique<Context>();
  const std::size_t before = out.size();
  out.resize(before + ZSTD_compressBound(bytes.size()));
  const std::size_t n = ZSTD_compressCCtx(context_->zstd, out.data() + before, out.size() - before,
                                          bytes.data(), bytes.size(), level);
  if (zstd_failed(n)) throw std::bad_alloc();  // there is room, and it refuses nothing else
  out.resize(before + n);
}

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level) {
  std::vector<std::byte> out;
  ZstdCompressor().compress(bytes, level, out);
  return out;
}

namespace {

/// Large blobs are mostly numbers: of them, rows of equal width are looked for. The largest are
/// packed with less effort, several times faster.
constexpr std::size_t kPlanesFrom = std::size_t{1} << 16, kQuickFrom = std::size_t{1} << 20;

/// Bytes 0, width, 2 width ..., then 1, width + 1, and so on.
std::vector<std::byte> in_planes(std::span<const std::byte> blob, std::size_t width) {
  std::vector<std::byte> planes;
  planes.reserve(blob.size());
  for (std::size_t plane = 0; plane < width; ++plane)
    for (std::size_t at = plane; at < blob.size(); at += width) planes.push_back(blob[at]);
  return planes;
}

/// The width of planes that packs a sample best; 1: as it stands.
std::size_t best_width(std::span<const std::byte> blob) {
  constexpr std::size_t kSample = std::size_t{1} << 18;
  constexpr int kLevel = 3;
  const std::size_t size = std::min(blob.size(), kSample);
  const auto sample = blob.subspan((blob.size() - size) / 2, size);
  std::size_t best = 1, least = zstd_compress(sample, kLevel).size();
  for (const std::size_t width : {4, 8, 12, 16, 24, 32}) {  // for example one to four numbers
    const std::size_t bytes = zstd_compress(in_planes(sample, width), kLevel).size();
    if (bytes >= least) continue;
    least = bytes;
    best = width;
  }
  return best;
}

struct Packed {
  std::uint8_t method = kRaw;
  std::size_t width = 1;
  std::vector<std::byte> bytes;
};

/// Memory that is there already for the one allocation that zstd does not check, of its dictionary
/// made ready; smaller ones come before it.
class DictionaryMemory {
 public:
  DictionaryMemory(std::size_t dictionary, int level)
      : least_(dictionary),
        most_(2 * ZSTD_estimateCDictSize(dictionary, level)),
        bytes_(new std::byte[most_]) {}

  ZSTD_customMem allocator() {
    return {[](void* its, std::size_t size) {
              return static_cast<DictionaryMemory*>(its)->allocate(size);
            },
            [](void* its, void* place) { static_cast<DictionaryMemory*>(its)->free(place); }, this};
  }

 private:
  void* allocate(std::size_t size) {
    if (void* place = std::malloc(size)) return place;
    if (size <= least_ || size > most_ || taken_) return nullptr;
    taken_ = true;
    return bytes_.get();
  }
  void free(void* place) {
    if (place == bytes_.get())
      taken_ = false;
    else
      std::free(place);
  }

  std::size_t least_, most_;
  std::unique_ptr<std::byte[]> bytes_;
  bool taken_ = false;
};

std::vector<std::byte> pack_with_dictionary(std::span<const std::byte> blob, int level) {
  const auto& dictionary = the_dictionary();
  DictionaryMemory memory(dictionary.size(), level);
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(
      made_by_zstd(ZSTD_createCCtx_advanced(memory.allocator())), &ZSTD_freeCCtx);
  std::vector<std::byte> frame(ZSTD_compressBound(blob.size()));
  const auto checked = [](std::size_t result) {
    if (zstd_failed(result)) throw std::bad_alloc();  // there is room, and it refuses nothing else
    return result;
  };
  checked(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level));
  checked(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_dictIDFlag, 0));
  checked(ZSTD_CCtx_loadDictionary(context.get(), dictionary.data(), dictionary.size()));
  frame.resize(
      checked(ZSTD_compress2(context.get(), frame.data(), frame.size(), blob.data(), blob.size())));
  frame.erase(frame.begin(), frame.begin() + kMagic.size());
  return frame;
}

/// The smallest of what the methods make of a blob.
Packed packed(std::span<const std::byte> blob, Packing packing) {
  constexpr int kStrong = 19, kQuick = 12;
  constexpr std::size_t kLeast = 64;
  const int level = blob.size() <= kQuickFrom ? kStrong : kQuick;
  Packed best{kRaw, 1, {blob.begin(), blob.end()}};
  const auto take = [&](std::uint8_t method, std::size_t width, std::vector<std::byte> bytes) {
    if (bytes.size() < best.bytes.size()) best = {method, width, std::move(bytes)};
  };
  if (packing == Packing::none) return best;
  if (blob.size() > kLeast) {
    const std::size_t width = blob.size() >= kPlanesFrom ? best_width(blob) : 1;
    if (width > 1)
      take(kPlanes, width, zstd_compress(in_planes(blob, width), level));
    else
      take(kFrame, 1, zstd_compress(blob, level));
  }
  if (packing == Packing::with_dictionary && blob.size() > kLeast && blob.size() < kPlanesFrom)
    take(kWithDictionary, 1, pack_with_dictionary(blob, level));
  return best;
}

}  // namespace

void put_packed(ByteWriter& out, std::span<const std::byte> blob, Packing packing) {
  const Packed it = packed(blob, packing);
  out.put_u8(it.method);
  if (it.method != kWithDictionary) out.put_varint(blob.size());
  if (it.method == kPlanes) out.put_u8(static_cast<std::uint8_t>(it.width));
  out.put_bytes(it.bytes);
}

}  // namespace shm
