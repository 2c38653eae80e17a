#include "targets.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <string>

#include "structs.h"

namespace shmf {
namespace {

using shm::Result;
using shm::ScalarType;

bool is_number(std::int32_t type) {
  return type == SHMF_INT32 || type == SHMF_UINT32 || type == SHMF_INT64 || type == SHMF_UINT64;
}

/// Returns the largest number that an integer type can represent, plus 1.
std::uint64_t end_of_numbers(std::int32_t type) {
  switch (type) {
    case SHMF_INT32: return std::uint64_t{1} << 31;
    case SHMF_UINT32: return std::uint64_t{1} << 32;
    default: return std::uint64_t{1} << 63;
  }
}

template <class To, class From>
void convert(std::byte* to, const std::byte* from, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    From value{};
    std::memcpy(&value, from + i * sizeof value, sizeof value);
    const auto converted = static_cast<To>(value);
    std::memcpy(to + i * sizeof converted, &converted, sizeof converted);
  }
}

template <class Real>
void put_nans(std::byte* to, std::size_t count) {
  constexpr Real kNan = std::numeric_limits<Real>::quiet_NaN();
  for (std::size_t i = 0; i < count; ++i) std::memcpy(to + i * sizeof kNan, &kNan, sizeof kNan);
}

}  // namespace

Result<Target> Target::of(shmf_target& target, std::size_t number, const shmf_file& file) {
  const std::string name = "target " + std::to_string(number);
  const auto own = taken(&target, name.c_str());
  if (!own) return own.error();
  Target made;
  made.what_ = own->what;
  made.to_ = static_cast<ScalarType>(own->type);
  made.data_ = static_cast<std::byte*>(own->data);
  if (own->type < SHMF_INT8 || own->type > SHMF_FLOAT64)
    return misuse("there is no type " + std::to_string(own->type), name);
  auto fits = made.fit(*own, file);
  if (!fits) return misuse(fits.error().detail, name);

  const std::uint64_t element = made.components_ * shm::scalar_bytes(made.to_);
  if (made.elements_ > (std::numeric_limits<std::uint64_t>::max() >> 1) / element)
    return misuse("the target has more elements than memory can hold", name);
  const std::uint64_t bytes = made.elements_ * element;
  if (target.struct_size >= sizeof target) target.used = bytes;
  if (made.wanted() && own->bytes < bytes)
    return misuse(
        "has room for " + std::to_string(own->bytes) + " bytes, needs " + std::to_string(bytes),
        name);
  if (made.wanted() &&
      reinterpret_cast<std::uintptr_t>(made.data_) % shm::scalar_bytes(made.to_) != 0)
    return misuse("the memory of the target is not aligned for its type", name);
  return made;
}

/// Determines the number of elements that the target needs, and checks that its type can represent
/// the values.
Result<void> Target::fit(const shmf_target& own, const shmf_file& file) {
  const Piece& piece = file.piece;
  const auto numbers = [&](std::uint64_t count, std::uint64_t end) -> Result<void> {
    if (!is_number(own.type))
      return misuse("vertex and cell numbers must be 32-bit or 64-bit integers");
    if (end > end_of_numbers(own.type)) return misuse("the numbers do not fit into 32 bits");
    elements_ = count;
    wide_ = shm::scalar_bytes(to_) == 8;
    return {};
  };
  const auto end_of = [](const std::vector<std::uint64_t>& all, std::uint64_t count) {
    return all.empty() ? count : all.back() + 1;
  };
  switch (own.what) {
    case SHMF_POINTS:
      if (!shm::is_float(to_)) return misuse("points must be float32 or float64");
      elements_ = piece.vertex_count;
      components_ = 3;
      from_ = file.schema().coordinate_type;
      return {};
    case SHMF_CORNERS: return numbers(piece.corner_count, piece.vertex_count);
    case SHMF_CORNER_BEGIN: return numbers(piece.cell_count + 1, piece.corner_count + 1);
    case SHMF_CELL_BLOCKS:
      if (shm::scalar_bytes(to_) != 4) return misuse("block indices must be 32-bit integers");
      return numbers(piece.cell_count, file.schema().blocks.size());
    case SHMF_CELL_TYPES:
      if (own.type != SHMF_UINT8) return misuse("cell types must be uint8");
      elements_ = piece.cell_count;
      return {};
    case SHMF_VERTEX_NUMBERS:
      return numbers(piece.vertex_count, end_of(piece.vertices, piece.vertex_count));
    case SHMF_CELL_NUMBERS:
      return numbers(piece.cell_count, end_of(piece.numbers, piece.cell_count));
    case SHMF_VALUES: return fit_values(own, file);
    default: return misuse("there is no shmf_what " + std::to_string(own.what));
  }
}

Result<void> Target::fit_values(const shmf_target& own, const shmf_file& file) {
  const auto& arrays = file.schema().arrays;
  if (own.array >= arrays.size()) return misuse("no array " + std::to_string(own.array));
  array_ = own.array;
  info_ = &arrays[array_];
  step_ = own.step;
  from_ = info_->type;
  components_ = info_->components;
  if (!info_->per_step && step_ != 0) return misuse("the array is static, so the step must be 0");
  if (to_ != from_ && !(from_ == ScalarType::float64 && to_ == ScalarType::float32))
    return misuse("the array has another type, " + std::string(shm::scalar_name(from_)));
  fills_ = info_->location == shm::Location::cell &&
           ((own.flags & SHMF_FILL) != 0 || info_->blocks.empty());
  elements_ =
      fills_ ? file.piece.cell_count
             : elements_of(file.schema(), array_, file.piece.vertex_count, file.piece.block_cells);
  return {};
}

bool Target::of_cells() const {
  if (what_ == SHMF_VALUES) return info_->location == shm::Location::cell;
  return what_ != SHMF_POINTS && what_ != SHMF_VERTEX_NUMBERS;
}

void Target::put_values(std::uint64_t first, const std::byte* values, std::size_t count) {
  const std::size_t scalars = count * components_;
  std::byte* to = data_ + static_cast<std::size_t>(first) * components_ * shm::scalar_bytes(to_);
  if (from_ == to_)
    std::memcpy(to, values, scalars * shm::scalar_bytes(to_));
  else if (to_ == ScalarType::float32)
    convert<float, double>(to, values, scalars);
  else
    convert<double, float>(to, values, scalars);
}

void Target::put_nothing(std::uint64_t first, std::uint64_t count) {
  const auto scalars = static_cast<std::size_t>(count) * components_;
  std::byte* to = data_ + static_cast<std::size_t>(first) * components_ * shm::scalar_bytes(to_);
  if (to_ == ScalarType::float32)
    put_nans<float>(to, scalars);
  else if (to_ == ScalarType::float64)
    put_nans<double>(to, scalars);
  else
    std::memset(to, 0, scalars * shm::scalar_bytes(to_));
}

}  // namespace shmf
