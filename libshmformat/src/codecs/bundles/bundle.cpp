#include "codecs/bundles/bundle.h"

#include <array>
#include <bit>
#include <cmath>

#include "base/binary.h"
#include "codecs/patterns/byte_planes.h"
#include "codecs/patterns/linear_indices.h"
#include "codecs/shifts/difference_values.h"

namespace shm {

/// A coded column while the bundle is read: how its values are stored.
struct Bundle::Coded {
  std::size_t column = 0;
  const ArrayInfo* info = nullptr;
  std::size_t component = 0;
  StoredValues stored;
  BundlePredictor predictor = BundlePredictor::words;
  ValueDomain domain;
  std::uint32_t width = 0;  ///< size in bytes of a residual or word
  std::int64_t base = 0;
};

namespace {

/// Reads the description of a coded column that has a predictor.
bool get_prediction(ByteReader& in, const ArrayInfo& info, BundlePredictor predictor,
                    ValueDomain& domain, std::uint32_t& width, std::int64_t& base) {
  const std::uint8_t kind = in.get_u8();
  if (kind >= kDomainKinds) return false;
  domain.kind = static_cast<DomainKind>(kind);
  if (domain.kind == DomainKind::binary || domain.kind == DomainKind::decimal) {
    const std::int64_t exponent = in.get_signed();
    domain.exponent = static_cast<std::int32_t>(exponent);
    if (domain.exponent != exponent) return false;
  }
  width = in.get_u8();
  if (predictor != BundlePredictor::nothing) base = in.get_signed();
  return in.ok() && may_be(info, domain) && width <= most_bytes(info.type, domain.kind);
}

}  // namespace

std::uint64_t scaled(ScalarType type, std::uint64_t bits, double factor) {
  if (type == ScalarType::float32) {
    const auto value = std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    if (std::isnan(value)) return bits;
    return std::bit_cast<std::uint32_t>(static_cast<float>(static_cast<double>(value) * factor));
  }
  const auto value = std::bit_cast<double>(bits);
  return std::isnan(value) ? bits : std::bit_cast<std::uint64_t>(value * factor);
}

std::optional<Bundle> Bundle::read(std::span<const std::byte> bytes,
                                   std::span<const BundleArray> arrays, std::uint64_t steps) {
  Bundle bundle;
  if (!bundle.read_columns(bytes, arrays, steps)) return std::nullopt;
  return bundle;
}

bool Bundle::read_columns(std::span<const std::byte> bytes, std::span<const BundleArray> arrays,
                          std::uint64_t steps) {
  std::uint64_t columns = 0;
  for (const BundleArray& array : arrays) {
    arrays_.push_back({static_cast<std::size_t>(columns), array.info->components,
                       scalar_bytes(array.info->type), to_size(array.elements)});
    columns += array.info->components;
    if (columns > kMostBundleColumns) return false;
  }
  ByteReader in(bytes);
  constexpr std::uint64_t kMostHeadBytes = 24;  // of a column
  ZstdDecompressor zstd;
  std::vector<std::byte> heads;
  const std::uint64_t head_bytes = in.get_varint();
  if (head_bytes < columns || head_bytes > kMostHeadBytes * columns ||
      !get_plane(in, head_bytes, heads, zstd))
    return false;
  ByteReader head(heads);
  const auto methods = head.get_bytes(columns);
  if (!head.ok()) return false;

  columns_.resize(static_cast<std::size_t>(columns));
  std::vector<Coded> coded;
  std::uint64_t values = 0;
  std::array<std::uint64_t, 8> plane_bytes{};
  std::uint64_t word_bytes = 0;
  std::size_t c = 0;
  for (const BundleArray& array : arrays)
    for (std::size_t component = 0; component < array.info->components; ++component, ++c) {
      Column& column = columns_[c];
      const std::size_t width = scalar_bytes(array.info->type);
      const auto method = std::to_integer<unsigned>(methods[c]);
      column.form = static_cast<ColumnForm>(method & 3);
      column.elements = to_size(array.elements);
      column.width = width;
      column.type = array.info->type;
      const bool is_scaled =
          column.form == ColumnForm::copy && (method & kScaledCopy) != 0 && is_float(column.type);
      if (column.form != ColumnForm::coded && method > 3 + (is_scaled ? kScaledCopy : 0))
        return false;
      switch (column.form) {
        case ColumnForm::zero: break;
        case ColumnForm::constant: {
          std::uint64_t word = 0;
          for (std::size_t b = 0; b < width; ++b) word |= std::uint64_t{head.get_u8()} << 8 * b;
          column.first = words_.size();
          words_.push_back(word);
          break;
        }
        case ColumnForm::copy: {
          const std::uint64_t distance = head.get_varint();
          if (distance == 0 || distance > c) return false;
          const std::size_t s = c - static_cast<std::size_t>(distance);
          const bool is_coded = (methods[s] & std::byte{3}) == std::byte{3};
          if (!is_coded || columns_[s].elements != column.elements || columns_[s].width != width)
            return false;
          if (is_scaled && columns_[s].type != column.type) return false;
          column = columns_[s];
          column.type = array.info->type;
          if (!is_scaled) break;
          column.factor = head.get_f64();
          if (!std::isfinite(*column.factor)) return false;
          break;
        }
        case ColumnForm::coded: {
          const unsigned shape = method >> 2 & 3, predictor = method >> 4;
          if (shape > 2 || predictor >= kBundlePredictors) return false;
          column.shape = static_cast<ColumnShape>(shape);
          Coded it{c,
                   array.info,
                   component,
                   StoredValues::of(column.shape, steps, array.elements),
                   static_cast<BundlePredictor>(predictor),
                   {},
                   static_cast<std::uint32_t>(width),
                   0};
          // The product of the two counts is at most 2^30 after this check of each of them.
          if ((column.shape != ColumnShape::fixed && steps > kMostBundleValues) ||
              (column.shape != ColumnShape::uniform && array.elements > kMostBundleValues))
            return false;
          values += it.stored.count();
          if (values > kMostBundleValues) return false;
          if (it.predictor == BundlePredictor::words) {
            word_bytes += it.stored.count() * width;
          } else {
            if (!get_prediction(head, *array.info, it.predictor, it.domain, it.width, it.base))
              return false;
            for (std::uint32_t b = 0; b < it.width; ++b) plane_bytes[b] += it.stored.count();
          }
          column.first = words_.size();
          words_.resize(words_.size() + it.stored.count());
          coded.push_back(it);
          break;
        }
      }
    }
  if (!head.ok() || head.left() > 0) return false;

  // The words of the coded columns, element after element.
  std::vector<std::byte> plane;
  for (std::uint32_t b = 0; b < 8; ++b) {
    if (plane_bytes[b] == 0) continue;
    if (!get_plane(in, plane_bytes[b], plane, zstd)) return false;
    const std::byte* from = plane.data();
    for (const Coded& it : coded) {
      if (it.predictor == BundlePredictor::words || it.width <= b) continue;
      std::uint64_t* const to = words_.data() + columns_[it.column].first;
      for (std::size_t i = 0; i < it.stored.count(); ++i)
        to[i] |= std::to_integer<std::uint64_t>(*from++) << 8 * b;
    }
  }
  if (word_bytes > 0 && !get_plane(in, word_bytes, plane, zstd)) return false;
  if (in.left() > 0) return false;
  const std::byte* from = plane.data();
  for (const Coded& it : coded) {
    const std::span words(words_.data() + columns_[it.column].first, it.stored.count());
    if (it.predictor == BundlePredictor::words) {
      for (std::uint64_t& word : words)
        for (std::uint32_t b = 0; b < it.width; ++b)
          word |= std::to_integer<std::uint64_t>(*from++) << 8 * b;
      continue;
    }
    const std::size_t steps_stored = it.stored.steps;
    const auto index = [&](std::size_t s, std::size_t e) {
      return static_cast<std::int64_t>(words[e * steps_stored + s]);
    };
    with_differences(it.info->type, it.domain.kind, [&](const auto& differences) {
      for (std::size_t e = 0; e < it.stored.elements; ++e)
        for (std::size_t s = 0; s < steps_stored; ++s) {
          std::uint64_t& word = words[e * steps_stored + s];
          word = static_cast<std::uint64_t>(
              differences.value(word, predict(differences, it.predictor, it.base, s, e, index)));
        }
    });
    if (linear_values(it.info->type, it.domain, words)) continue;
    with_translation(*it.info, it.component, it.domain, [&](auto&&, auto&& bits_of) {
      for (std::uint64_t& word : words) word = bits_of(static_cast<std::int64_t>(word));
    });
  }
  steps_ = steps;
  return true;
}

std::vector<std::byte> Bundle::values(std::size_t array, std::uint64_t step) const {
  const Array& it = arrays_[array];
  const std::size_t stride = it.components * it.width;
  std::vector<std::byte> out(stride * it.elements);
  for (std::size_t c = 0; c < it.components; ++c) {
    const Column& column = columns_[it.first_column + c];
    if (column.form == ColumnForm::zero) continue;
    // Distance between the words of two elements, and the word of the first element.
    std::size_t distance = 0, word = column.first;
    if (column.form != ColumnForm::constant) {
      const bool is_fixed = column.shape == ColumnShape::fixed;
      if (column.shape != ColumnShape::uniform)
        distance = is_fixed ? 1 : static_cast<std::size_t>(steps_);
      if (!is_fixed) word += static_cast<std::size_t>(step);
    }
    std::byte* to = out.data() + c * it.width;
    for (std::size_t e = 0; e < it.elements; ++e, to += stride, word += distance) {
      const std::uint64_t bits =
          column.factor ? scaled(column.type, words_[word], *column.factor) : words_[word];
      store_scalar(to, bits, it.width);
    }
  }
  return out;
}

}  // namespace shm
