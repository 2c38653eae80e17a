// What a caller wants to be filled, and how: types, room, places.
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

/// A target whose type and room are right for a piece.
class Target {
 public:
  /// Fails where the target makes no sense for the file, or has too little room. `number`: which of
  /// the call's it is, for the complaint. Sets target.used.
  static shm::Result<Target> of(shmf_target& target, std::size_t number, const shmf_file& file);

  std::int32_t what() const { return what_; }
  std::uint32_t array() const { return array_; }
  std::uint64_t step() const { return step_; }
  /// Cell data of an element for each cell, whether it has values or not.
  bool fills() const { return fills_; }
  bool of_cells() const;
  bool is_stepped() const { return info_ != nullptr && info_->per_step; }
  const shm::ArrayInfo* info() const { return info_; }
  /// Where there is no memory nothing is wanted but the size.
  bool wanted() const { return data_ != nullptr; }
  std::uint64_t elements() const { return elements_; }

  /// Number `value` is the i-th. Must hold: i < elements().
  void put_number(std::uint64_t i, std::uint64_t value) {
    if (wide_)
      reinterpret_cast<std::uint64_t*>(data_)[i] = value;
    else
      reinterpret_cast<std::uint32_t*>(data_)[i] = static_cast<std::uint32_t>(value);
  }
  /// The same from `first` on.
  void put_numbers(std::uint64_t first, std::span<const std::uint64_t> values) {
    if (wide_)
      std::copy(values.begin(), values.end(), reinterpret_cast<std::uint64_t*>(data_) + first);
    else
      std::transform(values.begin(), values.end(), reinterpret_cast<std::uint32_t*>(data_) + first,
                     [](std::uint64_t value) { return static_cast<std::uint32_t>(value); });
  }
  void put_byte(std::uint64_t i, std::uint8_t value) { data_[i] = std::byte{value}; }
  /// Values of `count` elements, as they stand in the file, are those from `first` on. Must hold:
  /// they are below elements().
  void put_values(std::uint64_t first, const std::byte* values, std::size_t count);
  /// Elements from `first` on have no values.
  void put_nothing(std::uint64_t first, std::uint64_t count);
  /// Bytes of an element in the file.
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
  shm::ScalarType from_{}, to_{};  // of what the file has, and of what is wanted
  std::byte* data_ = nullptr;
};

}  // namespace shmf
