#include "codecs/bundles/bundle_encoder.h"

#include <algorithm>

#include "base/number_map.h"
#include "codecs/patterns/byte_planes.h"
#include "codecs/patterns/linear_indices.h"
#include "codecs/shifts/difference_values.h"

namespace shm {
namespace {

constexpr int kTrialZstdLevel = 1;
/// Approximate number of bytes of the description of a coded column, and of its prediction.
constexpr std::size_t kDescriptionBytes = 3, kPredictionBytes = 4;

std::uint64_t hash_of(std::span<const std::uint64_t> words) {
  std::uint64_t hash = words.size();
  for (const std::uint64_t word : words) hash = (hash ^ word) * 0x9e3779b97f4a7c15u ^ hash >> 29;
  return hash;
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
    columns.push_back(std::make_shared<const PlannedColumn>(std::move(column)));
    if (!info.quantization.lossy()) known_.insert({hash, {&info, &values, c, columns.back()}});
  }
  return columns;
}

/// Returns the approximate number of bytes after compression.
std::size_t BundlePlanner::size_of(std::span<const std::byte> bytes) {
  return std::min(bytes.size(), trial_.compress(bytes, kTrialZstdLevel).size());
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

  column.predictor = BundlePredictor::words;
  column.stored.resize(column.count * column.value_bytes);
  save(by_element, column.stored.data(), column.value_bytes, column.value_bytes);
  column.bytes = size_of(column.stored) + kDescriptionBytes;
  choose_prediction(info, component, by_element,
                    is_float(info.type) ? ValueDomain() : widest_domain(info), stored, column);
  if (!is_float(info.type)) return;
  const ValueDomain even = evenly_spaced_domain(info, component, by_element);
  if (!(even == ValueDomain()))
    choose_prediction(info, component, by_element, even, stored, column);
}

/// Tries all predictors in a domain. Changes the column if it becomes smaller.
void BundlePlanner::choose_prediction(const ArrayInfo& info, std::size_t component,
                                      std::span<const std::uint64_t> words,
                                      const ValueDomain& domain, const StoredValues& stored,
                                      PlannedColumn& column) {
  const std::size_t count = words.size();
  std::vector<std::int64_t> indices(count);
  with_translation(info, component, domain, [&](auto&& index_of, auto&&) {
    for (std::size_t i = 0; i < count; ++i) indices[i] = index_of(words[i]);
  });
  const auto index = [&](std::size_t s, std::size_t e) { return indices[e * stored.steps + s]; };
  std::vector<std::uint64_t> residuals(count);
  std::vector<std::byte> planes;
  for (const BundlePredictor predictor : predictors_for(stored)) {
    std::uint64_t all = 0;
    with_differences(info.type, domain.kind, [&](const auto& differences) {
      for (std::size_t e = 0; e < stored.elements; ++e)
        for (std::size_t s = 0; s < stored.steps; ++s) {
          const std::size_t i = e * stored.steps + s;
          residuals[i] = differences.residual(
              indices[i], predict(differences, predictor, indices[0], s, e, index));
          all |= residuals[i];
        }
    });
    const std::uint32_t width = bytes_for(all);
    planes.resize(width * count);
    std::size_t bytes = kDescriptionBytes;
    if (predictor != BundlePredictor::nothing) bytes += kPredictionBytes;
    for (std::uint32_t b = 0; b < width && bytes < column.bytes; ++b) {
      const std::span plane = std::span(planes).subspan(b * count, count);
      for (std::size_t i = 0; i < count; ++i)
        plane[i] = static_cast<std::byte>(residuals[i] >> 8 * b);
      bytes += size_of(plane);
    }
    if (bytes >= column.bytes) continue;
    column.bytes = bytes;
    column.predictor = predictor;
    column.domain = domain;
    column.width = width;
    column.base = static_cast<std::uint64_t>(indices[0]);
    column.stored = planes;
  }
}

bool BundleEncoder::needs_no_values(const PlannedColumns& columns) const {
  return std::all_of(columns.begin(), columns.end(), [&](const auto& column) {
    return column->form != ColumnForm::coded || place_.contains(column.get());
  });
}

bool BundleEncoder::add(const PlannedColumns& columns) {
  std::uint64_t values = values_;
  for (std::size_t c = 0; c < columns.size(); ++c)
    if (columns[c]->form == ColumnForm::coded && !place_.contains(columns[c].get()) &&
        std::find(columns.begin(), columns.begin() + static_cast<std::ptrdiff_t>(c), columns[c]) ==
            columns.begin() + static_cast<std::ptrdiff_t>(c))
      values += columns[c]->count;
  if (values > kMostBundleValues || columns.size() > kMostBundleColumns - columns_.size())
    return false;
  values_ = values;
  for (const auto& plan : columns) {
    Column column{plan, 0};
    if (plan->form == ColumnForm::coded) {
      const auto [place, is_new] = place_.try_emplace(plan.get(), columns_.size());
      if (!is_new) column.distance = columns_.size() - place->second;
    }
    columns_.push_back(std::move(column));
  }
  return true;
}

/// Writes the details of a column.
void BundleEncoder::put_details(ByteWriter& out, const Column& column) const {
  const PlannedColumn& plan = *column.plan;
  if (column.distance > 0) out.put_varint(column.distance);
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
