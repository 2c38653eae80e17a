#include "accuracy/lossy.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <system_error>
#include <utility>

#include "accuracy/block_bounds.h"
#include "accuracy/value_sample.h"
#include "base/failure.h"
#include "base/stored_value.h"
#include "mesh/array_names.h"

namespace shm::converters {
namespace {

// Largest magnitude that the arithmetic of the quantization supports. Larger values, infinities and
// NaN are kept exactly.
constexpr double kLargest = 1e300;
constexpr std::size_t kPieceBytes = std::size_t{1} << 20;
constexpr std::string_view kCoordinates = "coordinates";

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  Number number{};
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || rest != end) return std::nullopt;
  return number;
}

// Returns the base-2 logarithm of a positive number, accurate to 1e-5 and identical on every
// machine.
double binary_log(double number) {
  int exponent = 0;
  const double fraction = std::frexp(number, &exponent);  // 0.5 to 1
  const double x = (fraction - 1) / (fraction + 1), square = x * x;
  constexpr double kTwoOverLog2 = 2.885390081777927;
  return exponent +
         kTwoOverLog2 * x *
             (1 + square * (1.0 / 3 + square * (1.0 / 5 + square * (1.0 / 7 + square / 9))));
}

// Returns 10^x for -300 <= x <= 0, accurate to 1e-12 and identical on every machine.
double power_of_ten(double x) {
  constexpr double kLogOfTen = 2.302585092994046;
  const double whole = std::floor(x), part = (x - whole) * kLogOfTen;
  double power = 1, term = 1;
  for (int i = 1; i < 40; ++i) {
    term *= part / i;
    power += term;
  }
  for (double i = whole; i < 0; ++i) power /= 10;
  return power;
}

// Statistics of the coordinates, or of all values of an array: the range of each component, and a
// histogram of binary exponents. The statistics are collected in one pass.
class Statistics {
 public:
  Statistics(ScalarType type, std::uint32_t components, std::span<const double> fills)
      : fills_(fills),
        bits_(8.0 * static_cast<double>(scalar_bytes(type))),
        ulp_exponent_(type == ScalarType::float32 ? -23 : -52),
        minimum_(components, std::numeric_limits<double>::max()),
        maximum_(components, std::numeric_limits<double>::lowest()) {}

  template <class Real>
  void add(const std::vector<std::byte>& values) {
    const std::size_t components = minimum_.size();
    for (std::size_t offset = 0; offset < values.size();)
      for (std::size_t c = 0; c < components; ++c, offset += sizeof(Real)) {
        Real value;
        std::memcpy(&value, values.data() + offset, sizeof value);
        add(static_cast<double>(value), c);
      }
  }

  // Returns a quantization that divides the bounding box of the values into uniform steps. A
  // component gets the range [0, 0] if all its values are infinite, NaN or too large.
  Quantization box(std::uint32_t bits) const {
    Quantization box{bits, minimum_, maximum_};
    for (std::size_t c = 0; c < minimum_.size(); ++c)
      if (minimum_[c] > maximum_[c]) box.minimum[c] = box.maximum[c] = 0;
    return box;
  }
  double largest_side() const {
    double side = 0;
    for (std::size_t c = 0; c < minimum_.size(); ++c)
      side = std::max(side, maximum_[c] - minimum_[c]);
    return side;
  }
  double range() const {
    return std::max(0.0, *std::max_element(maximum_.begin(), maximum_.end()) -
                             *std::min_element(minimum_.begin(), minimum_.end()));
  }
  bool has_outliers() const { return sample_.has_outliers(range()); }
  // Returns the quantization step with the lowest cost for an error bound. Normally the best step
  // is about twice the bound. However, a restored value is rounded to the stored type, so its error
  // is a whole multiple of the distance between neighbouring numbers of this type. If the bound is
  // not much larger than this distance, a step of twice the bound may cause errors above the bound,
  // and the affected values must be stored exactly. A step that is an odd multiple of the distance
  // can avoid this. The distance depends on the magnitude of a value. Therefore, for each
  // magnitude, the largest step that keeps the bound is a candidate.
  double best_step(double bound) const {
    // Start with slightly less than twice the bound. Values midway between two quantization levels
    // are common (e.g. decimal fractions). Rounding such a value in either direction must not cause
    // an error above the bound.
    double best = 2 * bound * (1 - 0x1p-20), least = cost(best, bound);
    for (std::size_t e = 0; e < kExponents; ++e) {
      if (counts_[e] == 0) continue;
      const double step = longest_step(e, bound), bits = cost(step, bound);
      if (bits < least) best = step, least = bits;
    }
    return best;
  }
  // Returns true if most values are so large that the distance to the next number of the stored
  // type exceeds twice the bound.
  bool mostly_exact(double bound) const {
    std::uint64_t exact = 0;
    for (std::size_t e = 0; e < kExponents; ++e)
      if (ulp(e) > 2 * bound) exact += counts_[e];
    return 2 * exact > values_;
  }

 private:
  static constexpr std::size_t kExponents = 2047;  // number of exponents of finite binary64 numbers
  static constexpr int kBias = 1023;

  // Returns the distance between neighbouring numbers of the stored type, for values with biased
  // exponent `e`.
  double ulp(std::size_t e) const {
    return std::ldexp(1.0, std::max(static_cast<int>(e) - kBias + ulp_exponent_, -1074));
  }
  double longest_step(std::size_t e, double bound) const {
    const double distance = ulp(e), ratio = bound / distance;
    // If the bound exceeds the distance between neighbouring numbers by this factor, the error of
    // rounding to the stored type is negligible.
    constexpr double kFine = 0x1p20;
    return ratio > kFine ? 2 * bound * (1 - 0x1p-20) : (2 * std::floor(ratio) + 1) * distance;
  }
  // Returns the estimated cost of the quantization step `step` in bits per value, except for a term
  // that does not depend on `step`. A value that is stored exactly costs all its bits, plus 4 bits
  // to mark it.
  double cost(double step, double bound) const {
    double exact = 0;
    for (std::size_t e = 0; e < kExponents; ++e)
      if (counts_[e] != 0)
        exact += static_cast<double>(counts_[e]) * std::max(0.0, 1 - longest_step(e, bound) / step);
    exact /= static_cast<double>(values_);
    return exact * (bits_ + 4) - (1 - exact) * binary_log(step / bound);
  }
  void add(double value, std::size_t c) {
    if (!(std::fabs(value) < kLargest) || is_fill_value(fills_, value)) return;
    sample_.add(value);
    minimum_[c] = std::min(minimum_[c], value);
    maximum_[c] = std::max(maximum_[c], value);
    if (value == 0) return;
    ++values_;
    ++counts_[std::bit_cast<std::uint64_t>(value) << 1 >> 53];
  }

  std::span<const double> fills_;
  ValueSample sample_;
  double bits_;       // number of bits of a value in the stored type
  int ulp_exponent_;  // base-2 logarithm of the distance between neighbouring numbers in [1, 2)
  std::vector<double> minimum_, maximum_;
  // Number of values by biased exponent; zeros are not counted.
  std::array<std::uint64_t, kExponents> counts_{};
  std::uint64_t values_ = 0;  // sum of counts_
};

using Fetch = std::function<void(std::uint64_t step, std::uint64_t first, std::uint64_t count,
                                 std::byte* out)>;

// The values that share one quantization: the coordinates, or the values of one array.
struct Values {
  std::string name;
  ScalarType type;
  std::uint32_t components;
  std::span<const double> fills;
  std::uint64_t elements, steps;
  Fetch fetch;
};

// Calls visit(bytes) for pieces of all values. `verb` describes the work in the progress line.
void for_each_piece(const Values& values, const char* verb, const Progress& progress,
                    const std::function<void(const std::vector<std::byte>&)>& visit) {
  const std::size_t stride = values.components * scalar_bytes(values.type);
  const std::uint64_t piece = std::max<std::uint64_t>(1, kPieceBytes / stride);
  std::vector<std::byte> bytes;
  for (std::uint64_t step = 0; step < values.steps; ++step) {
    for (std::uint64_t first = 0; first < values.elements; first += piece) {
      const std::uint64_t count = std::min(piece, values.elements - first);
      bytes.resize(count * stride);
      values.fetch(step, first, count, bytes.data());
      visit(bytes);
    }
    if (progress) progress(verb + (" " + values.name), step + 1, values.steps);
  }
}

Statistics measured(const Values& values, const Progress& progress) {
  Statistics statistics(values.type, values.components, values.fills);
  for_each_piece(values, "measuring", progress, [&](const std::vector<std::byte>& bytes) {
    if (values.type == ScalarType::float32)
      statistics.add<float>(bytes);
    else
      statistics.add<double>(bytes);
  });
  return statistics;
}

Quantization within(double bound, const Values& values, const Statistics& statistics) {
  Quantization quantization = Quantization::absolute(bound, values.components);
  quantization.spacing = statistics.best_step(bound);
  return quantization;
}

// Sum of the squared errors that a quantization causes.
class SquaredErrors {
 public:
  explicit SquaredErrors(Quantization quantization) : quantization_(std::move(quantization)) {}
  const Quantization& quantization() const { return quantization_; }

  template <class Real>
  void add(Real value) {
    const auto number = static_cast<double>(value);
    const double index = std::floor(number / quantization_.spacing + .5);
    const auto restored = static_cast<double>(static_cast<Real>(index * quantization_.spacing));
    const double error = std::fabs(restored - number);
    // Values that would change by more than the bound are stored exactly.
    if (error <= quantization_.max_abs) sum_ += error * error;
  }
  double sum() const { return sum_; }

 private:
  Quantization quantization_;
  double sum_ = 0;
};

// Returns the quantization with the largest error bound of which the root mean square of the errors
// is at most `rms`. Errors that are distributed evenly have a root mean square of the bound divided
// by the square root of 3.
Quantization within_rms(double rms, const Values& values, const Statistics& statistics,
                        const Progress& progress) {
  std::vector<SquaredErrors> candidates;
  for (const double factor : {1.73, 1.72, 1.7, 1.6, 1.5, 1.4, 1.3, 1.2, 1.1, 1.0})
    candidates.emplace_back(within(rms * factor, values, statistics));
  std::uint64_t number = 0;
  const auto add = [&](auto zero, const std::vector<std::byte>& bytes) {
    for (std::size_t at = 0; at < bytes.size(); at += sizeof zero) {
      auto value = zero;
      std::memcpy(&value, bytes.data() + at, sizeof value);
      const auto wide = static_cast<double>(value);
      if (!(std::fabs(wide) < kLargest) || is_fill_value(values.fills, wide)) continue;
      ++number;
      for (SquaredErrors& candidate : candidates) candidate.add(value);
    }
  };
  for_each_piece(values, "measuring errors of", progress, [&](const std::vector<std::byte>& bytes) {
    if (values.type == ScalarType::float32)
      add(float{}, bytes);
    else
      add(double{}, bytes);
  });
  // The sum is rounded, so a small part of the bound is left unused.
  const double most = rms * rms * static_cast<double>(number) * (1 - 0x1p-20);
  for (const SquaredErrors& candidate : candidates)
    if (candidate.sum() <= most) return candidate.quantization();
  return candidates.back().quantization();
}

Quantization quantization_of(const Accuracy& accuracy, const Values& values, bool is_box,
                             const Progress& progress) {
  if (accuracy.kind == Accuracy::Kind::lossless) return {};
  if (accuracy.kind == Accuracy::Kind::pointwise)
    return Quantization::relative(accuracy.bound, values.type);
  const Statistics statistics = measured(values, progress);
  if (accuracy.kind == Accuracy::Kind::bits) return statistics.box(accuracy.bits);
  const double range = is_box ? statistics.largest_side() : statistics.range();
  double bound = accuracy.bound;
  if (accuracy.kind == Accuracy::Kind::relative) bound *= range;
  if (accuracy.kind == Accuracy::Kind::psnr) bound = range * power_of_ten(-bound / 20) * (1 - 1e-9);
  if (accuracy.kind == Accuracy::Kind::relative || accuracy.kind == Accuracy::Kind::psnr) {
    bound = std::min(bound, kLargest / 2);
    if (statistics.has_outliers()) warn_of_outliers(values.name);
  }
  // If all values are equal, their range is 0, and so is the bound. The values are then stored
  // losslessly, which needs no more space, because equal values compress well in any case.
  if (!(bound > 0) || statistics.mostly_exact(bound)) return {};
  return accuracy.kind == Accuracy::Kind::rms || accuracy.kind == Accuracy::Kind::psnr
             ? within_rms(bound, values, statistics, progress)
             : within(bound, values, statistics);
}

bool is_lossy(const Accuracy& accuracy) { return accuracy.kind != Accuracy::Kind::lossless; }

std::vector<Accuracy> accuracy_of_arrays(const Schema& schema, const Accuracy& of_fields) {
  std::vector<Accuracy> list(schema.arrays.size());
  for (std::size_t a = 0; a < list.size(); ++a)
    if (const ArrayInfo& array = schema.arrays[a];
        is_float(array.type) && array.role.empty() && array.location != Location::global)
      list[a] = of_fields;
  return list;
}

}  // namespace

Accuracy parse_accuracy(std::string_view text, const std::string& option) {
  if (text == "lossless") return {};
  const std::size_t equals = text.find('=');
  const std::string_view kind = text.substr(0, equals);
  const std::string_view rest = equals == text.npos ? "" : text.substr(equals + 1);
  const auto positive_below = [&](double limit, const std::string& limit_text) {
    const auto number = number_in<double>(rest);
    if (!number || !(*number > 0 && *number < limit))
      wrong_use(option + ": '" + std::string(rest) + "' is not a number above 0 and below " +
                limit_text);
    return *number;
  };
  if (kind == "abs") return Accuracy::absolute(positive_below(kLargest, "1e300"));
  if (kind == "rel") return Accuracy::relative(positive_below(1, "1"));
  if (kind == "rms") return {Accuracy::Kind::rms, 0, positive_below(kLargest / 2, "5e299")};
  if (kind == "psnr") return {Accuracy::Kind::psnr, 0, positive_below(300, "300")};
  if (kind == "pwrel") return {Accuracy::Kind::pointwise, 0, positive_below(.5, "0.5")};
  if (kind == "digits") {
    constexpr std::uint32_t kMostDigits = 15;
    const auto digits = number_in<std::uint32_t>(rest);
    if (!digits || *digits < 1 || *digits > kMostDigits)
      wrong_use(option + ": '" + std::string(rest) + "' is not a number of digits from 1 to 15");
    // A number of N digits is at most 10^N units of its last digit.
    return {Accuracy::Kind::pointwise, 0, .5 * power_of_ten(-static_cast<double>(*digits))};
  }
  if (kind != "bits")
    wrong_use(option + ": '" + std::string(text) +
              "' is none of lossless, abs=E, rel=E, rms=E, psnr=DB, pwrel=E, digits=N and bits=N");
  const auto bits = number_in<std::uint32_t>(rest);
  if (!bits || *bits < 1 || *bits > 52)
    wrong_use(option + ": '" + std::string(rest) + "' is not a number of bits from 1 to 52");
  return Accuracy::of_bits(*bits);
}

NamedAccuracy parse_named_accuracy(const std::string& text, const std::string& option) {
  const std::size_t colon = last_unescaped(text, ':');
  if (colon == std::string::npos || colon == 0)
    wrong_use(option + ": '" + text +
              "' is not NAME:abs=E, :rel=E, :rms=E, :psnr=DB, :pwrel=E, :digits=N, :bits=N or "
              ":lossless");
  return {text.substr(0, colon), parse_accuracy(std::string_view(text).substr(colon + 1), option)};
}

double parse_fill(std::string_view text, const std::string& option) {
  const auto value = number_in<double>(text);
  if (!value || !std::isfinite(*value))
    wrong_use(option + ": '" + std::string(text) + "' is not a finite number");
  return *value;
}

std::optional<NamedFill> parse_named_fill(const std::string& text, const std::string& option) {
  constexpr std::string_view kFill = "fill=";
  const std::size_t colon = last_unescaped(text, ':');
  if (colon == std::string::npos || colon == 0) return std::nullopt;
  const auto how = std::string_view(text).substr(colon + 1);
  if (!how.starts_with(kFill)) return std::nullopt;
  return NamedFill{text.substr(0, colon), parse_fill(how.substr(kFill.size()), option)};
}

namespace {

// Adds a fill value to an array, rounded to the type of the array. If the type has no such number,
// adds nothing, because the array cannot contain it.
void add_fill(double fill, ArrayInfo& array) {
  if (array.type == ScalarType::float32) fill = static_cast<double>(static_cast<float>(fill));
  if (std::isfinite(fill) && !is_fill_value(array.fills, fill)) array.fills.push_back(fill);
}

// A name that may end with "@BLOCK".
struct OfBlock {
  std::string name;
  std::optional<std::string> block;
};

// Splits a name at its last @, unless a backslash precedes the @, or an array has the whole name.
OfBlock split_at_block(const Schema& schema, const std::string& name) {
  const std::size_t at = last_unescaped(name, '@');
  const std::vector<std::string> paths = paths_of(schema);
  for (std::size_t a = 0; a < paths.size(); ++a)
    if (name == paths[a] || name == schema.arrays[a].name) return {name, {}};
  if (at == std::string::npos) return {name, {}};
  return {name.substr(0, at), unescaped(std::string_view(name).substr(at + 1))};
}

// Returns true if the accuracy can apply to the array. Throws Failure (misuse) if the array is an
// integer array with a name that is not a pattern.
bool applies(const Accuracy& accuracy, const ArrayInfo& array, const std::string& name,
             bool is_pattern) {
  if (!is_lossy(accuracy) || is_float(array.type)) return true;
  if (!is_pattern)
    wrong_use("--array: '" + name + "' holds " + std::string(scalar_name(array.type)) +
              ", and integers are never rounded");
  return false;
}

// Sets the accuracies of selected arrays: first those with wildcards, then those of single arrays.
void select(const Lossy& lossy, const Schema& schema, Accuracy& of_coordinates,
            std::vector<Accuracy>& of_arrays) {
  constexpr std::size_t kOfCoordinates = ~std::size_t{0};
  std::vector<std::pair<std::size_t, Accuracy>> exact;
  for (const auto& [name, accuracy] : lossy.named) {
    if (split_at_block(schema, name).block) continue;
    CalledArrays called;
    if (name == kCoordinates && accuracy.kind == Accuracy::Kind::pointwise)
      wrong_use("--array: coordinates cannot have a bound relative to each value");
    if (name == kCoordinates)
      called.arrays = {kOfCoordinates};
    else
      called = arrays_called(schema, name, "--array");
    bool has_any = !called.is_pattern || !is_lossy(accuracy);
    for (const std::size_t a : called.arrays) {
      if (!called.is_pattern) {
        const auto is_same = [a](const auto& other) { return other.first == a; };
        if (std::any_of(exact.begin(), exact.end(), is_same))
          wrong_use("--array: '" + name + "' comes twice");
        exact.emplace_back(a, accuracy);
      }
      if (a == kOfCoordinates || !applies(accuracy, schema.arrays[a], name, called.is_pattern))
        continue;
      has_any = true;
      if (called.is_pattern) of_arrays[a] = accuracy;
    }
    if (!has_any)
      wrong_use("--array: all arrays '" + name + "' hold integers, and integers are never rounded");
  }
  for (const auto& [a, accuracy] : exact)
    (a == kOfCoordinates ? of_coordinates : of_arrays[a]) = accuracy;
}

}  // namespace

void add_fills(const Lossy& lossy, Schema& schema) {
  for (ArrayInfo& array : schema.arrays)
    if (is_float(array.type) && array.role.empty())
      for (const double fill : lossy.fills) add_fill(fill, array);
  for (const auto& [name, fill] : lossy.named_fills) {
    const CalledArrays called = arrays_called(schema, name, "--array");
    for (const std::size_t a : called.arrays) {
      ArrayInfo& array = schema.arrays[a];
      if (is_float(array.type))
        add_fill(fill, array);
      else if (!called.is_pattern)
        wrong_use("--array: '" + name + "' holds " + std::string(scalar_name(array.type)) +
                  ", and only floating-point arrays have fill values");
    }
  }
}

bool has_block_bounds(const Schema& schema, const Lossy& lossy) {
  return std::any_of(lossy.named.begin(), lossy.named.end(), [&](const NamedAccuracy& it) {
    return split_at_block(schema, it.name).block.has_value();
  });
}

std::vector<std::vector<BlockAccuracy>> accuracies_of_blocks(const Schema& schema,
                                                             const Lossy& lossy) {
  std::vector<Accuracy> of_arrays = accuracy_of_arrays(schema, lossy.fields);
  Accuracy of_coordinates;
  select(lossy, schema, of_coordinates, of_arrays);
  std::vector<std::vector<BlockAccuracy>> all(schema.arrays.size());
  std::set<std::pair<std::size_t, std::uint32_t>> exact;
  const auto set = [&](const NamedAccuracy& named, const OfBlock& split, bool patterns) {
    const CalledArrays called = arrays_called(schema, split.name, "--array");
    if (called.is_pattern != patterns) return;
    bool has_any = false;
    for (const std::size_t a : called.arrays) {
      const ArrayInfo& array = schema.arrays[a];
      if (array.location != Location::cell) continue;
      if (!applies(named.accuracy, array, split.name, called.is_pattern)) continue;
      for (const std::uint32_t block : blocks_called(schema.blocks, *split.block, "--array")) {
        if (!array.blocks.empty() &&
            !std::binary_search(array.blocks.begin(), array.blocks.end(), block))
          continue;
        has_any = true;
        if (!patterns && !exact.emplace(a, block).second)
          wrong_use("--array: '" + named.name + "' comes twice");
        if (all[a].empty()) all[a].resize(schema.blocks.size(), {of_arrays[a], false});
        all[a][block] = {named.accuracy, true};
      }
    }
    if (!has_any) wrong_use("--array: no array '" + named.name + "' has cell data in the block");
  };
  for (const bool patterns : {true, false})
    for (const NamedAccuracy& named : lossy.named)
      if (const OfBlock split = split_at_block(schema, named.name); split.block)
        set(named, split, patterns);
  for (const auto& blocks : all)
    for (const BlockAccuracy& it : blocks)
      if (it.accuracy.kind != Accuracy::Kind::lossless &&
          it.accuracy.kind != Accuracy::Kind::absolute &&
          it.accuracy.kind != Accuracy::Kind::relative)
        wrong_use("--array: arrays with NAME@BLOCK need abs=E, rel=E or lossless in all blocks");
  return all;
}

void set_accuracy(MeshSource& mesh, const Lossy& lossy, Schema& schema, const Progress& progress) {
  const MeshInfo& info = mesh.info();
  Accuracy of_coordinates = lossy.coordinates;
  std::vector<Accuracy> of_arrays = accuracy_of_arrays(schema, lossy.fields);
  select(lossy, schema, of_coordinates, of_arrays);
  schema.coordinate_quantization =
      quantization_of(of_coordinates,
                      {std::string(kCoordinates),
                       schema.coordinate_type,
                       3,
                       {},
                       info.vertices,
                       1,
                       [&](std::uint64_t, std::uint64_t first, std::uint64_t count,
                           std::byte* out) { mesh.read_points(first, count, out); }},
                      true, progress);
  const BlockBounds of_blocks =
      has_block_bounds(schema, lossy) ? block_bounds_in(info) : BlockBounds(schema.arrays.size());
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    ArrayInfo& array = schema.arrays[a];
    if (!of_blocks[a].empty()) of_arrays[a] = {};
    const std::uint64_t steps = array.per_step ? info.step_times.size() : 1;
    array.quantization = quantization_of(
        of_arrays[a],
        {array.name, array.type, array.components, array.fills, info.array_elements(a), steps,
         [&mesh, a](std::uint64_t step, std::uint64_t first, std::uint64_t count, std::byte* out) {
           mesh.read_array(a, step, first, count, out);
         }},
        false, progress);
  }
}

}  // namespace shm::converters
