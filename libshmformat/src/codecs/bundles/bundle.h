// Bundle: the values of several arrays at several steps, for the elements of one group. Small
// arrays with many steps are coded in this form, because a part for each array and step would need
// more bytes for its header and for its models than for its values.
//
// A column is one component of an array. It has a value for each step and element. In a column,
// values are predicted from the previous step and the previous element.
// spec: "Bundles"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/packing.h"
#include "codecs/shared/value_domain.h"
#include "codecs/shifts/differences.h"

namespace shm {

/// Limits of a bundle: the number of columns, and the number of values that are coded. Columns that
/// are zero, constant, or equal to another column have no coded values. Frozen: part of the format.
inline constexpr std::uint64_t kMostBundleColumns = std::uint64_t{1} << 15;
inline constexpr std::uint64_t kMostBundleValues = std::uint64_t{1} << 15;

/// An array of a bundle. `info` is borrowed.
struct BundleArray {
  const ArrayInfo* info = nullptr;
  std::uint64_t elements = 0;  ///< number of elements of the group, at least 1
};

/// How the words of a column are stored. Frozen: part of the format.
enum class ColumnForm : std::uint8_t {
  zero = 0,      ///< all words are 0
  constant = 1,  ///< all words are equal
  copy = 2,      ///< all values equal those of an earlier column, or are multiples of them
  coded = 3,
};
/// Which values of a coded column are stored. Frozen: part of the format.
enum class ColumnShape : std::uint8_t {
  full = 0,
  fixed = 1,    ///< those of the first step; all other steps have the same values
  uniform = 2,  ///< those of the first element; all other elements have the same values
};
/// In the method of a copy, states that the values are multiplied by a factor. Frozen: part of the
/// format.
inline constexpr unsigned kScaledCopy = 1 << 2;

/// Returns the bits of a value multiplied by `factor` and rounded to the type. A NaN stays as it
/// is. Precondition: `type` is a floating-point type.
std::uint64_t scaled(ScalarType type, std::uint64_t bits, double factor);

/// How a value is predicted. x(s, e) is the value of element e at step s. Frozen: part of the
/// format.
enum class BundlePredictor : std::uint8_t {
  words = 0,    ///< not predicted: the words are stored instead of residuals
  nothing = 1,  ///< 0
  step = 2,     ///< x(s-1, e)
  steps = 3,    ///< 2 x(s-1, e) - x(s-2, e)
  element = 4,  ///< x(s, e-1)
  both = 5,     ///< x(s-1, e) + x(s, e-1) - x(s-1, e-1)
};
inline constexpr std::uint8_t kBundlePredictors = 6;

/// The steps and elements of a column for which values are stored.
struct StoredValues {
  std::size_t steps = 0, elements = 0;

  static StoredValues of(ColumnShape shape, std::uint64_t steps, std::uint64_t elements) {
    return {static_cast<std::size_t>(shape == ColumnShape::fixed ? 1 : steps),
            static_cast<std::size_t>(shape == ColumnShape::uniform ? 1 : elements)};
  }
  std::size_t count() const { return steps * elements; }
};

/// Returns the predicted index of the value at step `s` and element `e`. index(s, e) returns the
/// index of an earlier value. `base` predicts the first value of a column. Sums are computed with
/// `differences`: of floating-point numbers in float64, of evenly spaced numbers in integers.
template <class Differences, class Index>
std::int64_t predict(const Differences& differences, BundlePredictor predictor, std::int64_t base,
                     std::size_t s, std::size_t e, const Index& index) {
  if (predictor == BundlePredictor::nothing) return 0;
  if (s == 0 && e == 0) return base;
  const auto state = [&](std::size_t step, std::size_t element) {
    return finite_state(differences, index(step, element));
  };
  const auto sum = [&](std::uint64_t a, std::uint64_t b, std::uint64_t less) {
    const auto both = Differences::add(Differences::sum_of(a), Differences::weight(1), b);
    return Differences::index(Differences::add(both, Differences::weight(-1), less));
  };
  if (s == 0 || (e > 0 && predictor == BundlePredictor::element)) return index(s, e - 1);
  if (predictor == BundlePredictor::both && e > 0)
    return sum(state(s - 1, e), state(s, e - 1), state(s - 1, e - 1));
  if (predictor == BundlePredictor::steps && s > 1)
    return sum(state(s - 1, e), state(s - 1, e), state(s - 2, e));
  return index(s - 1, e);
}

class Bundle {
 public:
  /// Reads a bundle. Returns nullopt if the data is damaged. Precondition: each array has at least
  /// one element, and `steps` is at least 1. The memory is about 200 bytes for each column, plus 8
  /// bytes for each coded value, plus the size of `bytes`.
  static std::optional<Bundle> read(std::span<const std::byte> bytes,
                                    std::span<const BundleArray> arrays, std::uint64_t steps);

  /// Returns the values of an array at a step, packed.
  std::vector<std::byte> values(std::size_t array, std::uint64_t step) const;

 private:
  struct Column {
    ColumnForm form = ColumnForm::zero;
    ColumnShape shape = ColumnShape::full;
    std::size_t elements = 0, width = 0;  // width: bytes of a value
    std::size_t first = 0;  // index in words_ of the first value; constants have one value
    ScalarType type = ScalarType::float64;
    std::optional<double> factor{};  // of a scaled copy
  };
  struct Coded;

  bool read_columns(std::span<const std::byte> bytes, std::span<const BundleArray> arrays,
                    std::uint64_t steps);

  struct Array {
    std::size_t first_column, components, width, elements;
  };
  std::vector<Array> arrays_;
  std::vector<Column> columns_;
  std::vector<std::uint64_t> words_;
  std::uint64_t steps_ = 0;
};

}  // namespace shm
