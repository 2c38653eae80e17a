#include "base/packing.h"

#define ZSTD_STATIC_LINKING_ONLY  // declares the functions with custom allocators
#include <zstd.h>
#include <zstd_errors.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <new>
#include <utility>

#include "base/dictionary.h"

namespace shm {
namespace {

/// Method codes of packed blobs, as stored in the file.
constexpr std::uint8_t kRaw = 0, kFrame = 1, kPlanes = 2, kWithDictionary = 3;
/// Largest unpacked size in bytes of a blob that is packed with the dictionary. Larger blobs would
/// hardly benefit from the dictionary.
constexpr std::uint64_t kMostWithDictionary = std::uint64_t{1} << 20;
/// Magic number at the start of every zstd frame. Frames that use the dictionary are stored without
/// the magic number.
constexpr std::array<std::byte, 4> kMagic = {std::byte{0x28}, std::byte{0xb5}, std::byte{0x2f},
                                             std::byte{0xfd}};

/// Returns `context`, which a zstd function has created. If it is null, zstd has run out of memory,
/// and the function throws std::bad_alloc, as for any other failed allocation (shm/result.h).
template <class Context>
Context* made_by_zstd(Context* context) {
  if (context == nullptr) throw std::bad_alloc();
  return context;
}
/// Returns true if a call to zstd failed. If it failed because memory ran out, throws
/// std::bad_alloc instead.
bool zstd_failed(std::size_t result) {
  if (ZSTD_isError(result) == 0) return false;
  if (ZSTD_getErrorCode(result) == ZSTD_error_memory_allocation) throw std::bad_alloc();
  return true;
}

}  // namespace

// --- packing

struct ZstdCompressor::Context {
  Context() : zstd(made_by_zstd(ZSTD_createCCtx())) {}
  ~Context() { ZSTD_freeCCtx(zstd); }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;
  ZSTD_CCtx* zstd;
  std::vector<std::byte> room;
};

ZstdCompressor::ZstdCompressor() = default;
ZstdCompressor::~ZstdCompressor() = default;
ZstdCompressor::ZstdCompressor(ZstdCompressor&&) noexcept = default;
ZstdCompressor& ZstdCompressor::operator=(ZstdCompressor&&) noexcept = default;

std::span<const std::byte> ZstdCompressor::compress(std::span<const std::byte> bytes, int level) {
  if (!context_) context_ = std::make_unique<Context>();
  std::vector<std::byte>& room = context_->room;
  room.resize(std::max(room.size(), ZSTD_compressBound(bytes.size())));
  const std::size_t n = ZSTD_compressCCtx(context_->zstd, room.data(), room.size(), bytes.data(),
                                          bytes.size(), level);
  if (zstd_failed(n)) throw std::bad_alloc();  // no other error can occur
  return std::span(room).first(n);
}

std::vector<std::byte> zstd_compress(std::span<const std::byte> bytes, int level) {
  ZstdCompressor zstd;
  const auto frame = zstd.compress(bytes, level);
  return {frame.begin(), frame.end()};
}

namespace {

/// Size thresholds in bytes. Blobs of at least kPlanesFrom bytes mostly consist of numbers, so
/// packing also tries byte planes. Blobs of more than kQuickFrom bytes are packed at a lower
/// compression level, which is several times faster.
constexpr std::size_t kPlanesFrom = std::size_t{1} << 16, kQuickFrom = std::size_t{1} << 20;

/// Returns the blob in byte planes: bytes 0, width, 2 * width, ..., then bytes 1, width + 1, and so
/// on.
std::vector<std::byte> in_planes(std::span<const std::byte> blob, std::size_t width) {
  std::vector<std::byte> planes;
  planes.reserve(blob.size());
  for (std::size_t plane = 0; plane < width; ++plane)
    for (std::size_t position = plane; position < blob.size(); position += width)
      planes.push_back(blob[position]);
  return planes;
}

/// Returns the number of byte planes for which the compressed size of a sample of the blob is
/// smallest. The result is 1 if planes do not help.
std::size_t best_width(std::span<const std::byte> blob) {
  constexpr std::size_t kSample = std::size_t{1} << 18;
  constexpr int kLevel = 3;
  const std::size_t size = std::min(blob.size(), kSample);
  const auto sample = blob.subspan((blob.size() - size) / 2, size);
  std::size_t best = 1, least = zstd_compress(sample, kLevel).size();
  // Candidate widths in bytes, e.g. the sizes of records of one to four numbers.
  for (const std::size_t width : {4, 8, 12, 16, 24, 32}) {
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

/// Memory that is allocated in advance for the digested dictionary, since zstd does not check
/// whether this one allocation fails. allocate() recognizes zstd's request for this memory by its
/// size: all earlier requests are smaller.
class DictionaryMemory {
 public:
  DictionaryMemory(std::size_t dictionary, int level)
      : least_(dictionary),
        most_(2 * ZSTD_estimateCDictSize(dictionary, level)),
        bytes_(new std::byte[most_]) {}

  ZSTD_customMem allocator() {
    return {[](void* memory, std::size_t size) {
              return static_cast<DictionaryMemory*>(memory)->allocate(size);
            },
            [](void* memory, void* place) { static_cast<DictionaryMemory*>(memory)->free(place); },
            this};
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
  const auto words = dictionary();
  DictionaryMemory memory(words.size(), level);
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(
      made_by_zstd(ZSTD_createCCtx_advanced(memory.allocator())), &ZSTD_freeCCtx);
  std::vector<std::byte> frame(ZSTD_compressBound(blob.size()));
  const auto checked = [](std::size_t result) {
    if (zstd_failed(result)) throw std::bad_alloc();  // no other error can occur
    return result;
  };
  checked(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, level));
  checked(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_dictIDFlag, 0));
  checked(ZSTD_CCtx_loadDictionary(context.get(), words.data(), words.size()));
  frame.resize(
      checked(ZSTD_compress2(context.get(), frame.data(), frame.size(), blob.data(), blob.size())));
  frame.erase(frame.begin(), frame.begin() + kMagic.size());
  return frame;
}

/// Packs the blob with each permitted method and returns the smallest result.
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

/// Packs the blob with a zstd window of 1 KiB. A block of such a frame contains at most 1 KiB and
/// needs at least four bytes. The unpacked size is thus at most 256 times the packed size.
Packed packed_within_bound(std::span<const std::byte> blob, std::size_t width) {
  constexpr int kLevel = 12, kWindowLog = 10;
  static_assert((1 << kWindowLog) / 4 == kMostUnpackedEach);
  const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(
      made_by_zstd(ZSTD_createCCtx()), &ZSTD_freeCCtx);
  const auto checked = [](std::size_t result) {
    if (zstd_failed(result)) throw std::bad_alloc();  // no other error can occur
    return result;
  };
  checked(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel));
  checked(ZSTD_CCtx_setParameter(context.get(), ZSTD_c_windowLog, kWindowLog));
  const auto planes = in_planes(blob, width);
  std::vector<std::byte> frame(ZSTD_compressBound(planes.size()));
  frame.resize(checked(
      ZSTD_compress2(context.get(), frame.data(), frame.size(), planes.data(), planes.size())));
  if (frame.size() >= blob.size()) return {kRaw, 1, {blob.begin(), blob.end()}};
  return {width > 1 ? kPlanes : kFrame, width, std::move(frame)};
}

}  // namespace

void put_packed(ByteWriter& out, std::span<const std::byte> blob, Packing packing) {
  Packed packed_blob = packed(blob, packing);
  if (packing == Packing::bounded || blob.size() > most_unpacked(packed_blob.bytes.size()))
    packed_blob = packed_within_bound(blob, packed_blob.width);
  out.put_u8(packed_blob.method);
  if (packed_blob.method != kWithDictionary) out.put_varint(blob.size());
  if (packed_blob.method == kPlanes) out.put_u8(static_cast<std::uint8_t>(packed_blob.width));
  out.put_bytes(packed_blob.bytes);
}

// --- unpacking

namespace {

// Limits below which the unpacked size that a frame states is trusted. If the stated size is at
// most kTrustedBytes + kTrustedFactor times the input size, all memory is allocated in advance.
// Otherwise the output grows piece by piece.
constexpr std::uint64_t kTrustedFactor = 32, kTrustedBytes = std::uint64_t{1} << 17;

/// Returns true if decoding the frame needs a window of at most kMostWindow bytes. Also returns
/// true for bytes that are not a frame, since zstd rejects them later. See RFC 8878, 3.1.1.1.
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

/// Returns true if `bytes` is exactly one frame and not a skippable frame.
bool is_one_frame(std::span<const std::byte> bytes) {
  const std::size_t frame = ZSTD_findFrameCompressedSize(bytes.data(), bytes.size());
  if (ZSTD_isError(frame) != 0 || frame != bytes.size()) return false;
  return (ByteReader(bytes).get_u32() & 0xfffffff0u) != ZSTD_MAGIC_SKIPPABLE_START;
}

/// Decompresses a frame whose stated size is not trusted. The memory needed grows with the actual
/// output, not with the stated size.
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
    if (piece.pos == 0 && in.pos == in.size)
      return false;  // the input ends before the end of the frame
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
    for (std::size_t position = plane; position < blob.size(); position += width)
      blob[position] = planes[next++];
  return blob;
}

std::vector<std::byte> with_magic(std::span<const std::byte> bytes) {
  std::vector<std::byte> frame(kMagic.size() + bytes.size());
  std::copy(bytes.begin(), bytes.end(), std::copy(kMagic.begin(), kMagic.end(), frame.begin()));
  return frame;
}
/// Returns the content size stated in a frame without magic number, or nullopt if the frame states
/// none.
std::optional<std::uint64_t> stated_by_frame(std::span<const std::byte> bytes) {
  constexpr std::size_t kMostHeader = 14;
  const auto head = with_magic(bytes.first(std::min(bytes.size(), kMostHeader)));
  const unsigned long long size = ZSTD_getFrameContentSize(head.data(), head.size());
  if (size >= ZSTD_CONTENTSIZE_ERROR) return std::nullopt;
  return size;
}

/// Unpacks a frame that was packed with the dictionary. The frame must state its size, which must
/// be at most `limit` bytes.
std::optional<std::vector<std::byte>> unpack_with_dictionary(std::span<const std::byte> bytes,
                                                             std::uint64_t limit) {
  const std::vector<std::byte> frame = with_magic(bytes);
  const auto size = stated_by_frame(bytes);
  if (!size || *size > std::min(limit, kMostWithDictionary)) return std::nullopt;
  if (!has_small_window(frame) || !is_one_frame(frame)) return std::nullopt;
  const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(
      made_by_zstd(ZSTD_createDCtx()), &ZSTD_freeDCtx);
  std::vector<std::byte> blob(static_cast<std::size_t>(*size));
  const auto words = dictionary();
  const std::size_t n =
      ZSTD_decompress_usingDict(context.get(), blob.data(), blob.size(), frame.data(), frame.size(),
                                words.data(), words.size());
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
