#include "mesh/lossy.h"

#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <optional>
#include <system_error>

#include "base/failure.h"

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

// Statistics of the coordinates, or of all values of an array: the range of each component, and a
// histogram of binary exponents. The statistics are collected in one pass.
class Statistics {
 public:
  Statistics(ScalarType type, std::uint32_t components)
      : bits_(8.0 * static_cast<double>(scalar_bytes(type))),
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
    if (!(std::fabs(value) < kLargest)) return;
    minimum_[c] = std::min(minimum_[c], value);
    maximum_[c] = std::max(maximum_[c], value);
    if (value == 0) return;
    ++values_;
    ++counts_[std::bit_cast<std::uint64_t>(value) << 1 >> 53];
  }

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
  std::uint64_t elements, steps;
  Fetch fetch;
};

Statistics measured(const Values& values, const Progress& progress) {
  Statistics statistics(values.type, values.components);
  const std::size_t stride = values.components * scalar_bytes(values.type);
  const std::uint64_t piece = std::max<std::uint64_t>(1, kPieceBytes / stride);
  std::vector<std::byte> bytes;
  for (std::uint64_t step = 0; step < values.steps; ++step) {
    for (std::uint64_t first = 0; first < values.elements; first += piece) {
      const std::uint64_t count = std::min(piece, values.elements - first);
      bytes.resize(count * stride);
      values.fetch(step, first, count, bytes.data());
      if (values.type == ScalarType::float32)
        statistics.add<float>(bytes);
      else
        statistics.add<double>(bytes);
    }
    if (progress) progress("measuring " + values.name, step + 1, values.steps);
  }
  return statistics;
}

Quantization quantization_of(const Accuracy& accuracy, const Values& values, bool is_box,
                             const Progress& progress) {
  if (accuracy.kind == Accuracy::Kind::lossless) return {};
  const Statistics statistics = measured(values, progress);
  if (accuracy.kind == Accuracy::Kind::bits) return statistics.box(accuracy.bits);
  double bound = accuracy.bound;
  if (accuracy.kind == Accuracy::Kind::relative)
    bound =
        std::min(bound * (is_box ? statistics.largest_side() : statistics.range()), kLargest / 2);
  // If all values are equal, their range is 0, and so is the bound. The values are then stored
  // losslessly, which needs no more space, because equal values compress well in any case.
  if (!(bound > 0) || statistics.mostly_exact(bound)) return {};
  Quantization quantization = Quantization::absolute(bound, values.components);
  quantization.spacing = statistics.best_step(bound);
  return quantization;
}

std::string path_of(const Schema& schema, std::size_t array) {
  constexpr std::string_view kPrefix = "array:";
  return array_stream_name(schema, array).substr(kPrefix.size());
}

std::size_t array_named(const Schema& schema, const std::string& name) {
  std::vector<std::size_t> fitting;
  std::string paths;
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    const std::string path = path_of(schema, a);
    if (path == name) return a;
    if (schema.arrays[a].name != name) continue;
    fitting.push_back(a);
    paths += (paths.empty() ? "" : " or ") + ("'" + path + "'");
  }
  if (fitting.empty()) wrong_use("--array: the mesh has no array '" + name + "'");
  if (fitting.size() > 1)
    wrong_use("--array: several arrays are called '" + name + "'; use " + paths);
  return fitting.front();
}

bool is_lossy(const Accuracy& accuracy) { return accuracy.kind != Accuracy::Kind::lossless; }

std::vector<Accuracy> accuracy_of_arrays(const Schema& schema, const Accuracy& of_fields) {
  std::vector<Accuracy> list(schema.arrays.size());
  for (std::size_t a = 0; a < list.size(); ++a)
    if (is_float(schema.arrays[a].type) && schema.arrays[a].role.empty()) list[a] = of_fields;
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
  if (kind != "bits")
    wrong_use(option + ": '" + std::string(text) +
              "' is none of lossless, abs=E, rel=E and bits=N");
  const auto bits = number_in<std::uint32_t>(rest);
  if (!bits || *bits < 1 || *bits > 52)
    wrong_use(option + ": '" + std::string(rest) + "' is not a number of bits from 1 to 52");
  return Accuracy::of_bits(*bits);
}

NamedAccuracy parse_named_accuracy(const std::string& text, const std::string& option) {
  // Split at the last colon, because names may contain colons, but accuracies do not.
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || colon == 0)
    wrong_use(option + ": '" + text + "' is not NAME:abs=E, :rel=E, :bits=N or :lossless");
  return {text.substr(0, colon), parse_accuracy(std::string_view(text).substr(colon + 1), option)};
}

void set_accuracy(MeshSource& mesh, const Lossy& lossy, Schema& schema, const Progress& progress) {
  const MeshInfo& info = mesh.info();
  Accuracy of_coordinates = lossy.coordinates;
  std::vector<Accuracy> of_arrays = accuracy_of_arrays(schema, lossy.fields);
  std::vector<std::string> named;
  for (const auto& [name, accuracy] : lossy.named) {
    std::string path(kCoordinates);
    if (name == kCoordinates) {
      of_coordinates = accuracy;
    } else {
      const std::size_t a = array_named(schema, name);
      const ArrayInfo& array = schema.arrays[a];
      path = path_of(schema, a);
      if (is_lossy(accuracy) && !is_float(array.type))
        wrong_use("--array: '" + name + "' holds " + std::string(scalar_name(array.type)) +
                  ", and integers are never rounded");
      of_arrays[a] = accuracy;
    }
    if (std::find(named.begin(), named.end(), path) != named.end())
      wrong_use("--array: '" + path + "' comes twice");
    named.push_back(std::move(path));
  }

  schema.coordinate_quantization =
      quantization_of(of_coordinates,
                      {std::string(kCoordinates), schema.coordinate_type, 3, info.vertices, 1,
                       [&](std::uint64_t, std::uint64_t first, std::uint64_t count,
                           std::byte* out) { mesh.read_points(first, count, out); }},
                      true, progress);
  for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
    ArrayInfo& array = schema.arrays[a];
    const std::uint64_t steps = array.per_step ? info.step_times.size() : 1;
    array.quantization = quantization_of(
        of_arrays[a],
        {array.name, array.type, array.components, info.array_elements(a), steps,
         [&mesh, a](std::uint64_t step, std::uint64_t first, std::uint64_t count, std::byte* out) {
           mesh.read_array(a, step, first, count, out);
         }},
        false, progress);
  }
}

}  // namespace shm::converters
