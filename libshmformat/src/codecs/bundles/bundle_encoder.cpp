#include "codecs/bundles/bundle_encoder.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "base/number_map.h"
#include "codecs/patterns/byte_planes.h"
#include "codecs/patterns/linear_indices.h"
#include "codecs/shifts/difference_values.h"

namespace shm {
namespace {

constexpr int kTrialZstdLevel = 1;
/// Number of elements in the sample with which the predictor and the domain of a large column are
/// chosen. A column is large if it stores more than twice this number of elements.
constexpr std::size_t kSampledElements = 2048;
/// Approximate number of bytes of the description of a coded column, and of its prediction.
constexpr std::size_t kDescriptionBytes = 3, kPredictionBytes = 4;
/// Approximate number of bytes of a scaled copy.
constexpr std::size_t kScaledBytes = 8;

std::uint64_t hash_of(std::span<const std::uint64_t> words) {
  std::uint64_t hash = words.size();
  for (const std::uint64_t word : words) hash = (hash ^ word) * 0x9e3779b97f4a7c15u ^ hash >> 29;
  return hash;
}

/// Returns the index of the first value that is finite and not zero, or the number of values.
std::size_t pivot_of(ScalarType type, std::span<const std::uint64_t> words) {
  const auto is_pivot = [type](std::uint64_t word) {
    const double value = scalar_as_double(type, word);
    return std::isfinite(value) && value != 0;
  };
  return static_cast<std::size_t>(std::find_if(words.begin(), words.end(), is_pivot) -
                                  words.begin());
}

/// Returns a hash of the rounded ratios of some values to one of them. If a column is a multiple of
/// another, the hashes of both are equal, unless rounding is unlucky.
std::uint64_t outline_of(ScalarType type, std::span<const std::uint64_t> words) {
  const std::size_t pivot = pivot_of(type, words);
  std::uint64_t hash = words.size() * 31 + pivot;
  if (pivot == words.size()) return hash;
  const double divisor = scalar_as_double(type, words[pivot]);
  for (std::size_t i = 1; i <= 8; ++i) {
    const double ratio = scalar_as_double(type, words[i * (words.size() - 1) / 8]) / divisor;
    // The bits of a NaN that results from a division depend on the machine.
    const auto rounded = std::isfinite(ratio) ? static_cast<float>(ratio) : 0.0f;
    hash = (hash ^ (std::bit_cast<std::uint32_t>(rounded) + (1 << 9)) >> 10) * 0x9e3779b97f4a7c15u;
  }
  return hash;
}

/// Returns a factor by which the float32 numbers `source` must be multiplied to become `words`, if
/// there is one. Each number restricts the factor to an interval.
double factor_of_floats(std::span<const std::uint64_t> source,
                        std::span<const std::uint64_t> words) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  double low = -kInfinity, high = kInfinity;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const double from = scalar_as_double(ScalarType::float32, source[i]);
    const double to = scalar_as_double(ScalarType::float32, words[i]);
    if (!std::isfinite(from) || !std::isfinite(to) || from == 0) continue;
    const double half = std::fabs(to) * 0x1p-25;  // at most half the distance to the next number
    const double a = (to - half) / from, b = (to + half) / from;
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return low + (high - low) / 2;
}

/// Returns the factor by which `source` must be multiplied to become `words`, or 0 if there is
/// none.
double factor_between(ScalarType type, std::span<const std::uint64_t> source,
                      std::span<const std::uint64_t> words) {
  const std::size_t pivot = pivot_of(type, words);
  if (source.size() != words.size() || pivot == words.size()) return 0;
  const double ratio = scalar_as_double(type, words[pivot]) / scalar_as_double(type, source[pivot]);
  if (!std::isfinite(ratio) || ratio == 0) return 0;
  // The ratio of two rounded numbers is near the factor. Many factors have few decimal digits.
  const bool is_narrow = type == ScalarType::float32;
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(ratio);
  const DecimalSpace decimals{is_narrow ? 6 : 12};
  std::vector<double> candidates = {decimals.state(decimals.index(ratio))};
  if (is_narrow) {
    candidates.push_back(factor_of_floats(source, words));
  } else {
    for (std::uint64_t by = 0; by <= 4; ++by)
      candidates.push_back(std::bit_cast<double>(bits + by - 2));
  }
  for (const double factor : candidates) {
    const auto fits = [&](std::uint64_t from, std::uint64_t to) {
      return scaled(type, from, factor) == to;
    };
    if (std::isfinite(factor) &&
        std::equal(source.begin(), source.end(), words.begin(), words.end(), fits))
      return factor;
  }
  return 0;
}

/// Returns the predictors that differ from each other for a column with these stored values.
std::vector<BundlePredictor> predictors_for(const StoredValues& stored) {
  std::vector<BundlePredictor> all = {BundlePredictor::nothing};
  if (stored.steps > 1) all.push_back(BundlePredictor::step);
  if (stored.steps > 2) all.push_back(BundlePredictor::steps);
  if (stored.elements > 1) all.push_back(BundlePredictor::element);
  if (stored.elements > 1 && stored.steps > 1) all.push_back(BundlePredictor::both);
  return all;
}

/// Returns words one after the other, each little-endian in `width` bytes.
std::vector<std::byte> bytes_of(std::span<const std::uint64_t> words, std::uint32_t width) {
  std::vector<std::byte> bytes;
  for (const std::uint64_t word : words)
    for (std::uint32_t b = 0; b < width; ++b)
      bytes.push_back(static_cast<std::byte>(word >> 8 * b));
  return bytes;
}

/// Returns the shape of a column that is not constant. `words` contains its words, step after step.
ColumnShape shape_of(std::span<const std::uint64_t> words, std::size_t steps) {
  const std::size_t elements = words.size() / steps;
  bool is_fixed = true, is_uniform = true;
  for (std::size_t s = 0; s < steps && (is_fixed || is_uniform); ++s)
    for (std::size_t e = 0; e < elements; ++e) {
      is_fixed = is_fixed && words[s * elements + e] == words[e];
      is_uniform = is_uniform && words[s * elements + e] == words[s * elements];
    }
  return is_fixed ? ColumnShape::fixed : is_uniform ? ColumnShape::uniform : ColumnShape::full;
}

}  // namespace

/// Returns the words of a column as a reader restores them, step after step.
std::vector<std::uint64_t> BundlePlanner::words_of(const ArrayInfo& info,
                                                   const ValuesOfSteps& values,
                                                   std::size_t component) const {
  const std::size_t width = scalar_bytes(info.type), stride = width * info.components;
  const std::size_t elements = values[0].size() / stride;
  std::vector<std::uint64_t> words(steps_ * elements);
  for (std::size_t s = 0; s < steps_; ++s)
    load(values[s].data() + component * width, stride, width,
         std::span(words).subspan(s * elements, elements));
  if (info.quantization.lossy()) round_quantized(info, component, words);
  return words;
}

/// Returns an earlier column that has these words and can be planned in the same way, or nullptr.
const BundlePlanner::Known* BundlePlanner::known(const ArrayInfo& info, std::uint64_t hash,
                                                 std::span<const std::uint64_t> words) const {
  if (info.quantization.lossy()) return nullptr;
  const auto [first, last] = known_.equal_range(hash);
  for (auto it = first; it != last; ++it) {
    const Known& other = it->second;
    if (other.info->type != info.type) continue;
    const auto theirs = words_of(*other.info, *other.values, other.component);
    if (std::equal(theirs.begin(), theirs.end(), words.begin(), words.end())) return &other;
  }
  return nullptr;
}

/// Finds an earlier column whose values, multiplied by a factor, are these words. `outline` is the
/// outline of the words.
void BundlePlanner::find_source(const ArrayInfo& info, std::span<const std::uint64_t> words,
                                std::uint64_t outline, PlannedColumn& column) const {
  const auto [first, last] = outlines_.equal_range(outline);
  for (auto it = first; it != last; ++it) {
    const Known& other = it->second;
    if (other.info->type != info.type) continue;
    column.factor =
        factor_between(info.type, words_of(*other.info, *other.values, other.component), words);
    if (column.factor == 0) continue;
    column.source = other.column;
    column.bytes = std::min(column.bytes, kScaledBytes);
    return;
  }
}

PlannedColumns BundlePlanner::plan(const ArrayInfo& info, const ValuesOfSteps& values) {
  PlannedColumns columns;
  for (std::size_t c = 0; c < info.components; ++c) {
    const auto words = words_of(info, values, c);
    PlannedColumn column;
    column.value_bytes = static_cast<std::uint32_t>(scalar_bytes(info.type));
    if (std::all_of(words.begin(), words.end(), [&](auto word) { return word == words[0]; })) {
      column.form = words[0] == 0 ? ColumnForm::zero : ColumnForm::constant;
      column.base = words[0];
      column.bytes = words[0] == 0 ? 1 : 1 + column.value_bytes;
      columns.push_back(std::make_shared<const PlannedColumn>(std::move(column)));
      continue;
    }
    const std::uint64_t hash = hash_of(words);
    if (const Known* earlier = known(info, hash, words)) {
      columns.push_back(earlier->column);
      continue;
    }
    column.form = ColumnForm::coded;
    choose(info, c, words, column);
    const bool may_be_scaled = is_float(info.type) && !info.quantization.lossy();
    const std::uint64_t outline = may_be_scaled ? outline_of(info.type, words) : 0;
    if (may_be_scaled) find_source(info, words, outline, column);
    columns.push_back(std::make_shared<const PlannedColumn>(std::move(column)));
    if (info.quantization.lossy()) continue;
    const Known own{&info, &values, c, columns.back()};
    known_.insert({hash, own});
    if (may_be_scaled && !columns.back()->source) outlines_.insert({outline, own});
  }
  return columns;
}

/// Returns the approximate number of bytes after compression.
std::size_t BundlePlanner::size_of(std::span<const std::byte> bytes) {
  return std::min(bytes.size(), trial_.compress(bytes, kTrialZstdLevel).size());
}

/// Returns the approximate number of bytes of a column with residuals. Stops at `most` bytes.
std::size_t BundlePlanner::size_of_residuals(const PlannedColumn& column, std::size_t most) {
  std::size_t bytes = kDescriptionBytes;
  if (column.predictor != BundlePredictor::nothing) bytes += kPredictionBytes;
  for (std::uint32_t b = 0; b < column.width && bytes < most; ++b)
    bytes += size_of(
        std::span(column.stored)
            .subspan(b * column.stored.size() / column.width, column.stored.size() / column.width));
  return bytes;
}

/// Chooses the shape, the domain and the predictor of a coded column.
void BundlePlanner::choose(const ArrayInfo& info, std::size_t component,
                           std::span<const std::uint64_t> words, PlannedColumn& column) {
  column.shape = shape_of(words, steps_);
  const std::size_t elements = words.size() / steps_;
  const StoredValues stored = StoredValues::of(column.shape, steps_, elements);
  column.count = stored.count();
  // The stored words, element after element.
  std::vector<std::uint64_t> by_element(column.count);
  for (std::size_t e = 0; e < stored.elements; ++e)
    for (std::size_t s = 0; s < stored.steps; ++s)
      by_element[e * stored.steps + s] = words[s * elements + e];

  // A sample of a large array: the elements in the middle
  const bool has_sample = stored.elements > 2 * kSampledElements;
  StoredValues of_sample = stored;
  if (has_sample) of_sample.elements = kSampledElements;
  const auto sample =
      std::span<const std::uint64_t>(by_element)
          .subspan((stored.elements - of_sample.elements) / 2 * stored.steps, of_sample.count());

  std::vector<ValueDomain> domains = {is_float(info.type) ? ValueDomain() : widest_domain(info)};
  if (is_float(info.type)) {
    ValueDomain even = evenly_spaced_domain(info, component, sample);
    if (has_sample && !(even == ValueDomain()))
      even = evenly_spaced_domain(info, component, by_element);
    if (!(even == ValueDomain())) domains.push_back(even);
  }
  column.predictor = BundlePredictor::words;
  column.stored = bytes_of(sample, column.value_bytes);
  column.bytes = size_of(column.stored) + kDescriptionBytes;
  for (const ValueDomain& domain : domains)
    choose_prediction(info, component, sample, domain, of_sample, column);
  if (!has_sample) return;
  if (column.predictor == BundlePredictor::words) {
    column.stored = bytes_of(by_element, column.value_bytes);
    column.bytes = size_of(column.stored) + kDescriptionBytes;
  } else {
    translate(info, component, by_element, column.domain);
    store_residuals(info, stored, column);
    column.bytes = size_of_residuals(column, ~std::size_t{0});
  }
}

/// Tries all predictors in a domain. Changes the column if it becomes smaller.
void BundlePlanner::choose_prediction(const ArrayInfo& info, std::size_t component,
                                      std::span<const std::uint64_t> words,
                                      const ValueDomain& domain, const StoredValues& stored,
                                      PlannedColumn& column) {
  translate(info, component, words, domain);
  PlannedColumn tried;
  tried.domain = domain;
  for (const BundlePredictor predictor : predictors_for(stored)) {
    tried.predictor = predictor;
    store_residuals(info, stored, tried);
    tried.bytes = size_of_residuals(tried, column.bytes);
    if (tried.bytes >= column.bytes) continue;
    column.bytes = tried.bytes;
    column.predictor = predictor;
    column.domain = domain;
    column.width = tried.width;
    column.base = tried.base;
    column.stored.swap(tried.stored);
  }
}

/// Stores the indices of words in a domain.
void BundlePlanner::translate(const ArrayInfo& info, std::size_t component,
                              std::span<const std::uint64_t> words, const ValueDomain& domain) {
  indices_.resize(words.size());
  with_translation(info, component, domain, [&](auto&& index_of, auto&&) {
    for (std::size_t i = 0; i < words.size(); ++i) indices_[i] = index_of(words[i]);
  });
}

/// Stores the residuals of a column, with its predictor and domain. Its indices must have been
/// stored.
void BundlePlanner::store_residuals(const ArrayInfo& info, const StoredValues& stored,
                                    PlannedColumn& column) {
  const std::size_t count = indices_.size();
  residuals_.resize(count);
  const auto index = [&](std::size_t s, std::size_t e) { return indices_[e * stored.steps + s]; };
  std::uint64_t all = 0;
  with_differences(info.type, column.domain.kind, [&](const auto& differences) {
    for (std::size_t e = 0; e < stored.elements; ++e)
      for (std::size_t s = 0; s < stored.steps; ++s) {
        const std::size_t i = e * stored.steps + s;
        residuals_[i] = differences.residual(
            indices_[i], predict(differences, column.predictor, indices_[0], s, e, index));
        all |= residuals_[i];
      }
  });
  column.width = bytes_for(all);
  column.base = static_cast<std::uint64_t>(indices_[0]);
  column.stored.resize(column.width * count);
  for (std::uint32_t b = 0; b < column.width; ++b)
    for (std::size_t i = 0; i < count; ++i)
      column.stored[b * count + i] = static_cast<std::byte>(residuals_[i] >> 8 * b);
}

bool BundleEncoder::needs_no_values(const PlannedColumns& columns) const {
  return std::all_of(columns.begin(), columns.end(), [&](const auto& column) {
    return column->form != ColumnForm::coded || has_values_of(*column);
  });
}

bool BundleEncoder::add(const PlannedColumns& columns) {
  if (columns.size() > kMostBundleColumns - columns_.size()) return false;
  const std::size_t before = columns_.size();
  const std::uint64_t values_before = values_;
  for (const auto& plan : columns) {
    Column column{plan, 0, false};
    if (plan->form == ColumnForm::coded) {
      const PlannedColumn* const source = plan->source.get();
      column.is_scaled =
          !place_.contains(plan.get()) && source != nullptr && place_.contains(source);
      const auto [place, is_new] =
          place_.try_emplace(column.is_scaled ? source : plan.get(), columns_.size());
      if (is_new)
        values_ += plan->count;
      else
        column.distance = columns_.size() - place->second;
    }
    columns_.push_back(std::move(column));
  }
  if (values_ <= kMostBundleValues) return true;
  // Remove the columns again.
  columns_.resize(before);
  values_ = values_before;
  std::erase_if(place_, [before](const auto& place) { return place.second >= before; });
  return false;
}

/// Writes the details of a column.
void BundleEncoder::put_details(ByteWriter& out, const Column& column) const {
  const PlannedColumn& plan = *column.plan;
  if (column.distance > 0) out.put_varint(column.distance);
  if (column.is_scaled) out.put_f64(plan.factor);
  if (plan.form == ColumnForm::constant)
    for (std::uint32_t b = 0; b < plan.value_bytes; ++b)
      out.put_u8(static_cast<std::uint8_t>(plan.base >> 8 * b));
  if (!column.has_residuals()) return;
  out.put_u8(static_cast<std::uint8_t>(plan.domain.kind));
  if (plan.domain.kind == DomainKind::binary || plan.domain.kind == DomainKind::decimal)
    out.put_signed(plan.domain.exponent);
  out.put_u8(static_cast<std::uint8_t>(plan.width));
  if (plan.predictor != BundlePredictor::nothing)
    out.put_signed(static_cast<std::int64_t>(plan.base));
}

std::vector<std::byte> BundleEncoder::finish() {
  ByteWriter head, details, out;
  for (const Column& column : columns_) {
    const ColumnForm form = column.distance > 0 ? ColumnForm::copy : column.plan->form;
    auto method = static_cast<unsigned>(form);
    if (column.is_scaled) method |= kScaledCopy;
    if (column.is_coded())
      method |= static_cast<unsigned>(column.plan->shape) << 2 |
                static_cast<unsigned>(column.plan->predictor) << 4;
    head.put_u8(static_cast<std::uint8_t>(method));
    put_details(details, column);
  }
  head.put_bytes(details.bytes);
  ZstdCompressor zstd;
  out.put_varint(head.bytes.size());
  put_plane(out, head.bytes, zstd, level_);

  std::vector<std::byte> plane;
  for (std::uint32_t b = 0; b < 8; ++b) {
    plane.clear();
    for (const Column& column : columns_)
      if (column.has_residuals() && column.plan->width > b) {
        const auto from =
            column.plan->stored.begin() + static_cast<std::ptrdiff_t>(b * column.plan->count);
        plane.insert(plane.end(), from, from + static_cast<std::ptrdiff_t>(column.plan->count));
      }
    if (!plane.empty()) put_plane(out, plane, zstd, level_);
  }
  plane.clear();
  for (const Column& column : columns_)
    if (column.has_words())
      plane.insert(plane.end(), column.plan->stored.begin(), column.plan->stored.end());
  if (!plane.empty()) put_plane(out, plane, zstd, level_);
  return std::move(out.bytes);
}

}  // namespace shm
