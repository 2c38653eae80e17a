// SpecialValues: the values of an array that are not finite, and its fill values. They are coded
// apart from the other values, as runs. The value coders see a substitute instead, so that special
// values neither disturb predictions nor change the domain of the other values.
// spec: "Special values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"
#include "codecs/shared/reference_values.h"
#include "shm/schema.h"

namespace shm {

/// Decides which values of an array are special. Precondition: the array has a floating-point type.
class SpecialTest {
 public:
  explicit SpecialTest(const ArrayInfo& info);
  /// `bits`: the bits of a value.
  bool operator()(std::uint64_t bits) const {
    if ((bits & exponent_) == exponent_) return true;
    for (const std::uint64_t fill : fills_)
      if (bits == fill) return true;
    return false;
  }

 private:
  std::uint64_t exponent_;
  std::vector<std::uint64_t> fills_;
};

/// Replaces each special value among `values`, which contains whole elements: by the most recent
/// value of its component that is not special; before the first such value, by that value; by 0 if
/// all values of the component are special.
void replace_special(const ArrayInfo& info, std::span<std::byte> values);

/// Returns the values of `count` elements without gaps, with special values replaced. `stride`:
/// number of bytes from an element to the next.
std::vector<std::byte> plain_values(const ArrayInfo& info, const std::byte* values,
                                    std::size_t stride, std::size_t count);

/// Reference values in which special values are replaced.
class PlainReference {
 public:
  /// Returns `reference` with special values replaced. The result is valid until the next call.
  ReferenceValues of(const ArrayInfo& info, const ReferenceValues& reference);

 private:
  std::vector<std::byte> values_, last_;
};

class SpecialValues {
 public:
  /// Finds the special values among the values of `count` elements. `stride`: number of bytes from
  /// an element to the next. Returns nothing if there are none, if they have more than 255
  /// different bit patterns, or if the array has no floating-point type.
  static std::optional<SpecialValues> find(const ArrayInfo& info, const std::byte* values,
                                           std::size_t stride, std::size_t count);
  bool operator==(const SpecialValues&) const = default;

  /// Returns the coded form, which precedes the coded values. `are_those_of_reference`: true if the
  /// special values are equal to those of the reference values.
  std::vector<std::byte> encode(bool are_those_of_reference = false) const;

 private:
  friend class SpecialValuesDecoder;
  struct Run {
    std::uint64_t gap = 0, length = 0;
    std::uint8_t value = 0;
    bool operator==(const Run&) const = default;
  };
  void put_runs(ByteWriter& out) const;

  std::size_t width_ = 0;
  std::vector<std::uint64_t> values_;
  std::vector<Run> runs_;
};

/// Decodes special values, and restores them among values that have been decoded.
class SpecialValuesDecoder {
 public:
  /// Reads the coded form, and removes it from the beginning of `bytes`. `scalars` is the largest
  /// possible number of scalars of the array in the group or part. `reference` contains the
  /// reference values of the part, or is empty. Returns nothing if the data is damaged.
  static std::optional<SpecialValuesDecoder> read(const ArrayInfo& info,
                                                  std::span<const std::byte>& bytes,
                                                  std::uint64_t scalars,
                                                  std::span<const std::byte> reference = {});
  /// Restores the special values among the next values of the group or part. Returns false if the
  /// data is damaged.
  bool restore(std::span<std::byte> values);
  /// Returns true if all special values have been restored.
  bool at_end() const { return runs_ == 0; }

 private:
  bool read_runs(ByteReader& in);
  bool next_run();

  std::size_t width_ = 0;
  std::vector<std::byte> unpacked_;
  std::vector<std::uint64_t> values_;
  // Positions of the next gap, length and value in `unpacked_`, and of the ends of the gaps and
  // lengths
  std::size_t gap_at_ = 0, length_at_ = 0, value_at_ = 0;
  std::size_t gap_end_ = 0, length_end_ = 0;
  std::uint64_t runs_ = 0;                 // number of runs that are not complete
  std::uint64_t to_run_ = 0, in_run_ = 0;  // number of scalars before and in the next run
  std::uint64_t bits_ = 0;                 // value of the next run
};

}  // namespace shm
