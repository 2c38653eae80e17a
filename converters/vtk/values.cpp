#include "vtk/values.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>
#include <utility>

#include "base/byte_order.h"
#include "base/failure.h"
#include "base/stored_value.h"

namespace shm::converters::vtk {
namespace {

constexpr std::uint64_t kPieceValues = 8192;

// Parses a value in the way VTK does. VTK reads a value of one byte as an integer and keeps its low
// 8 bits, so a file may contain 200 instead of -56.
template <class T>
T parse_value(TextInput& input) {
  if constexpr (sizeof(T) == 1) {
    const int value = input.number<int>();
    if (value < -128 || value > 255)
      input.fail(ErrorCode::corrupt, std::to_string(value) + " does not fit into one byte");
    return static_cast<T>(value);
  } else {
    return input.number<T>();
  }
}

template <class T>
void parse_values(TextInput& input, PagedArray& out, std::uint64_t count) {
  std::vector<T> piece;
  while (count > 0) {
    const std::uint64_t n = std::min(count, kPieceValues);
    piece.clear();
    for (std::uint64_t i = 0; i < n; ++i) piece.push_back(parse_value<T>(input));
    out.append(n, reinterpret_cast<const std::byte*>(piece.data()));
    count -= n;
  }
}

template <class To>
void convert_to(ScalarType from, const std::byte* in, std::size_t count, std::byte* out) {
  with_scalar(from, [&](auto value) {
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(&value, in + i * sizeof value, sizeof value);
      To result{};
      if constexpr (std::is_floating_point_v<To>) {
        result = static_cast<To>(value);
      } else {
        const auto wide = static_cast<double>(value);
        const auto least = static_cast<double>(std::numeric_limits<To>::min());
        const auto most = static_cast<double>(std::numeric_limits<To>::max());
        if (wide >= most) {
          result = std::numeric_limits<To>::max();
        } else if (wide > least) {
          result = static_cast<To>(std::nearbyint(wide));
        } else if (wide <= least) {
          result = std::numeric_limits<To>::min();
        }
      }
      std::memcpy(out + i * sizeof result, &result, sizeof result);
    }
  });
}

}  // namespace

void convert_numbers(ScalarType from, const std::byte* in, std::size_t count, ScalarType to,
                     std::byte* out) {
  with_scalar(to, [&](auto zero) { convert_to<decltype(zero)>(from, in, count, out); });
}

RandomFile::RandomFile(const std::string& path) : path_(path) {
  descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor_ < 0)
    throw Failure(ErrorCode::io, std::string("cannot open: ") + std::strerror(errno), path);
}

RandomFile::~RandomFile() { ::close(descriptor_); }

void RandomFile::read(std::uint64_t offset, std::byte* out, std::size_t count) const {
  while (count > 0) {
    const ssize_t n = ::pread(descriptor_, out, count, static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0)
      throw Failure(Error{
          ErrorCode::io, std::string("cannot read: ") + std::strerror(errno), {}, offset, path_});
    if (n == 0)
      throw Failure(Error{
          ErrorCode::truncated, "the file became shorter while it was read", {}, offset, path_});
    out += n;
    offset += static_cast<std::uint64_t>(n);
    count -= static_cast<std::size_t>(n);
  }
}

Values::Values(TextInput& input, std::shared_ptr<RandomFile> binary_file, Spool& spool,
               ScalarType type, std::uint64_t count)
    : type_(type), size_(count), offset_(input.offset()), file_(std::move(binary_file)) {
  if (file_ != nullptr) {
    if (count > input.left() / scalar_bytes(type))
      input.fail(ErrorCode::truncated, "states " + std::to_string(count) +
                                           " values, but the file ends after " +
                                           std::to_string(input.left()) + " more bytes");
    input.skip_bytes(count * scalar_bytes(type));
    return;
  }
  parsed_.emplace(spool, scalar_bytes(type));
  with_scalar(type, [&](auto zero) { parse_values<decltype(zero)>(input, *parsed_, count); });
}

void Values::read(std::uint64_t first, std::uint64_t count, std::byte* out) {
  const std::size_t bytes = scalar_bytes(type_);
  if (file_ == nullptr) {
    if (count > 0) parsed_->read(first, count, out);
    return;
  }
  file_->read(offset_ + first * bytes, out, count * bytes);
  swap_from_file(out, count, bytes, true);
}

bool Values::equals(Values& other) {
  if (type_ != other.type_ || size_ != other.size_) return false;
  const std::size_t width = scalar_bytes(type_);
  std::vector<std::byte> own(std::min(size_, kPieceValues) * width), its(own.size());
  for (std::uint64_t first = 0; first < size_; first += kPieceValues) {
    const std::uint64_t n = std::min(size_ - first, kPieceValues);
    read(first, n, own.data());
    other.read(first, n, its.data());
    if (std::memcmp(own.data(), its.data(), n * width) != 0) return false;
  }
  return true;
}

std::int64_t IntegerCursor::next() {
  if (position_ == buffer_end_) fill();
  return buffer_[position_++ - buffer_first_];
}

void IntegerCursor::fill() {
  const std::uint64_t n = std::min(left(), kPieceValues);
  raw_.resize(n * scalar_bytes(values_->type()));
  buffer_.resize(n);
  values_->read(position_, n, raw_.data());
  with_scalar(values_->type(), [&](auto zero) {
    using T = decltype(zero);
    for (std::uint64_t i = 0; i < n; ++i) {
      T value;
      std::memcpy(&value, raw_.data() + i * sizeof(T), sizeof(T));
      if constexpr (std::is_integral_v<T>) buffer_[i] = static_cast<std::int64_t>(value);
    }
  });
  buffer_first_ = position_;
  buffer_end_ = position_ + n;
}

}  // namespace shm::converters::vtk
