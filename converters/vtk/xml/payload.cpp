#include "vtk/xml/payload.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>
#include <utility>

#include "base/byte_order.h"
#include "base/failure.h"
#include "base/stored_value.h"
#include "base/text_input.h"

namespace shm::converters::vtu {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 18;
constexpr std::size_t kFileBytes = std::size_t{1} << 16, kFirstFileBytes = std::size_t{1} << 12;
// Limit on the total number of bytes read and unpacked for all arrays of a file. The limit is the
// size of the file times kMostExpansion if the file names a compressor, or times
// kMostPlainExpansion if not, but at least kAlwaysAllowed. The factors are sufficient for valid
// files: deflate expands a byte to at most 1032 bytes, a character of text yields at most four
// bytes, and some arrays are read twice.
constexpr std::uint64_t kMostExpansion = 1100, kMostPlainExpansion = 16;
constexpr std::uint64_t kAlwaysAllowed = std::uint64_t{256} << 20;
// Maximum length in characters of a number in text. A double that is written without an exponent
// may have about 350 digits.
constexpr std::size_t kLongestWord = 400;

bool is_space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

// A range of bytes of a file that is read front to back.
class FileRange {
 public:
  FileRange(std::shared_ptr<vtk::RandomFile> file, std::uint64_t begin, std::uint64_t end)
      : file_(std::move(file)), at_(begin), end_(std::max(begin, end)) {}

  std::uint64_t left() const { return end_ - at_; }
  // Returns the number of bytes read since the previous call to this function, including bytes that
  // were read ahead.
  std::uint64_t newly_read() { return std::exchange(newly_read_, 0); }
  std::size_t read(std::byte* out, std::size_t count) {
    const std::size_t n = std::min<std::uint64_t>(count, left());
    file_->read(at_, out, n);
    at_ += n;
    newly_read_ += n;
    return n;
  }
  void skip(std::uint64_t count) { at_ += std::min(count, left()); }
  // Stores the next character in `c`. Returns false at the end of the range.
  bool next(char& c) {
    if (taken_ == buffer_.size()) {
      const std::size_t more = buffer_.empty() ? kFirstFileBytes : kFileBytes;
      buffer_.resize(std::min<std::uint64_t>(more, left()));
      taken_ = 0;
      if (buffer_.empty()) return false;
      file_->read(at_, reinterpret_cast<std::byte*>(buffer_.data()), buffer_.size());
      at_ += buffer_.size();
    }
    c = buffer_[taken_++];
    ++newly_read_;
    return true;
  }

 private:
  std::shared_ptr<vtk::RandomFile> file_;
  std::uint64_t at_, end_;
  std::string buffer_;
  std::size_t taken_ = 0;
  std::uint64_t newly_read_ = 0;
};

// Parses a word of text as a number. For one-byte types, values from -128 to 255 are accepted, and
// only the low 8 bits are kept, as in VTK: 200 as a signed byte becomes -56.
template <class T>
bool parse_word(std::string_view word, T& value) {
  if constexpr (sizeof(T) == 1) {
    int wide = 0;
    if (!TextInput::parse(word, wide) || wide < -128 || wide > 255) return false;
    value = static_cast<T>(wide);
    return true;
  } else {
    return TextInput::parse(word, value);
  }
}

}  // namespace

// Reads raw or base64 bytes. Base64 text may contain padding at any position, e.g. between header
// and data. The text ends at the first character that is not part of the base64 alphabet. A copy of
// this object can read independently of the original.
class PayloadReader::Bytes {
 public:
  Bytes(FileRange range, bool base64) : range_(std::move(range)), base64_(base64) {}

  std::size_t read(std::byte* out, std::size_t count) {
    if (!base64_) return range_.read(out, count);
    std::size_t done = 0;
    while (done < count) {
      if (taken_ == ready_ && !next_group()) break;
      out[done++] = group_[taken_++];
    }
    return done;
  }
  // Skips `count` bytes. Returns false if fewer bytes are left.
  bool skip(std::uint64_t count) {
    if (!base64_) {
      const bool enough = count <= range_.left();
      range_.skip(count);
      return enough;
    }
    std::array<std::byte, 512> ignored;
    while (count > 0) {
      const std::size_t n = read(ignored.data(), std::min<std::uint64_t>(count, ignored.size()));
      if (n == 0) return false;
      count -= n;
    }
    return true;
  }
  std::uint64_t newly_read() { return range_.newly_read(); }
  // Returns an upper bound on the number of bytes left. A file that states a size above this bound
  // is damaged.
  std::uint64_t most_left() const { return range_.left() + kFileBytes; }

 private:
  bool next_group() {
    std::uint32_t bits = 0;
    std::size_t characters = 0, padding = 0;
    for (char c = 0; characters + padding < 4;) {
      if (!range_.next(c)) break;
      if (is_space(c)) continue;
      const int value = base64_value(c);
      if (value >= 0 && padding == 0) {
        bits = bits << 6 | static_cast<std::uint32_t>(value);
        ++characters;
      } else if (c == '=' && characters >= 2) {
        ++padding;
      } else {
        range_.skip(range_.left());
        break;
      }
    }
    taken_ = 0;
    ready_ = characters < 2 ? 0 : characters - 1;
    bits <<= 6 * (4 - std::min<std::size_t>(characters, 4));
    for (std::size_t i = 0; i < ready_; ++i)
      group_[i] = static_cast<std::byte>(bits >> (16 - 8 * i) & 0xffU);
    return ready_ > 0;
  }

  FileRange range_;
  bool base64_;
  std::array<std::byte, 3> group_{};
  std::size_t taken_ = 0, ready_ = 0;
};

PayloadReader::PayloadReader(std::shared_ptr<vtk::RandomFile> file, std::string path, ByteForm form,
                             std::uint64_t file_bytes)
    : file_(std::move(file)), path_(std::move(path)), form_(form), file_bytes_(file_bytes) {
  const bool plain = form.compressor == Compressor::none;
  room_ = std::max(kAlwaysAllowed, file_bytes * (plain ? kMostPlainExpansion : kMostExpansion));
}

void PayloadReader::spend(const PayloadPlace& place, std::uint64_t bytes) {
  if (bytes > room_)
    fail(ErrorCode::over_limit, place,
         "the arrays read so far unpack to more bytes than the limit for a file of " +
             std::to_string(file_bytes_) + " bytes");
  room_ -= bytes;
}

void PayloadReader::fail(ErrorCode code, const PayloadPlace& place, std::string detail) const {
  throw Failure(Error{code, std::move(detail), place.array, place.begin, path_});
}

std::uint64_t PayloadReader::read(const PayloadPlace& place, ScalarType type, bool bits,
                                  std::uint64_t most, const Take& take) {
  block_bytes_ = 0;
  if (most == 0) return 0;
  if (place.style == Style::ascii) return read_text(place, type, most, take);
  return bits ? read_bits(place, most, take) : read_binary(place, type, most, take);
}

void PayloadReader::decode(const PayloadPlace& place, const TakeBytes& take) {
  Bytes bytes(FileRange(file_, place.begin, place.end), place.style == Style::base64);
  if (form_.compressor == Compressor::none) {
    decode_plain(place, bytes, take);
  } else {
    decode_blocks(place, bytes, take);
  }
}

void PayloadReader::decode_plain(const PayloadPlace& place, Bytes& bytes, const TakeBytes& take) {
  std::array<std::byte, 8> head;
  if (bytes.read(head.data(), form_.header_bytes) != form_.header_bytes)
    fail(ErrorCode::truncated, place,
         "the file ends before the number that states the size of the array");
  const std::uint64_t size = word_at(head.data(), form_);
  std::vector<std::byte> piece(std::min<std::uint64_t>(size, kPieceBytes));
  for (std::uint64_t done = 0; done < size;) {
    const std::size_t wanted = std::min<std::uint64_t>(size - done, kPieceBytes);
    const std::size_t n = bytes.read(piece.data(), wanted);
    done += n;
    spend(place, n + bytes.newly_read());
    if (!take(std::span(piece).first(n))) return;
    if (n < wanted)
      fail(ErrorCode::truncated, place,
           "states " + std::to_string(size) + " bytes, but has " + std::to_string(done));
  }
}

// Decodes compressed blocks. The header contains the number of blocks, the size of a block, the
// size of the last block (0 means a full block), then the compressed size of each block. The blocks
// follow the header.
void PayloadReader::decode_blocks(const PayloadPlace& place, Bytes& sizes, const TakeBytes& take) {
  std::array<std::byte, 24> head;
  const std::size_t word = form_.header_bytes;
  if (sizes.read(head.data(), 3 * word) != 3 * word)
    fail(ErrorCode::truncated, place, "the file ends within the header of the array");
  const std::uint64_t blocks = word_at(head.data(), form_);
  const std::uint64_t full = word_at(head.data() + word, form_);
  const std::uint64_t last = word_at(head.data() + 2 * word, form_);
  spend(place, sizes.newly_read());
  if (blocks == 0) return;
  if (full > kMostBlockBytes)
    fail(ErrorCode::unsupported, place,
         "has blocks of " + std::to_string(full) + " bytes; at most 64 MiB are supported");
  if (full == 0 || last > full)
    fail(ErrorCode::corrupt, place, "states blocks of an impossible size");
  if (blocks > sizes.most_left() / word)
    fail(ErrorCode::corrupt, place,
         "states " + std::to_string(blocks) + " blocks, more than the file can hold");
  block_bytes_ = full;
  Bytes data = sizes;
  if (!data.skip(blocks * word))
    fail(ErrorCode::truncated, place, "the file ends within the header of the array");
  std::vector<std::byte> block, values;
  for (std::uint64_t b = 0; b < blocks; ++b) {
    const std::uint64_t size = b + 1 == blocks && last > 0 ? last : full;
    sizes.read(head.data(), word);
    const std::uint64_t packed = word_at(head.data(), form_);
    if (packed > most_compressed_bytes(size))
      fail(ErrorCode::corrupt, place,
           "block " + std::to_string(b) + " has an impossible compressed size");
    spend(place, packed + size + sizes.newly_read() + data.newly_read());
    block.resize(packed);
    if (data.read(block.data(), packed) != packed)
      fail(ErrorCode::truncated, place, "the file ends within block " + std::to_string(b));
    values.resize(size);
    if (!decompress(form_.compressor, block, values.data(), size))
      fail(ErrorCode::corrupt, place, "block " + std::to_string(b) + " cannot be decompressed");
    if (!take(values)) return;
  }
}

std::uint64_t PayloadReader::read_binary(const PayloadPlace& place, ScalarType type,
                                         std::uint64_t most, const Take& take) {
  const std::size_t width = scalar_bytes(type);
  std::uint64_t done = 0;
  // A piece may end in the middle of a number. The bytes of the incomplete number stay in `values`
  // until the next piece arrives.
  std::vector<std::byte> values;
  decode(place, [&](std::span<const std::byte> piece) {
    values.insert(values.end(), piece.begin(), piece.end());
    const std::uint64_t n = std::min<std::uint64_t>(values.size() / width, most - done);
    swap_from_file(values.data(), n, width, form_.big_endian);
    take(std::span(values).first(n * width));
    done += n;
    values.erase(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(n * width));
    return done < most;
  });
  return done;
}

std::uint64_t PayloadReader::read_bits(const PayloadPlace& place, std::uint64_t most,
                                       const Take& take) {
  std::uint64_t done = 0;
  std::vector<std::byte> values;
  decode(place, [&](std::span<const std::byte> piece) {
    values.clear();
    for (const std::byte byte : piece)
      for (int bit = 7; bit >= 0 && done < most; --bit, ++done)
        values.push_back(byte >> bit & std::byte{1});
    take(values);
    return done < most;
  });
  return done;
}

std::uint64_t PayloadReader::read_text(const PayloadPlace& place, ScalarType type,
                                       std::uint64_t most, const Take& take) {
  FileRange range(file_, place.begin, place.end);
  std::vector<std::byte> values;
  std::uint64_t done = 0;
  with_scalar(type, [&](auto value) {
    std::string word;
    bool more = true;
    while (more && done < most) {
      char c = ' ';
      more = range.next(c);
      if (more && !is_space(c)) {
        word += c;
        if (word.size() <= kLongestWord) continue;
      }
      if (word.empty()) continue;
      if (!parse_word(word, value))
        fail(ErrorCode::corrupt, place, "'" + word.substr(0, 40) + "' is not a valid number");
      word.clear();
      ++done;
      const auto* bytes = reinterpret_cast<const std::byte*>(&value);
      values.insert(values.end(), bytes, bytes + sizeof value);
      if (values.size() < kPieceBytes) continue;
      spend(place, values.size() + range.newly_read());
      take(values);
      values.clear();
    }
  });
  spend(place, values.size() + range.newly_read());
  take(values);
  return done;
}

}  // namespace shm::converters::vtu
