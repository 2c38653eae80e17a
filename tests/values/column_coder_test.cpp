// Tests of columns of values over a mesh. All codecs must restore all kinds of values bit for bit,
// predictable values must need almost no bytes, and damaged bytes must be handled safely.
#include "codecs/surface/values/column_coder.h"
#include "codecs/shared/codec_id.h"
#include "codecs/surface/plan/column_planner.h"
#include "codecs/surface/plan/domain_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "values/appended_value.h"

namespace shm {
namespace {

using Encoder = ColumnPlanner;
using Decoder = ColumnDecoder;
using Bytes = std::vector<std::byte>;
using Point = std::array<std::uint32_t, 3>;

ArrayInfo info_of(ScalarType type, std::uint32_t components = 1) {
  ArrayInfo info;
  info.type = type;
  info.components = components;
  return info;
}

template <class T>
Bytes packed(const std::vector<T>& values) {
  Bytes bytes(values.size() * sizeof(T));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

/// The vertices or cells of a grid, in coding order.
struct Elements {
  TiledItems all;  // one tile
  std::vector<Point> points;

  std::size_t size() const { return all.items.size(); }

  /// Returns the elements from `begin` up to but excluding `end` as a group. The positions in
  /// `cuts` that are inside the group divide it into tiles.
  TiledItems group(std::size_t begin, std::size_t end, const std::vector<std::size_t>& cuts) const {
    TiledItems part;
    part.items.assign(all.items.begin() + static_cast<std::ptrdiff_t>(begin),
                      all.items.begin() + static_cast<std::ptrdiff_t>(end));
    if (!all.blocks.empty())
      part.blocks.assign(all.blocks.begin() + static_cast<std::ptrdiff_t>(begin),
                         all.blocks.begin() + static_cast<std::ptrdiff_t>(end));
    for (std::size_t cut : cuts)
      if (cut >= begin && cut < end) part.tile_begin.push_back(cut - begin);
    return part;
  }
};

Elements grid(const Point& n, bool cells) {
  Elements elements;
  NeighbourFinder finder(true);
  std::vector<char> met((n[0] + 1) * (n[1] + 1) * (n[2] + 1));
  for (std::uint32_t z = 0; z < n[2]; ++z)
    for (std::uint32_t y = 0; y < n[1]; ++y)
      for (std::uint32_t x = 0; x < n[0]; ++x) {
        CellTopology cell;
        cell.hexahedral = true;
        std::array<Point, 8> at{};
        for (std::uint32_t i = 0; i < 8; ++i) {
          const std::uint32_t bits = kCornerBits[i];
          at[i] = {x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2)};
          cell.slots.push_back(at[i][0] + (n[0] + 1) * (at[i][1] + (n[1] + 1) * at[i][2]));
        }
        for (std::uint8_t i : kCornerOrder)
          if (std::exchange(met[cell.slots[i]], 1) == 0) cell.new_positions.push_back(i);
        finder.begin_cell(cell, true, met.size());
        for (std::uint32_t position : cell.new_positions) {
          const Neighbourhood around = finder.vertex(cell, position, Reach::farther);
          if (cells) continue;
          elements.all.items.push_back(around);
          elements.points.push_back(at[position]);
        }
        const Neighbourhood around = finder.cell(cell, Reach::farther);
        if (cells) {
          elements.all.items.push_back(around);
          elements.all.blocks.push_back((x + y + z) % 3);
          elements.points.push_back({x, y, z});
        }
        finder.end_cell(cell);
      }
  return elements;
}

const Elements& vertices() {
  static const Elements elements = grid({13, 9, 7}, false);
  return elements;
}
const Elements& cells() {
  static const Elements elements = grid({12, 9, 7}, true);
  return elements;
}

struct Plan {
  std::vector<std::size_t> groups,
      tiles;  // the index of the element after each group or tile, except the final one
  std::vector<char> covers;
  Level level = Level::standard;
  bool copies = true;
  /// Function that returns the level of the group with the given index. If the function is empty,
  /// `level` applies to all groups.
  std::function<Level(std::size_t)> level_of;
};
struct Coded {
  std::vector<EncodedColumn> groups;
  std::size_t bytes = 0;
};

bool covers(const Plan& plan, std::uint32_t block) {
  return plan.covers.empty() || plan.covers[block] != 0;
}

/// Returns the list of blocks that `plan.covers` marks as covered, in the form that columns expect.
std::vector<std::uint32_t> covered_blocks(const Plan& plan) {
  std::vector<std::uint32_t> blocks;
  for (std::uint32_t b = 0; b < plan.covers.size(); ++b)
    if (plan.covers[b] != 0) blocks.push_back(b);
  if (blocks.empty() && !plan.covers.empty()) blocks.push_back(99);  // a block that no cell has
  return blocks;
}

std::size_t covered(const TiledItems& part, const Plan& plan) {
  if (part.blocks.empty()) return part.items.size();
  return static_cast<std::size_t>(
      std::count_if(part.blocks.begin(), part.blocks.end(),
                    [&](std::uint32_t block) { return covers(plan, block); }));
}

template <class Visit>
void for_each_group(const Elements& elements, const Plan& plan, Visit&& visit) {
  std::vector<std::size_t> ends = plan.groups;
  ends.push_back(elements.size());
  std::size_t begin = 0;
  for (std::size_t g = 0; g < ends.size(); ++g) {
    visit(g, elements.group(begin, ends[g], plan.tiles));
    begin = ends[g];
  }
}

Coded encode(const ArrayInfo& info, const Elements& elements, const Bytes& values,
             const Plan& plan) {
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  Encoder encoder(info, covered_blocks(plan), {.copies = plan.copies});
  Coded coded;
  std::size_t at = 0;
  for_each_group(elements, plan, [&](std::size_t g, const TiledItems& part) {
    const Level level = plan.level_of ? plan.level_of(g) : plan.level;
    coded.groups.push_back(encoder.encode(part, values.data() + at, stride, level));
    coded.bytes += coded.groups.back().bytes.size();
    at += covered(part, plan) * stride;
  });
  EXPECT_EQ(at, values.size());
  return coded;
}

/// Decodes the groups. Returns an empty optional if the bytes are invalid.
std::optional<Bytes> decode(const ArrayInfo& info, const Elements& elements, const Coded& coded,
                            const Plan& plan, std::uint64_t limit = 1 << 24) {
  Decoder decoder(info, covered_blocks(plan), {.copies = plan.copies});
  Bytes back;
  bool ok = true;
  for_each_group(elements, plan, [&](std::size_t g, const TiledItems& part) {
    ok = ok && decoder.begin_group(coded.groups[g].codec, coded.groups[g].bytes, limit);
    for (std::size_t t = 0; ok && t < part.tile_begin.size(); ++t)
      ok = decoder.decode_tile(part.tile(t), back);
  });
  if (!ok) return std::nullopt;
  return back;
}

/// Encodes the values and checks that they decode correctly. Returns the encoded size in bytes.
std::size_t expect_back(const ArrayInfo& info, const Elements& elements, const Bytes& values,
                        const Plan& plan = {}) {
  const Coded coded = encode(info, elements, values, plan);
  const auto back = decode(info, elements, coded, plan);
  EXPECT_TRUE(back.has_value());
  if (back) {
    EXPECT_TRUE(*back == values) << scalar_name(info.type) << " x " << info.components;
  }
  return coded.bytes;
}

template <class Value>
Bytes values_of(const Elements& elements, ScalarType type, std::uint32_t components,
                Value&& value) {
  Bytes bytes;
  for (const Point& p : elements.points)
    for (std::uint32_t c = 0; c < components; ++c) append_value(bytes, type, value(p, c));
  return bytes;
}

double smooth(const Point& p, std::uint32_t c) {
  return 40.0 * std::sin(0.2 * p[0] + 0.1 * p[1] + c) + 0.3 * p[2] * p[1] - 2.0 * c;
}

Plan some_plan(const Elements& elements, std::mt19937_64& random) {
  Plan plan;
  plan.level = static_cast<Level>(random() % 3);
  for (std::size_t at = 1 + random() % 400; at < elements.size(); at += 1 + random() % 400)
    plan.groups.push_back(at);
  for (std::size_t at = 1 + random() % 90; at < elements.size(); at += 1 + random() % 200)
    plan.tiles.push_back(at);
  return plan;
}

TEST(ColumnCoder, EveryBitOfEveryType) {
  std::mt19937_64 random(1);
  for (const Elements* elements : {&vertices(), &cells()})
    for (int t = 1; t <= 10; ++t)
      for (std::uint32_t components : {1u, 3u, 9u}) {
        const auto type = static_cast<ScalarType>(t);
        const ArrayInfo info = info_of(type, components);
        Bytes noise(elements->size() * components * scalar_bytes(type));
        for (std::byte& b : noise) b = static_cast<std::byte>(random());
        expect_back(info, *elements, noise, some_plan(*elements, random));
        expect_back(info, *elements, values_of(*elements, type, components, smooth),
                    some_plan(*elements, random));
      }
}

TEST(ColumnCoder, AllLevels) {
  const ArrayInfo info = info_of(ScalarType::float64, 3);
  const Bytes values = values_of(vertices(), ScalarType::float64, 3, smooth);
  std::vector<std::size_t> sizes;
  for (Level level : {Level::fast, Level::standard, Level::best}) {
    Plan plan;
    plan.groups = {300, 301, 700};
    plan.level = level;
    sizes.push_back(expect_back(info, vertices(), values, plan));
    EXPECT_LT(sizes.back(), values.size());
  }
}

TEST(ColumnCoder, SpecialFloats) {
  using Limits = std::numeric_limits<double>;
  const std::vector<double> special = {
      -0.0,          0.0,   Limits::infinity(),   -Limits::infinity(),    Limits::quiet_NaN(),
      Limits::max(), -1e23, Limits::denorm_min(), -Limits::denorm_min(),  Limits::min(),
      1e300,         0.1,   Limits::lowest(),     Limits::signaling_NaN()};
  std::mt19937_64 random(2);
  for (ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (std::uint64_t seldom : {1, 5, 100, 400})
      for (Level level : {Level::standard, Level::best}) {
        Plan plan = some_plan(vertices(), random);
        plan.level = level;
        const Bytes values = values_of(vertices(), type, 2, [&](const Point& p, std::uint32_t c) {
          if (random() % seldom == 0) return special[random() % special.size()];
          return seldom == 5 ? smooth(p, c) : 0.125 * p[0] - p[1];
        });
        expect_back(info_of(type, 2), vertices(), values, plan);
      }
}

// Each group contains a different kind of values from the previous group, and therefore has a
// different domain (the way in which values are mapped to integers). The coder must translate the
// values that it keeps to each new domain.
TEST(ColumnCoder, DomainsChange) {
  std::mt19937_64 random(3);
  // A NaN with the smallest possible index.
  const auto least = std::bit_cast<double>(~std::uint64_t{0});
  for (ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (Level level : {Level::fast, Level::standard, Level::best})
      for (int round = 0; round < 3; ++round) {
        Plan plan = some_plan(vertices(), random);
        plan.level = level;
        std::size_t i = 0;
        const auto value = [&](const Point& p, std::uint32_t c) {
          const auto group = std::upper_bound(plan.groups.begin(), plan.groups.end(), i / 3) -
                             plan.groups.begin() + round;
          ++i;
          const double v = smooth(p, c);
          switch (group % 8) {
            case 0: return std::round(v * 100) / 100;
            case 1: return std::round(v * 64) / 64;
            case 2: return v;
            case 3: return random() % 50 == 0 ? least : static_cast<double>(static_cast<float>(v));
            case 4: return std::sqrt(static_cast<double>(random() % 5));
            case 5: return random() % 9 == 0 ? -0.0 : std::round(v);
            case 6: return random() % 20 == 0 ? std::numeric_limits<double>::infinity() : v * 1e300;
            default: return v * 1e-312;
          }
        };
        expect_back(info_of(type, 3), vertices(), values_of(vertices(), type, 3, value), plan);
      }
}

TEST(ColumnCoder, BlocksWithoutValues) {
  std::mt19937_64 random(4);
  for (const std::vector<char>& covers :
       {std::vector<char>{1, 0, 1}, {0, 1, 0}, {0, 0, 0}, {1, 1, 1}}) {
    for (int round = 0; round < 6; ++round) {
      Plan plan = some_plan(cells(), random);
      plan.covers = covers;
      Elements some = cells();
      // In every second round, the cells of each block are consecutive. Some groups then have no
      // values.
      if (round % 2 == 0)
        for (std::size_t i = 0; i < some.size(); ++i)
          some.all.blocks[i] = static_cast<std::uint32_t>(i / 130 % 3);
      Elements only;
      for (std::size_t i = 0; i < some.size(); ++i)
        if (covers[some.all.blocks[i]] != 0) only.points.push_back(some.points[i]);
      for (ScalarType type : {ScalarType::int32, ScalarType::float64})
        expect_back(info_of(type, 2), some, values_of(only, type, 2, smooth), plan);
    }
  }
}

TEST(ColumnCoder, NoValuesAtAll) {
  Encoder encoder(info_of(ScalarType::float64), {});
  const EncodedColumn coded = encoder.encode({}, nullptr, 8, Level::best);
  Decoder decoder(info_of(ScalarType::float64), {});
  EXPECT_TRUE(decoder.begin_group(coded.codec, coded.bytes, 0));
  Bytes back;
  EXPECT_TRUE(decoder.decode_tile({}, back));
  EXPECT_TRUE(back.empty());
}

// The values are integers in a pattern that does not follow the mesh.
TEST(ColumnCoder, WhatRepeatsGoesUnderZstd) {
  std::mt19937_64 random(5);
  std::vector<std::int64_t> pattern(61);
  for (auto& it : pattern) it = static_cast<std::int64_t>(random() >> 1);
  std::vector<std::int64_t> values(vertices().size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = pattern[i % pattern.size()];
  const ArrayInfo info = info_of(ScalarType::int64);
  Plan plan;
  plan.groups = {500};
  for (Level level : {Level::fast, Level::standard, Level::best}) {
    plan.level = level;
    const Coded coded = encode(info, vertices(), packed(values), plan);
    EXPECT_EQ(coded.groups[0].codec, Codec::shuffled_zstd);
    EXPECT_LT(coded.groups[0].bytes.size(), 900u);
    expect_back(info, vertices(), packed(values), plan);
    // Groups with predicted values, packed values and mixed values alternate. The state of the
    // coder at the end of each group must be usable in the next group.
    for (std::size_t i = 300; i < 500; ++i) values[i] = static_cast<std::int64_t>(i);
    plan.groups = {100, 300, 500, 800};
    plan.level_of = [&](std::size_t g) { return static_cast<Level>(g % 3); };
    expect_back(info, vertices(), packed(values), plan);
    plan.level_of = nullptr;
    plan.groups = {500};
    for (std::size_t i = 300; i < 500; ++i) values[i] = pattern[i % pattern.size()];
  }
  // A reader refuses values that need more bytes than its limit.
  const Coded coded = encode(info, vertices(), packed(values), plan);
  EXPECT_FALSE(decode(info, vertices(), coded, plan, 100).has_value());
}

TEST(ColumnCoder, QuantizedKeepsThePromiseOrTheValue) {
  std::mt19937_64 random(6);
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (std::uint32_t bits : {1u, 7u, 16u, 24u, 40u, 52u, Quantization::kAbsolute}) {
      ArrayInfo info = info_of(type, 2);
      info.quantization = bits == Quantization::kAbsolute
                              ? Quantization::absolute(0.01, 2)
                              : Quantization{bits, {-50, -60}, {60, 50}, 0, 0};
      const Bytes values = values_of(vertices(), type, 2, [&](const Point& p, std::uint32_t c) {
        if (random() % 40 == 0) return smooth(p, c) * 1e30;  // outside the box
        if (random() % 40 == 0) return std::numeric_limits<double>::quiet_NaN();
        if (random() % 40 == 0) return -std::numeric_limits<double>::infinity();
        return smooth(p, c);
      });
      const Plan plan = some_plan(vertices(), random);
      const auto back = decode(info, vertices(), encode(info, vertices(), values, plan), plan);
      ASSERT_TRUE(back && back->size() == values.size());
      const double promise = info.quantization.max_error(type);
      const std::size_t width = scalar_bytes(type);
      for (std::size_t i = 0; i < values.size(); i += width) {
        const auto at = [&](const Bytes& from) {
          if (type == ScalarType::float64) {
            double v = 0;
            std::memcpy(&v, &from[i], 8);
            return v;
          }
          float v = 0;
          std::memcpy(&v, &from[i], 4);
          return static_cast<double>(v);
        };
        const double before = at(values), after = at(*back);
        const bool exact = std::memcmp(&values[i], &(*back)[i], width) == 0;
        ASSERT_TRUE(exact || std::fabs(before - after) <= promise) << before << ' ' << after;
      }
      // Quantizing the restored values again must not change them, unless quantization steps are as
      // small as the rounding errors of floats.
      if (bits <= 24) {
        expect_back(info, vertices(), *back, plan);
      }
    }
}

TEST(ColumnCoder, QuantizedBoxWithoutVolume) {
  ArrayInfo info = info_of(ScalarType::float64);
  info.quantization = {16, {3}, {3}, 0, 0};
  const std::vector<double> values(vertices().size(), 3.0);
  EXPECT_LT(expect_back(info, vertices(), packed(values)), 30u);
}

TEST(ColumnCoder, WhatIsPredictedCostsNearlyNothing) {
  const auto cost = [](const Elements& elements, ScalarType type, std::uint32_t components,
                       auto value) {
    return expect_back(info_of(type, components), elements,
                       values_of(elements, type, components, value));
  };
  const auto constant = [](const Point&, std::uint32_t) { return 47.11; };
  const auto linear = [](const Point& p, std::uint32_t c) {
    return 0.25 * p[0] - 1.5 * p[1] + 3.0 * p[2] + c;
  };
  const auto text = [](const Point& p, std::uint32_t) {
    return std::round(100.0 * (0.17 * p[0] - 1.31 * p[1] + 3.0 * p[2])) / 100.0;
  };
  for (const Elements* elements : {&vertices(), &cells()}) {
    EXPECT_LT(cost(*elements, ScalarType::float32, 1, constant), 40u);
    EXPECT_LT(cost(*elements, ScalarType::float64, 1, constant), 40u);
    EXPECT_LT(cost(*elements, ScalarType::int32, 1, constant), 40u);
    EXPECT_LT(cost(*elements, ScalarType::float64, 3, linear), 200u);
    EXPECT_LT(cost(*elements, ScalarType::float32, 1, linear), 100u);
    EXPECT_LT(cost(*elements, ScalarType::float64, 1, text), 120u);
  }
}

// If the values of the second component are equal or opposite to those of the first component, the
// second component needs almost no bytes.
TEST(ColumnCoder, EqualComponentsCostNearlyNothing) {
  std::mt19937_64 random(7);
  std::vector<double> one, two, opposite;
  for (std::size_t i = 0; i < vertices().size(); ++i) {
    const double v = static_cast<double>(random() % 1000003) / 7 - 60000;
    one.push_back(v);
    two.insert(two.end(), {v, v});
    opposite.insert(opposite.end(), {v, -v});
  }
  const std::size_t single = expect_back(info_of(ScalarType::float64), vertices(), packed(one));
  EXPECT_GT(single, 6 * one.size());  // noise
  EXPECT_LT(expect_back(info_of(ScalarType::float64, 2), vertices(), packed(two)), single + 300);
  EXPECT_LT(expect_back(info_of(ScalarType::float64, 2), vertices(), packed(opposite)),
            single + 300);
}

// The second half of the mesh is a mirrored copy of the first half. Each value has the same
// neighbouring values as its mirror image.
TEST(ColumnCoder, CopiesAreFound) {
  std::mt19937_64 random(8);
  const std::size_t half = vertices().size() / 2;
  Elements line;
  for (std::uint32_t i = 0; i < 2 * half; ++i) {
    Neighbourhood item;
    item.self = i;
    line.all.items.push_back(item);
  }
  std::vector<double> once, again;
  for (std::size_t i = 0; i < half; ++i)
    once.push_back(std::sqrt(static_cast<double>(random() % 100000007)));
  again = once;
  for (double v : once) again.push_back(-v);
  const auto cost = [&](const std::vector<double>& values) {
    Elements part;
    part.all = line.group(0, values.size(), {});
    return expect_back(info_of(ScalarType::float64), part, packed(values));
  };
  const std::size_t first = cost(once), both = cost(again);
  EXPECT_GT(first, 5 * half);
  EXPECT_LT(both, first + first / 4);
}

/// Returns random values that are mirrored at a plane. Values on opposite sides are equal except
/// for their sign and some of their last bits.
std::vector<double> mirrored(const Elements& elements, std::uint64_t seed, double apart) {
  std::map<Point, double> there;
  std::mt19937_64 random(seed);
  std::vector<double> values;
  for (const Point& p : elements.points) {
    const Point folded = {std::min(p[0], 13 - p[0]), p[1], p[2]};
    const auto [found, is_new] =
        there.try_emplace(folded, 1 + static_cast<double>(random() % (1u << 30)) / (1u << 30) / 3);
    const double last_bits = is_new ? 0 : apart * static_cast<double>(random() % 1000);
    values.push_back(p[0] == folded[0] ? found->second : -found->second * (1 + last_bits));
  }
  return values;
}

// The values in the second half of the mesh are about equal to those in the first half. All values
// are positive.
TEST(ColumnCoder, EarlierValuesAreRecalled) {
  for (double apart : {0.0, 0x1p-50})
    for (Level level : {Level::fast, Level::standard, Level::best}) {
      std::vector<double> values = mirrored(vertices(), 4, apart);
      for (double& v : values) v = std::fabs(v) * 1.1;
      Plan plan;
      plan.level = level;
      plan.groups = {500};
      const std::size_t bytes =
          expect_back(info_of(ScalarType::float64), vertices(), packed(values), plan);
      EXPECT_LT(bytes,
                values.size() * (apart == 0 ? 5 : 6));  // random values need seven bytes each
      for (double& v : values) v = static_cast<double>(static_cast<float>(v));
      expect_back(info_of(ScalarType::float64), vertices(), packed(values), plan);
      values[600] = std::numeric_limits<double>::quiet_NaN();
      values[601] = -std::numeric_limits<double>::infinity();
      values[602] = -0.0;
      expect_back(info_of(ScalarType::float64), vertices(), packed(values), plan);
    }
}

/// Returns values of three components. Nine in ten elements have the same values as an earlier
/// element. The distance to the earlier element depends only on the corner at which a cell
/// introduces the vertex.
std::vector<double> standing_again(const Elements& elements, std::mt19937_64& random) {
  std::vector<double> values;
  for (std::size_t i = 0; i < elements.size(); ++i) {
    const std::size_t back = 20 + elements.all.items[i].corner % 5;
    const bool again = i >= back && random() % 10 != 0;
    for (std::size_t c = 0; c < 3; ++c)
      values.push_back(again ? values[3 * (i - back) + c]
                             : std::sqrt(static_cast<double>(random() % 100000007)));
  }
  return values;
}

// An element that has the same values as an earlier element needs almost no bytes, even if the
// earlier element is in another group.
TEST(ColumnCoder, ElementsThatStoodBeforeAreCopied) {
  const ArrayInfo info = info_of(ScalarType::float64, 3);
  for (Level level : {Level::fast, Level::standard, Level::best}) {
    std::mt19937_64 random(5);
    const Bytes values = packed(standing_again(vertices(), random));
    Plan plan;
    plan.level = level;
    plan.groups = {400, 401, 800};
    plan.tiles = {100, 500, 700};
    const std::size_t bytes = expect_back(info, vertices(), values, plan);
    const std::size_t fresh =
        vertices().size() / 10 + 24;  // the elements that did not occur before
    EXPECT_LT(bytes, fresh * 3 * 7 + vertices().size() / 8 * 2);
    plan.copies = false;
    EXPECT_GT(expect_back(info, vertices(), values, plan), bytes + vertices().size() / 4);
  }
}

// Copies of earlier elements must be found in all kinds of groups and tiles, and even if other
// kinds of values, such as NaNs, are between the copies.
TEST(ColumnCoder, CopiesOfAllKindsOfValues) {
  std::mt19937_64 random(6);
  for (const Elements* elements : {&vertices(), &cells()})
    for (int round = 0; round < 12; ++round) {
      Plan plan = some_plan(*elements, random);
      std::vector<double> values = standing_again(*elements, random);
      if (round % 2 == 0)
        for (double& v : values) v = std::round(v) / 8;
      for (std::size_t i = 0; round % 3 == 0 && i < values.size(); ++i) {
        if (i / 700 % 2 == 1)
          values[i] = smooth(elements->points[i / 3], static_cast<std::uint32_t>(i % 3));
        if (i % 50 == 7) values[i] = std::numeric_limits<double>::quiet_NaN();
      }
      plan.level_of = [](std::size_t g) { return static_cast<Level>(g % 3); };
      expect_back(info_of(ScalarType::float64, 3), *elements, packed(values), plan);
      std::vector<std::int16_t> whole;
      for (double v : values)
        whole.push_back(static_cast<std::int16_t>(std::isnan(v) ? -3000 : std::fmod(v, 3000)));
      expect_back(info_of(ScalarType::int16, 3), *elements, packed(whole), plan);
    }
}

// The coder must find equal earlier values in each tile, even if the array covers only some blocks.
// Trial encodings must not change the state of the coder.
TEST(ColumnCoder, EarlierValuesOnSomeBlocks) {
  Elements only;
  for (std::size_t i = 0; i < cells().size(); ++i)
    if (cells().all.blocks[i] != 1) only.points.push_back(cells().points[i]);
  for (Level level : {Level::fast, Level::standard, Level::best}) {
    Plan plan;
    plan.level = level;
    plan.covers = {1, 0, 1};
    plan.tiles = {40, 41, 200, 500};
    plan.groups = {600};
    std::vector<double> values = mirrored(only, 9, 0.0);
    for (double& v : values) v = std::fabs(v) * 1.1;
    const std::size_t bytes =
        expect_back(info_of(ScalarType::float64), cells(), packed(values), plan);
    EXPECT_LT(bytes, values.size() * 6);
  }
}

/// Encodes the values of a step with a reference step and checks that they decode correctly.
/// Returns the encoded size in bytes.
std::size_t expect_back_with(const ArrayInfo& info, const Elements& elements, const Bytes& values,
                             const Bytes& reference, const Plan& plan) {
  const std::size_t stride = scalar_bytes(info.type) * info.components;
  Encoder encoder(info, {});
  Decoder decoder(info, {});
  encoder.use_reference();
  decoder.use_reference();
  Bytes back;
  std::size_t bytes = 0, at = 0;
  for_each_group(elements, plan, [&](std::size_t, const TiledItems& part) {
    const EncodedColumn coded =
        encoder.encode(part, values.data() + at, stride, plan.level, reference.data() + at);
    bytes += coded.bytes.size();
    EXPECT_TRUE(decoder.begin_group(coded.codec, coded.bytes, 1 << 24));
    for (std::size_t t = 0; t < part.tile_begin.size(); ++t)
      EXPECT_TRUE(decoder.decode_tile(part.tile(t), back, reference.data() + back.size()));
    at += part.items.size() * stride;
  });
  EXPECT_TRUE(back == values) << scalar_name(info.type);
  return bytes;
}

// Elements that had equal values at the previous step also have equal values at this step.
TEST(ColumnCoder, PartnersAreFound) {
  for (double apart : {0.0, 0x1p-50})
    for (Level level : {Level::fast, Level::standard, Level::best}) {
      Plan plan;
      plan.level = level;
      plan.groups = {500, 510};
      plan.tiles = {100, 700};
      std::vector<double> before = mirrored(vertices(), 5, apart);
      std::vector<double> now = mirrored(vertices(), 6, apart);
      const std::size_t bytes = expect_back_with(info_of(ScalarType::float64), vertices(),
                                                 packed(now), packed(before), plan);
      EXPECT_LT(bytes,
                now.size() * (apart == 0 ? 9 : 11) / 2);  // random values need seven bytes each
      before[3] = before[700] = std::numeric_limits<double>::infinity();
      now[5] = now[800] = std::numeric_limits<double>::quiet_NaN();
      expect_back_with(info_of(ScalarType::float64), vertices(), packed(now), packed(before), plan);
      const std::vector<float> narrow_before(before.begin(), before.end());
      const std::vector<float> narrow(now.begin(), now.end());
      expect_back_with(info_of(ScalarType::float32), vertices(), packed(narrow),
                       packed(narrow_before), plan);
    }
}

// A single NaN or infinity must not increase the encoded size of its neighbours.
TEST(ColumnCoder, NonFiniteNeighboursDoNotSpread) {
  std::vector<double> values(vertices().size(), 1.5);
  values[5] = std::numeric_limits<double>::infinity();
  values[150] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_LT(expect_back(info_of(ScalarType::float64), vertices(), packed(values)), 120u);
}

TEST(ColumnCoder, TheSameBytesEachTime) {
  std::mt19937_64 random(9);
  const ArrayInfo info = info_of(ScalarType::float64, 3);
  const Bytes values = values_of(vertices(), ScalarType::float64, 3, smooth);
  for (int level = 0; level < 3; ++level) {
    Plan plan = some_plan(vertices(), random);
    plan.level = static_cast<Level>(level);
    const Coded one = encode(info, vertices(), values, plan);
    const Coded two = encode(info, vertices(), values, plan);
    for (std::size_t g = 0; g < one.groups.size(); ++g) {
      EXPECT_EQ(one.groups[g].codec, two.groups[g].codec);
      EXPECT_EQ(one.groups[g].bytes, two.groups[g].bytes);
    }
  }
}

// --- damage

struct Victim {
  ArrayInfo info;
  Elements elements;
  Plan plan;
  Coded coded;
  std::size_t values = 0;  // bytes
};

std::vector<Victim> victims() {
  std::mt19937_64 random(10);
  std::vector<Victim> all;
  for (int kind = 0; kind < 32; ++kind) {
    Victim victim;
    victim.elements = grid({4, 3, 3}, kind % 2 == 1);
    victim.plan = some_plan(victim.elements, random);
    victim.plan.groups = {20};
    victim.plan.level = kind % 6 == 5 ? Level::best : Level::standard;
    const ScalarType type = std::array{ScalarType::float64, ScalarType::int64, ScalarType::float32,
                                       ScalarType::uint8}[static_cast<std::size_t>(kind) / 2 % 4];
    victim.info = info_of(type, kind % 5 == 0 ? 3 : 1);
    if (is_float(type) && kind % 8 >= 6) victim.info.quantization = Quantization::absolute(0.1, 3);
    const Bytes values = values_of(
        victim.elements, type, victim.info.components, [&](const Point& p, std::uint32_t c) {
          switch (kind / 8) {
            case 0: return smooth(p, c);
            case 1: return std::round(smooth(p, c) * 10) / 10;
            case 2: return static_cast<double>(random() % 5) * 3.7;
            default:  // about as large as some other value
              return std::sqrt(3.0 + static_cast<double>(random() % 20)) *
                     (1 + static_cast<double>(random() % 9) * 0x1p-50);
          }
        });
    victim.coded = encode(victim.info, victim.elements, values, victim.plan);
    victim.values = values.size();
    all.push_back(std::move(victim));
  }
  return all;
}

void expect_harmless(const Victim& victim, const Coded& damaged) {
  const auto back = decode(victim.info, victim.elements, damaged, victim.plan, 1 << 16);
  if (back) {
    EXPECT_EQ(back->size(), victim.values);
  }
}

TEST(ColumnCoder, DamagedBytesDoNoHarm) {
  std::mt19937_64 random(11);
  for (const Victim& victim : victims())
    for (int round = 0; round < 120; ++round) {
      Coded damaged = victim.coded;
      EncodedColumn& group = damaged.groups[random() % damaged.groups.size()];
      switch (round % 4) {
        case 0:
        case 1:
          for (std::uint64_t n = 1 + random() % 3; n > 0 && !group.bytes.empty(); --n)
            group.bytes[random() % group.bytes.size()] ^= static_cast<std::byte>(1 << random() % 8);
          break;
        case 2: group.bytes.resize(random() % (group.bytes.size() + 1)); break;
        default: group.codec = static_cast<Codec>(random() % 3);
      }
      expect_harmless(victim, damaged);
    }
}

TEST(ColumnCoder, RandomBytesDoNoHarm) {
  std::mt19937_64 random(12);
  for (const Victim& victim : victims())
    for (int round = 0; round < 120; ++round) {
      Coded damaged = victim.coded;
      for (EncodedColumn& group : damaged.groups) {
        group.codec = static_cast<Codec>(random() % 4 == 0 ? random() % 3 : 0);
        group.bytes.resize(random() % 60);
        const std::uint64_t shape = random() % 3;
        for (std::byte& b : group.bytes)
          b = static_cast<std::byte>(shape == 0   ? random()
                                     : shape == 1 ? random() & random() & random()
                                                  : random() | random() | random());
      }
      expect_harmless(victim, damaged);
    }
}

// Each group has a single element. Its value suggests a different domain (the way in which values
// are mapped to integers) from that of the previous group. If the coder changed the domain for each
// group, it would have to translate the states of very many other elements each time. The coder
// must limit this work.
TEST(ColumnCoder, DomainsChangeInProportionToElements) {
  constexpr std::uint32_t kSlots = 1 << 16;
  constexpr int kGroups = 200;
  const auto value_of = [](int group) { return group % 2 == 0 ? 0.5 : std::sqrt(2.0 + group); };
  const ArrayInfo info = info_of(ScalarType::float64);
  Encoder encoder(info, {});
  Decoder decoder(info, {});
  encoder.make_room(kSlots);
  decoder.make_room(kSlots);
  int under_zstd = 0;
  for (int group = 0; group < kGroups; ++group) {
    const TiledItems one =
        vertices().group(static_cast<std::size_t>(group), static_cast<std::size_t>(group) + 1, {});
    const Bytes value = packed(std::vector<double>{value_of(group)});
    const EncodedColumn coded = encoder.encode(one, value.data(), 8, Level::standard);
    under_zstd += coded.codec == Codec::shuffled_zstd;
    ASSERT_TRUE(decoder.begin_group(coded.codec, coded.bytes, 8)) << group;
    Bytes back;
    ASSERT_TRUE(decoder.decode_tile(one.tile(0), back)) << group;
    ASSERT_EQ(back, value) << group;
  }
  EXPECT_GT(under_zstd, 0);

  // This encoder ignores the limit on the number of domain changes. The reader must accept groups
  // until the limit is reached, and refuse the next group.
  const auto shared = std::make_shared<const ArrayInfo>(info);
  ComponentCoder<SplitEncoder> careless(shared, 0, true);
  ComponentCoder<SplitDecoder> reader(shared, 0, true);
  careless.state().make_room(kSlots - 1);
  reader.state().make_room(kSlots - 1);
  int changes = 0;
  for (;; ++changes) {
    ASSERT_LT(changes, kGroups);
    SplitEncoder out;
    DomainAndTable wanted;
    wanted.domain = {changes % 2 == 0 ? DomainKind::decimal : DomainKind::floats, 0, false, true};
    ASSERT_TRUE(careless.begin_group(out, wanted, {}, 8));
    const Bytes bytes = out.finish();
    SplitDecoder in(bytes);
    if (!reader.begin_group(in, {}, {}, 8)) break;
    careless.state().skip(vertices().all.items[static_cast<std::size_t>(changes)]);
    reader.state().skip(vertices().all.items[static_cast<std::size_t>(changes)]);
  }
  EXPECT_GE(changes, 1);
  EXPECT_LE(changes, static_cast<int>(kMostMovesForEach) * kGroups / static_cast<int>(kSlots));
}

// The number of domain changes that readers allow grows with the number of elements. The writer
// must count each element without a value only once, even if it makes several trial encodings.
// Otherwise it would change domains too often.
TEST(ColumnCoder, TrialsCountNoElements) {
  constexpr std::uint32_t kSlots = 6000000;
  constexpr std::size_t kCovered = 64, kUncovered = 1000;
  TiledItems group;
  for (std::uint32_t i = 0; i < kCovered + kUncovered; ++i) {
    Neighbourhood item;
    item.self = i;
    group.items.push_back(item);
    group.blocks.push_back(i < kUncovered ? 1 : 0);
  }
  group.tile_begin.push_back(kUncovered + kCovered / 4);
  const ArrayInfo info = info_of(ScalarType::float64);
  Encoder encoder(info, {0});
  Decoder decoder(info, {0});
  encoder.make_room(0, kSlots);
  decoder.make_room(0, kSlots);
  std::mt19937_64 random(3);
  int under_zstd = 0;
  for (int g = 0; g < 40; ++g) {
    std::vector<double> values;
    for (std::size_t i = 0; i < kCovered / 4; ++i)
      values.push_back(static_cast<double>(random() % 100000000) * (g % 2 == 0 ? .5 : 0x1p-60));
    for (double& v : values) v = g % 2 == 0 ? v : std::sqrt(v);
    for (std::size_t i = values.size(); i < kCovered; ++i)
      values.push_back(values[i % (kCovered / 4)]);
    const Bytes bytes = packed(values);
    const EncodedColumn coded = encoder.encode(group, bytes.data(), 8, Level::standard);
    under_zstd += coded.codec == Codec::shuffled_zstd;
    ASSERT_TRUE(decoder.begin_group(coded.codec, coded.bytes, 1 << 20)) << g;
    Bytes back;
    for (std::size_t t = 0; t < group.tile_begin.size(); ++t)
      ASSERT_TRUE(decoder.decode_tile(group.tile(t), back)) << g;
    ASSERT_EQ(back, bytes) << g;
  }
  EXPECT_GT(under_zstd, 0);
}

TEST(ColumnCoder, SamplesAreSpreadOverTheGroup) {
  for (const std::size_t of : {1u, 100u, 1024u, 5000u, 65536u, 1000000u}) {
    std::size_t taken = 0, in_first_half = 0;
    for (std::size_t place = 0; place < of; ++place) {
      if (!GroupSample::takes(place, of)) continue;
      ++taken;
      in_first_half += place < of / 2 ? 1 : 0;
    }
    if (of <= 1024) {
      EXPECT_EQ(taken, of);
      continue;
    }
    EXPECT_NEAR(static_cast<double>(taken), 1024.0, 64.0) << of;
    EXPECT_NEAR(static_cast<double>(in_first_half), 512.0, 64.0) << of;
  }
}

}  // namespace
}  // namespace shm
