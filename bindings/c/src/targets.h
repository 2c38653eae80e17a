// Checks the types and sizes of the targets of shmf_read(), and stores values in them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "file.h"
#include "shm/schema.h"
#include "shmformat.h"

namespace shmf {

/// A target of shmf_read() whose type and size are suitable for the selected cells.
class Target {
 public:
  /// Fails if the target is invalid for the file or too small. `number` is the index of the target
  /// in the call, for error messages. Sets target.used.
  static shm::Result<Target> of(shmf_target& target, std::size_t number, const shmf_file& file);

  std::int32_t what() const { return what_; }
  std::uint32_t array() const { return array_; }
  std::uint64_t step() const { return step_; }
  /// Returns true if the target has an element for every cell, even for cells without values
  /// (SHMF_FILL).
  bool fills() const { return fills_; }
  bool of_cells() const;
  bool of_points() const { return info_ != nullptr && info_->location == shm::Location::point; }
  bool is_stepped() const { return info_ != nullptr && info_->per_step; }
  const shm::ArrayInfo* info() const { return info_; }
  /// Returns true if the caller requests the values; false if `data` is null, so that only the size
  /// is requested.
  bool wanted() const { return data_ != nullptr; }
  std::uint64_t elements() const { return elements_; }

  /// Stores `value`, a vertex or cell number, as element `i`, which must be less than elements().
  void put_number(std::uint64_t i, std::uint64_t value) {
    if (wide_)
      reinterpret_cast<std::uint64_t*>(data_)[i] = value;
    else
      reinterpret_cast<std::uint32_t*>(data_)[i] = static_cast<std::uint32_t>(value);
  }
  /// Stores vertex or cell numbers as elements `first`, `first` + 1, and so on.
  void put_numbers(std::uint64_t first, std::span<const std::uint64_t> values) {
    if (wide_)
      std::copy(values.begin(), values.end(), reinterpret_cast<std::uint64_t*>(data_) + first);
    else
      std::transform(values.begin(), values.end(), reinterpret_cast<std::uint32_t*>(data_) + first,
                     [](std::uint64_t value) { return static_cast<std::uint32_t>(value); });
  }
  void put_byte(std::uint64_t i, std::uint8_t value) { data_[i] = std::byte{value}; }
  /// Stores the values of `count` elements from element `first` on, and converts them from the type
  /// in the file. `first` + `count` must not exceed elements().
  void put_values(std::uint64_t first, const std::byte* values, std::size_t count);
  /// Marks `count` elements from `first` on as elements without values: sets them to NaN, or to 0
  /// for integers.
  void put_nothing(std::uint64_t first, std::uint64_t count);
  /// Returns the size in bytes of an element of the array in the file, which may have another type
  /// than the target.
  std::size_t stride() const { return components_ * shm::scalar_bytes(from_); }

 private:
  shm::Result<void> fit(const shmf_target& own, const shmf_file& file);
  shm::Result<void> fit_values(const shmf_target& own, const shmf_file& file);

  std::int32_t what_ = 0;
  std::uint32_t array_ = 0;
  std::uint64_t step_ = 0, elements_ = 0;
  bool fills_ = false, wide_ = false;
  std::size_t components_ = 1;
  const shm::ArrayInfo* info_ = nullptr;
  shm::ScalarType from_{}, to_{};  // scalar type of the values in the file, and in the target
  std::byte* data_ = nullptr;
};

}  // namespace shmf
