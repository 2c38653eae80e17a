#include "archive/parity.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#define XXH_INLINE_ALL
#include <xxhash.h>

#ifdef SHM_HAS_ISAL
#include <isa-l/erasure_code.h>
#endif

#include "base/failure.h"
#include "base/lenient_source.h"

namespace shm::converters {
namespace {

constexpr std::size_t kHeaderBytes = 40, kPacketBytes = kHeaderBytes + kParityBlockBytes;
constexpr std::size_t kTrailerBytes = 16;
constexpr std::size_t kChecksumsEach = kParityBlockBytes / 4;
constexpr std::uint32_t kMostBlocks = 255;  // largest number of blocks per stripe
constexpr std::string_view kMark = "SHMP";
// Number of bytes per read.
constexpr std::uint64_t kWindowBytes = std::uint64_t{1} << 20;

enum PacketKind : std::uint8_t { kChecksums = 1, kParity = 2 };

std::uint32_t checksum(std::span<const std::byte> bytes) {
  return static_cast<std::uint32_t>(XXH64(bytes.data(), bytes.size(), 0));
}

void put(std::byte* out, std::uint64_t value, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) out[i] = static_cast<std::byte>(value >> 8 * i);
}
std::uint64_t get(const std::byte* in, std::size_t bytes) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes; ++i) value |= std::to_integer<std::uint64_t>(in[i]) << 8 * i;
  return value;
}

#ifndef SHM_HAS_ISAL
[[noreturn]] void fail_without_codes() {
  throw Failure(
      Error{.code = ErrorCode::misuse,
            .detail = "this shm was built without ISA-L, which is needed to write and use parity",
            .section = "parity"});
}
#endif

// Fills `into` with the bytes of the file that begin at `offset`. Stores zeros in place of all
// bytes at and after the offset `end`.
void read_padded(RandomSource& file, std::uint64_t end, std::uint64_t offset,
                 std::span<std::byte> into) {
  const auto there =
      offset < end ? static_cast<std::size_t>(std::min<std::uint64_t>(end - offset, into.size()))
                   : 0;
  if (there > 0) unwrap(file.read_at(offset, into.first(there)), {});
  std::fill(into.begin() + static_cast<std::ptrdiff_t>(there), into.end(), std::byte{0});
}

// Returns the checksums of all blocks of the file.
std::vector<std::uint32_t> block_checksums(RandomSource& file, const ParityShape& shape,
                                           const Progress& progress, std::string_view phase) {
  std::vector<std::uint32_t> checksums;
  checksums.reserve(shape.blocks());
  std::vector<std::byte> window(kWindowBytes);
  for (std::uint64_t offset = 0; offset < shape.protected_bytes; offset += window.size()) {
    if (progress) progress(phase, offset, shape.protected_bytes);
    read_padded(file, shape.protected_bytes, offset, window);
    for (std::size_t b = 0; b < window.size() && checksums.size() < shape.blocks();
         b += kParityBlockBytes)
      checksums.push_back(checksum(std::span(window).subspan(b, kParityBlockBytes)));
  }
  return checksums;
}

#ifdef SHM_HAS_ISAL
// Number of stripes that are coded together.
constexpr std::uint64_t kStripesAtOnce = 16;

using Bytes = std::vector<unsigned char>;

// Returns the element of the Cauchy matrix in row `row` (a parity block) and column `position` (a
// data block of the stripe).
unsigned char coefficient(const ParityShape& shape, std::uint32_t row, std::uint32_t position) {
  return ::gf_inv(static_cast<unsigned char>((shape.data + row) ^ position));
}

// Multiplies `matrix` by the blocks `sources` and stores the product in the blocks `coded`. The
// matrix has one row per coded block and one column per source block. Each block has `bytes` bytes.
void multiply(Bytes& matrix, std::size_t bytes, std::vector<unsigned char*>& sources,
              std::vector<unsigned char*>& coded) {
  const int columns = static_cast<int>(sources.size()), rows = static_cast<int>(coded.size());
  Bytes tables(32 * sources.size() * coded.size());
  ::ec_init_tables(columns, rows, matrix.data(), tables.data());
  ::ec_encode_data(static_cast<int>(bytes), columns, rows, tables.data(), sources.data(),
                   coded.data());
}
#endif

}  // namespace

struct ParityPacket {
  ParityShape shape;
  std::uint32_t set = 0;
  PacketKind kind = kChecksums;
  std::uint64_t number = 0;
  bool again = false;  // true: this is the second copy of a checksum packet; not stored in the
                       // header

  std::array<std::byte, kHeaderBytes> header(std::uint32_t payload_checksum) const {
    std::array<std::byte, kHeaderBytes> out{};
    std::memcpy(out.data(), kMark.data(), kMark.size());
    put(&out[4], kind, 1);
    put(&out[6], shape.data, 1);
    put(&out[7], shape.parity, 1);
    put(&out[8], shape.protected_bytes, 8);
    put(&out[16], set, 4);
    put(&out[20], number, 8);
    put(&out[28], shape.millionths, 4);
    put(&out[32], payload_checksum, 4);
    put(&out[36], checksum(std::span(out).first(36)), 4);
    return out;
  }
  // Returns the packet's offset in the file.
  std::uint64_t place() const {
    std::uint64_t before = number;
    if (kind == kParity || again) before += shape.checksum_packets();
    if (again) before += shape.parity_packets();
    return shape.protected_bytes + before * kPacketBytes;
  }
  // Parses a header. Returns nothing if these bytes are not a valid header.
  static std::optional<ParityPacket> parse(std::span<const std::byte, kHeaderBytes> in) {
    if (std::memcmp(in.data(), kMark.data(), kMark.size()) != 0 ||
        get(&in[36], 4) != checksum(in.first<36>()) || in[5] != std::byte{0})
      return std::nullopt;
    ParityPacket packet;
    packet.kind = static_cast<PacketKind>(in[4]);
    packet.shape.data = static_cast<std::uint32_t>(get(&in[6], 1));
    packet.shape.parity = static_cast<std::uint32_t>(get(&in[7], 1));
    packet.shape.protected_bytes = get(&in[8], 8);
    packet.set = static_cast<std::uint32_t>(get(&in[16], 4));
    packet.number = get(&in[20], 8);
    packet.shape.millionths = static_cast<std::uint32_t>(get(&in[28], 4));
    const ParityShape& shape = packet.shape;
    if ((packet.kind != kChecksums && packet.kind != kParity) || shape.data == 0 ||
        shape.parity == 0 || shape.parity > shape.data || shape.data + shape.parity > kMostBlocks ||
        shape.protected_bytes < kTrailerBytes || shape.protected_bytes >> 60 != 0 ||
        packet.number >=
            (packet.kind == kChecksums ? shape.checksum_packets() : shape.parity_packets()))
      return std::nullopt;
    return packet;
  }
};

bool has_parity_codes() {
#ifdef SHM_HAS_ISAL
  return true;
#else
  return false;
#endif
}

// Returns the layout of the parity. Stripes are as large as possible, and all have about the same
// number of blocks.
ParityShape parity_shape(std::uint64_t bytes, double share) {
  ParityShape shape;
  shape.protected_bytes = bytes;
  shape.millionths = std::max(static_cast<std::uint32_t>(share * 1e6), 1u);
  const auto parity = [&](std::uint64_t data) {
    return std::max<std::uint64_t>(
        static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(data) - 1e-9)), 1);
  };
  std::uint64_t data = kMostBlocks - 1;
  while (data + parity(data) > kMostBlocks) --data;
  const std::uint64_t stripes = (shape.blocks() - 1) / data + 1;
  data = (shape.blocks() - 1) / stripes + 1;
  shape.data = static_cast<std::uint32_t>(data);
  shape.parity = static_cast<std::uint32_t>(parity(data));
  return shape;
}

std::uint64_t write_parity(RandomSource& file, const ParityShape& shape, ByteSink& out,
                           const Progress& progress) {
#ifdef SHM_HAS_ISAL
  const auto checksums = block_checksums(file, shape, progress, "checking blocks");
  std::vector<std::byte> table(shape.checksum_packets() * kParityBlockBytes);
  for (std::size_t b = 0; b < checksums.size(); ++b) put(&table[4 * b], checksums[b], 4);
  const std::uint32_t set = checksum(std::span(table).first(4 * checksums.size()));

  const auto write = [&](PacketKind kind, std::uint64_t number, std::span<const std::byte> block) {
    const ParityPacket packet{shape, set, kind, number, false};
    unwrap(out.write(packet.header(checksum(block))), {});
    unwrap(out.write(block), {});
  };
  const auto write_table = [&] {
    for (std::uint64_t i = 0; i < shape.checksum_packets(); ++i)
      write(kChecksums, i, std::span(table).subspan(i * kParityBlockBytes, kParityBlockBytes));
  };
  write_table();

  Bytes matrix;
  for (std::uint32_t row = 0; row < shape.parity; ++row)
    for (std::uint32_t j = 0; j < shape.data; ++j) matrix.push_back(coefficient(shape, row, j));
  const std::uint64_t stripes = shape.stripes();
  std::vector<std::byte> data, coded;
  for (std::uint64_t first = 0; first < stripes; first += kStripesAtOnce) {
    if (progress) progress("writing parity", first, stripes);
    // Consecutive blocks of the file belong to consecutive stripes. One read therefore returns one
    // block for each of `count` stripes.
    const std::uint64_t count = std::min(kStripesAtOnce, stripes - first);
    const auto bytes = static_cast<std::size_t>(count * kParityBlockBytes);
    data.resize(shape.data * bytes);
    coded.resize(shape.parity * bytes);
    std::vector<unsigned char*> from, to;
    for (std::uint32_t j = 0; j < shape.data; ++j) {
      const auto run = std::span(data).subspan(j * bytes, bytes);
      read_padded(file, shape.protected_bytes, (j * stripes + first) * kParityBlockBytes, run);
      from.push_back(reinterpret_cast<unsigned char*>(run.data()));
    }
    for (std::uint32_t row = 0; row < shape.parity; ++row)
      to.push_back(reinterpret_cast<unsigned char*>(coded.data() + row * bytes));
    multiply(matrix, bytes, from, to);
    for (std::uint64_t s = 0; s < count; ++s)
      for (std::uint32_t row = 0; row < shape.parity; ++row)
        write(
            kParity, (first + s) * shape.parity + row,
            std::span(coded).subspan(row * bytes + static_cast<std::size_t>(s * kParityBlockBytes),
                                     kParityBlockBytes));
  }
  write_table();
  std::array<std::byte, kTrailerBytes> trailer;
  unwrap(file.read_at(shape.protected_bytes - kTrailerBytes, trailer), {});
  unwrap(out.write(trailer), {});
  return (2 * shape.checksum_packets() + shape.parity_packets()) * kPacketBytes + kTrailerBytes;
#else
  static_cast<void>(file), static_cast<void>(shape), static_cast<void>(out);
  static_cast<void>(progress);
  fail_without_codes();
#endif
}

std::uint64_t protect(OutputFile& file, double share, const Progress& progress) {
  const auto written = unwrap(FileRandomSource::open(file.temporary()), file.path());
  return write_parity(*written, parity_shape(written->size(), share), file.sink(), progress);
}

// --- checking

class ProtectedFile::Healed final : public RandomSource {
 public:
  Healed(RandomSource& file, const ParityShape& shape) : file_(&file), shape_(shape) {}

  void put_block(std::uint64_t block, std::uint64_t place) { place_[block] = place; }
  void read_from(std::unique_ptr<FileRandomSource> scratch) { scratch_ = std::move(scratch); }

  std::uint64_t size() const override { return shape_.protected_bytes; }
  Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override {
    if (auto status = file_->read_at(offset, into); !status) return status;
    if (into.empty()) return {};
    const std::uint64_t end = offset + into.size();
    for (auto it = place_.lower_bound(offset / kParityBlockBytes);
         it != place_.end() && it->first * kParityBlockBytes < end; ++it) {
      const std::uint64_t block = it->first * kParityBlockBytes;
      const std::uint64_t from = std::max(block, offset);
      const std::uint64_t to = std::min(block + kParityBlockBytes, end);
      if (auto status = scratch_->read_at(it->second + (from - block),
                                          into.subspan(static_cast<std::size_t>(from - offset),
                                                       static_cast<std::size_t>(to - from)));
          !status)
        return status;
    }
    return {};
  }

 private:
  RandomSource* file_;
  ParityShape shape_;
  // offset of each repaired block in the scratch file
  std::map<std::uint64_t, std::uint64_t> place_;
  std::unique_ptr<FileRandomSource> scratch_;
};

ProtectedFile::ProtectedFile(RandomSource& file) : file_(std::make_unique<LenientSource>(file)) {}
ProtectedFile::~ProtectedFile() = default;

std::unique_ptr<ProtectedFile> ProtectedFile::open(RandomSource& file) {
  std::unique_ptr<ProtectedFile> opened(new ProtectedFile(file));
  return opened->find() ? std::move(opened) : nullptr;
}

namespace {

/// Returns the size of the chunk that begins with these bytes, including its short or long header.
/// Returns 0 if no chunk begins here.
std::uint64_t bytes_of_chunk(std::span<const std::byte, 32> beginning) {
  const bool is_long = std::memcmp(beginning.data(), "SHMC", 4) == 0;
  if (!is_long && std::memcmp(beginning.data(), "SHMc", 4) != 0) return 0;
  const std::size_t header = is_long ? 32 : 22;
  if (get(&beginning[header - 4], 4) != checksum(beginning.first(header - 4))) return 0;
  return header + (is_long ? get(&beginning[16], 8) : get(&beginning[5], 3));
}

}  // namespace

bool is_whole_file(RandomSource& file) {
  constexpr std::string_view kSignature = "\x89SHM\r\n\x1a\n", kEnd = "SHME";
  std::array<std::byte, 8> start;
  std::array<std::byte, kTrailerBytes> trailer;
  std::array<std::byte, 32> header;
  if (file.size() < start.size() + trailer.size()) return false;
  unwrap(file.read_at(0, start), {});
  unwrap(file.read_at(file.size() - trailer.size(), trailer), {});
  const std::uint64_t index = get(trailer.data(), 8);
  if (std::memcmp(start.data(), kSignature.data(), start.size()) != 0 ||
      std::memcmp(&trailer[12], kEnd.data(), kEnd.size()) != 0 ||
      get(&trailer[8], 4) != checksum(std::span(trailer).first(8)) || index > file.size() ||
      file.size() - index < header.size())
    return false;
  unwrap(file.read_at(index, header), {});
  // The trailer is the end of the index, or, in archives and before version 0.10, follows it.
  const std::uint64_t bytes = bytes_of_chunk(header), left = file.size() - index;
  return bytes == left || bytes == left - trailer.size();
}

double ProtectedFile::share() const {
  return shape_.millionths > 0 && shape_.millionths <= 1'000'000
             ? shape_.millionths / 1e6
             : static_cast<double>(shape_.parity) / shape_.data;
}

// Returns true if the trailer at the end of the file points beyond the protected bytes. This is the
// case if the file has grown since the parity was written. Otherwise, this trailer is a copy of the
// protected trailer, which points to an offset within the protected bytes.
bool ProtectedFile::is_of_something_else() {
  if (file_->size() < kTrailerBytes) return false;
  std::array<std::byte, kTrailerBytes> trailer;
  unwrap(file_->read_at(file_->size() - kTrailerBytes, trailer), {});
  return std::memcmp(&trailer[12], "SHME", 4) == 0 &&
         get(&trailer[8], 4) == checksum(std::span(trailer).first(8)) &&
         get(trailer.data(), 8) >= shape_.protected_bytes;
}

// Finds the parity in the file, and reads its layout. Every packet contains the layout. Uses the
// packet that is nearest to the end of the file, and whose offset equals the offset that its header
// implies.
bool ProtectedFile::find() {
  const std::uint64_t size = file_->size();
  std::vector<std::byte> window;
  for (std::uint64_t end = size; end >= kHeaderBytes;) {
    const std::uint64_t begin = end - std::min(end, kWindowBytes);
    window.resize(static_cast<std::size_t>(end - begin));
    unwrap(file_->read_at(begin, window), {});
    const std::string_view text(reinterpret_cast<const char*>(window.data()), window.size());
    for (auto mark = text.rfind(kMark); mark != text.npos;
         mark = mark == 0 ? text.npos : text.rfind(kMark, mark - 1)) {
      if (window.size() - mark < kHeaderBytes) continue;
      auto packet = ParityPacket::parse(
          std::span<const std::byte, kHeaderBytes>(&window[mark], kHeaderBytes));
      // A packet is invalid if its header states more protected bytes than the file has.
      if (!packet || packet->shape.protected_bytes > size) continue;
      bool in_place = packet->place() == begin + mark;
      if (!in_place && packet->kind == kChecksums) {
        packet->again = true;
        in_place = packet->place() == begin + mark;
      }
      if (!in_place) continue;
      shape_ = packet->shape;
      set_ = packet->set;
      return true;
    }
    if (begin == 0) break;
    // windows overlap, because a packet header may cross the boundary between them
    end = begin + kHeaderBytes - 1;
  }
  return false;
}

// Reads a packet. Returns false if the packet is damaged.
bool ProtectedFile::read_packet(const ParityPacket& wanted, std::vector<std::byte>& payload) {
  const std::uint64_t offset = wanted.place();
  if (offset > file_->size() || file_->size() - offset < kPacketBytes) return false;
  payload.resize(kPacketBytes);
  unwrap(file_->read_at(offset, payload), {});
  const auto block = std::span(payload).subspan(kHeaderBytes);
  const auto header = wanted.header(checksum(block));
  if (!std::equal(header.begin(), header.end(), payload.begin())) return false;
  payload.erase(payload.begin(), payload.begin() + kHeaderBytes);
  return true;
}

void ProtectedFile::check(const Progress& progress) {
  checksums_.assign(shape_.blocks(), 0);
  known_.assign(shape_.blocks(), 0);
  damaged_.clear();
  damaged_packets_ = 0;
  std::vector<std::byte> payload;
  for (const bool again : {false, true})
    for (std::uint64_t i = 0; i < shape_.checksum_packets(); ++i) {
      if (!read_packet({shape_, set_, kChecksums, i, again}, payload)) {
        ++damaged_packets_;
        continue;
      }
      const std::uint64_t first = i * kChecksumsEach;
      for (std::uint64_t b = first; b < std::min(first + kChecksumsEach, shape_.blocks()); ++b) {
        checksums_[b] = static_cast<std::uint32_t>(get(&payload[4 * (b - first)], 4));
        known_[b] = 1;
      }
    }
  for (std::uint64_t i = 0; i < shape_.parity_packets(); ++i) {
    if (progress) progress("checking parity", i, shape_.parity_packets());
    if (!read_packet({shape_, set_, kParity, i, false}, payload)) ++damaged_packets_;
  }
  if (!trailer_is_there()) ++damaged_packets_;
  const auto found = block_checksums(*file_, shape_, progress, "checking blocks");
  for (std::uint64_t b = 0; b < shape_.blocks(); ++b)
    if (known_[b] == 0 || found[b] != checksums_[b]) damaged_.push_back(b);
}

// Returns true if the file ends with a copy of the trailer that equals the protected trailer.
bool ProtectedFile::trailer_is_there() {
  const std::uint64_t offset =
      shape_.protected_bytes +
      (2 * shape_.checksum_packets() + shape_.parity_packets()) * kPacketBytes;
  if (offset > file_->size() || file_->size() - offset < kTrailerBytes) return false;
  std::array<std::byte, kTrailerBytes> first, again;
  unwrap(file_->read_at(shape_.protected_bytes - kTrailerBytes, first), {});
  unwrap(file_->read_at(offset, again), {});
  return first == again;
}

// --- healing

RandomSource& ProtectedFile::healed() { return *healed_; }

std::vector<std::byte> ProtectedFile::read_block(std::uint64_t block) {
  std::vector<std::byte> bytes(kParityBlockBytes);
  read_padded(*file_, shape_.protected_bytes, block * kParityBlockBytes, bytes);
  return bytes;
}

std::vector<std::uint64_t> ProtectedFile::heal(FileSink& scratch, const Progress& progress) {
  healed_ = std::make_unique<Healed>(*file_, shape_);
  const std::uint64_t stripes = shape_.stripes();
  std::map<std::uint64_t, std::vector<std::uint64_t>> of_stripe;
  for (std::uint64_t block : damaged_) of_stripe[block % stripes].push_back(block);
  std::vector<std::uint64_t> lost;
  std::uint64_t healed = 0, done = 0;
  for (const auto& [stripe, damaged] : of_stripe) {
    if (progress) progress("healing", done++, of_stripe.size());
    const auto left = heal_stripe(stripe, damaged, scratch);
    for (std::uint64_t block : damaged)
      if (std::find(left.begin(), left.end(), block) == left.end())
        healed_->put_block(block, healed++ * kParityBlockBytes);
    lost.insert(lost.end(), left.begin(), left.end());
  }
  healed_->read_from(unwrap(FileRandomSource::open(scratch.temporary()), scratch.temporary()));
  std::sort(lost.begin(), lost.end());
  return lost;
}

// Reconstructs the damaged blocks of one stripe and appends them to the scratch file, in the order
// of `damaged`. Returns the blocks that could not be repaired.
std::vector<std::uint64_t> ProtectedFile::heal_stripe(std::uint64_t stripe,
                                                      std::span<const std::uint64_t> damaged,
                                                      FileSink& scratch) {
#ifdef SHM_HAS_ISAL
  std::vector<std::uint64_t> wanted(damaged.begin(), damaged.end());
  // Indices of the undamaged parity rows.
  std::vector<std::uint32_t> rows;
  std::vector<std::vector<std::byte>> parity;
  std::vector<std::byte> payload;
  for (std::uint32_t row = 0; row < shape_.parity && rows.size() < wanted.size(); ++row)
    if (read_packet({shape_, set_, kParity, stripe * shape_.parity + row, false}, payload)) {
      rows.push_back(row);
      parity.push_back(payload);
    }
  // If there are fewer usable parity blocks than damaged blocks, do not try to repair blocks whose
  // checksum is unknown, because they may be undamaged.
  if (rows.size() < wanted.size())
    std::erase_if(wanted, [&](std::uint64_t block) { return known_[block] == 0; });
  if (rows.size() < wanted.size()) return {damaged.begin(), damaged.end()};
  rows.resize(wanted.size());

  // First subtract the contribution of the undamaged blocks from the parity blocks; the
  // contribution of the damaged blocks remains. Then multiply this remainder by the inverse of the
  // submatrix with the columns of the damaged blocks.
  const std::uint64_t stripes = shape_.stripes();
  std::vector<std::vector<std::byte>> blocks;
  Bytes of_all, of_damaged;
  for (std::uint32_t j = 0; j < shape_.data; ++j) {
    const std::uint64_t block = j * stripes + stripe;
    const bool is_wanted = std::find(wanted.begin(), wanted.end(), block) != wanted.end();
    blocks.push_back(is_wanted ? std::vector<std::byte>(kParityBlockBytes) : read_block(block));
  }
  for (std::uint32_t row : rows) {
    for (std::uint32_t j = 0; j < shape_.data; ++j) of_all.push_back(coefficient(shape_, row, j));
    for (std::uint64_t block : wanted)
      of_damaged.push_back(coefficient(shape_, row, static_cast<std::uint32_t>(block / stripes)));
  }
  const auto pointers = [](std::vector<std::vector<std::byte>>& of) {
    std::vector<unsigned char*> out;
    for (auto& bytes : of) out.push_back(reinterpret_cast<unsigned char*>(bytes.data()));
    return out;
  };
  const std::size_t count = wanted.size();
  std::vector<std::vector<std::byte>> sums(count, std::vector<std::byte>(kParityBlockBytes));
  auto healed = sums;
  auto sources = pointers(blocks), targets = pointers(sums);
  multiply(of_all, kParityBlockBytes, sources, targets);
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < kParityBlockBytes; ++k) sums[i][k] ^= parity[i][k];
  Bytes inverse(count * count);
  if (::gf_invert_matrix(of_damaged.data(), inverse.data(), static_cast<int>(count)) != 0)
    return {damaged.begin(), damaged.end()};
  auto from = pointers(sums), to = pointers(healed);
  multiply(inverse, kParityBlockBytes, from, to);
  for (std::size_t i = 0; i < count; ++i)
    if (known_[wanted[i]] != 0 && checksum(healed[i]) != checksums_[wanted[i]])
      return {damaged.begin(), damaged.end()};
  std::vector<std::uint64_t> left;
  for (std::uint64_t block : damaged) {
    const auto found = std::find(wanted.begin(), wanted.end(), block);
    if (found == wanted.end()) {
      left.push_back(block);
      continue;
    }
    unwrap(scratch.write(healed[static_cast<std::size_t>(found - wanted.begin())]), {});
  }
  return left;
#else
  static_cast<void>(stripe), static_cast<void>(damaged), static_cast<void>(scratch);
  fail_without_codes();
#endif
}

}  // namespace shm::converters
