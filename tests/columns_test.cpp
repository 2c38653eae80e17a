// Columns of every type: each bit comes back, smooth values cost little, quantized ones keep the
// promise, and cell columns use the neighbours that they know.
#include "coders/columns.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

ArrayInfo info_of(ScalarType type, std::uint32_t components = 1) {
  ArrayInfo info;
  info.type = type;
  info.components = components;
  return info;
}

/// Codes `values` one after the other, with the stencil that `stencil(i)` says for slot i.
template <class StencilOf>
std::pair<Bytes, Bytes> vertex_round_trip(const ArrayInfo& info, const Bytes& values,
                                          StencilOf&& stencil) {
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  const auto count = static_cast<std::uint32_t>(values.size() / stride);
  RangeEncoder encoder;
  const auto writer = VertexColumn<RangeEncoder>::create(info);
  Bytes source = values;
  for (std::uint32_t i = 0; i < count; ++i)
    writer->code(encoder, stencil(i), i, source.data() + i * stride);
  EXPECT_EQ(source, values);  // only read
  Bytes coded = encoder.finish();
  RangeDecoder decoder(coded);
  const auto reader = VertexColumn<RangeDecoder>::create(info);
  Bytes back(values.size());
  for (std::uint32_t i = 0; i < count; ++i)
    reader->code(decoder, stencil(i), i, back.data() + i * stride);
  return {std::move(coded), std::move(back)};
}

/// Every kind of stencil in turn, over slots coded before.
Stencil any_stencil(std::uint32_t i) {
  if (i < 8) return {};
  Stencil s;
  s.kind = static_cast<Stencil::Kind>(i % 5);
  for (std::uint32_t n = 0; n < 7; ++n) s.at[n] = i - 1 - n;
  return s;
}

TEST(VertexColumn, EveryBitOfEveryType) {
  std::mt19937_64 random(1);
  for (int t = 1; t <= 10; ++t)
    for (std::uint32_t components : {1u, 2u, 5u}) {
      const auto type = static_cast<ScalarType>(t);
      Bytes values(400 * components * scalar_bytes(type));
      for (std::byte& b : values) b = static_cast<std::byte>(random());
      const auto back = vertex_round_trip(info_of(type, components), values, any_stencil).second;
      EXPECT_EQ(back, values) << scalar_name(type) << " x " << components;
    }
}

template <class T>
Bytes packed(const std::vector<T>& values) {
  Bytes bytes(values.size() * sizeof(T));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

TEST(VertexColumn, SpecialFloats) {
  using Limits = std::numeric_limits<double>;
  const std::vector<double> odd = {-0.0,
                                   0.0,
                                   Limits::infinity(),
                                   -Limits::infinity(),
                                   Limits::quiet_NaN(),
                                   Limits::signaling_NaN(),
                                   Limits::max(),
                                   Limits::lowest(),
                                   Limits::denorm_min(),
                                   -Limits::denorm_min(),
                                   Limits::min()};
  std::mt19937_64 random(2);
  std::vector<double> wide;
  std::vector<float> narrow;
  for (int i = 0; i < 2000; ++i) {
    wide.push_back(random() % 3 == 0 ? odd[random() % odd.size()] : static_cast<double>(i));
    narrow.push_back(std::bit_cast<float>(
        random() % 3 == 0 ? 0x7f800000u + static_cast<std::uint32_t>(random() % 3)
                          : static_cast<std::uint32_t>(random())));
  }
  EXPECT_EQ(vertex_round_trip(info_of(ScalarType::float64), packed(wide), any_stencil).second,
            packed(wide));
  EXPECT_EQ(vertex_round_trip(info_of(ScalarType::float32), packed(narrow), any_stencil).second,
            packed(narrow));
}

TEST(VertexColumn, WhatIsPredictedCostsNearlyNothing) {
  std::vector<double> line;
  std::vector<std::uint8_t> wrapped;
  for (int i = 0; i < 5000; ++i) {
    line.push_back(i);
    wrapped.push_back(static_cast<std::uint8_t>(i * 7));
  }
  const auto straight_on = [](std::uint32_t i) {
    Stencil s;
    if (i >= 3) s = {Stencil::parallelogram, {i - 1, i - 2, i - 3}};
    return s;
  };
  EXPECT_LT(vertex_round_trip(info_of(ScalarType::float64), packed(line), straight_on).first.size(),
            60u);
  // Integers wrap: 250 + 7 is 1.
  EXPECT_LT(
      vertex_round_trip(info_of(ScalarType::uint8), packed(wrapped), straight_on).first.size(),
      60u);
}

TEST(VertexColumn, QuantizedKeepsThePromiseOrTheValue) {
  std::mt19937_64 random(3);
  for (const bool narrow : {true, false})
    for (std::uint32_t bits : {1u, 2u, 7u, 16u, 24u, 40u, 52u}) {
      ArrayInfo info = info_of(narrow ? ScalarType::float32 : ScalarType::float64, 2);
      info.quantization = {bits, {-10, 0}, {10, 5}};
      std::vector<double> wide;
      std::vector<float> small;
      for (int i = 0; i < 2000; ++i) {
        double v = static_cast<double>(random() % 100001) / 5000 - 10;
        if (random() % 20 == 0) v *= 1e30;  // outside of the box
        if (random() % 20 == 0) v = std::numeric_limits<double>::quiet_NaN();
        if (random() % 20 == 0) v = std::numeric_limits<double>::infinity();
        wide.push_back(v);
        small.push_back(static_cast<float>(v));
      }
      const Bytes values = narrow ? packed(small) : packed(wide);
      const Bytes back = vertex_round_trip(info, values, any_stencil).second;
      const double promise = info.quantization.max_error(info.type);
      for (std::size_t i = 0; i < wide.size(); ++i) {
        double before = wide[i], after = 0;
        if (narrow) {
          before = small[i];
          float v = 0;
          std::memcpy(&v, &back[i * 4], 4);
          after = v;
        } else {
          std::memcpy(&after, &back[i * 8], 8);
        }
        const bool exact = std::memcmp(&before, &after, 8) == 0;
        ASSERT_TRUE(exact || std::fabs(before - after) <= promise)
            << before << ' ' << after << ' ' << bits;
        if (!std::isfinite(before)) {
          ASSERT_TRUE(exact || (std::isnan(before) && std::isnan(after)));
        }
      }
      // What has been restored is quantized to itself.
      // (finer steps than these are as fine as the rounding of the values)
      if (bits <= 40) {
        EXPECT_EQ(vertex_round_trip(info, back, any_stencil).second, back);
      }
    }
}

TEST(VertexColumn, QuantizedBoxWithoutVolume) {
  ArrayInfo info = info_of(ScalarType::float64);
  info.quantization = {16, {3}, {3}};
  const std::vector<double> values(100, 3.0);
  EXPECT_EQ(vertex_round_trip(info, packed(values), any_stencil).second, packed(values));
}

// --- cells

/// A row of cells, each behind face 1 of the next; every fourth not hexahedral.
std::vector<CellTopology> row_of_cells(std::uint32_t count) {
  std::vector<CellTopology> cells(count);
  std::uint32_t slot = 0, previous = kNone;
  for (std::uint32_t i = 0; i < count; ++i) {
    if (i % 4 == 3) continue;
    CellTopology& cell = cells[i];
    cell.hexahedral = true;
    cell.cell_slot = slot++;
    if (previous != kNone) {
      cell.face_mask = 1 << 1;
      cell.neighbour[1] = previous;
    }
    previous = cell.cell_slot;
  }
  return cells;
}

std::pair<Bytes, Bytes> cell_round_trip(const ArrayInfo& info, const Bytes& values,
                                        const std::vector<CellTopology>& cells,
                                        const std::vector<char>& covered) {
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  const auto run = [&](auto& coder, auto& column, Bytes& bytes) {
    std::size_t at = 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      if (covered[i] == 0) {
        column.skip(cells[i]);
        continue;
      }
      column.code(coder, cells[i], bytes.data() + at);
      at += stride;
    }
  };
  RangeEncoder encoder;
  Bytes source = values, back(values.size());
  run(encoder, *CellColumn<RangeEncoder>::create(info), source);
  Bytes coded = encoder.finish();
  RangeDecoder decoder(coded);
  run(decoder, *CellColumn<RangeDecoder>::create(info), back);
  return {std::move(coded), std::move(back)};
}

TEST(CellColumn, EveryBitOfEveryType) {
  std::mt19937_64 random(4);
  const auto cells = row_of_cells(500);
  std::vector<char> covered(cells.size());
  for (char& c : covered) c = random() % 5 != 0;
  const auto elements = static_cast<std::size_t>(std::count(covered.begin(), covered.end(), 1));
  for (int t = 1; t <= 10; ++t)
    for (std::uint32_t components : {1u, 4u}) {
      const auto type = static_cast<ScalarType>(t);
      Bytes values(elements * components * scalar_bytes(type));
      for (std::byte& b : values) b = static_cast<std::byte>(random());
      EXPECT_EQ(cell_round_trip(info_of(type, components), values, cells, covered).second, values)
          << scalar_name(type);
    }
}

TEST(CellColumn, EqualNeighboursCostNearlyNothing) {
  const auto cells = row_of_cells(4000);
  const std::vector<char> covered(cells.size(), 1);
  const std::vector<std::int32_t> values(cells.size(), 4711);
  EXPECT_LT(
      cell_round_trip(info_of(ScalarType::int32), packed(values), cells, covered).first.size(),
      40u);
  const std::vector<float> floats(cells.size(), 47.11f);
  EXPECT_LT(
      cell_round_trip(info_of(ScalarType::float32), packed(floats), cells, covered).first.size(),
      40u);
}

TEST(CellColumn, NonFiniteNeighboursDoNotSpread) {
  const auto cells = row_of_cells(400);
  const std::vector<char> covered(cells.size(), 1);
  std::vector<double> values(cells.size(), 1.5);
  values[5] = std::numeric_limits<double>::infinity();
  values[50] = std::numeric_limits<double>::quiet_NaN();
  const auto [coded, back] =
      cell_round_trip(info_of(ScalarType::float64), packed(values), cells, covered);
  EXPECT_EQ(back, packed(values));
  EXPECT_LT(coded.size(), 160u);
}

}  // namespace
}  // namespace shm
