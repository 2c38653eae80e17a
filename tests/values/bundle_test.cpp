#include "codecs/bundles/bundle.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "codecs/bundles/bundle_encoder.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;
using ValueOf = std::function<double(std::size_t array, std::size_t step, std::size_t element,
                                     std::size_t component)>;

struct Source {
  std::vector<ArrayInfo> infos;
  std::vector<std::size_t> elements;
  std::uint64_t steps = 1;
  std::vector<Bytes> values;  // of each array: all steps, packed

  void add(ScalarType type, std::uint32_t components, std::size_t count, const ValueOf& value) {
    ArrayInfo info;
    info.name = "a" + std::to_string(infos.size());
    info.type = type;
    info.components = components;
    info.per_step = true;
    const std::size_t a = infos.size();
    infos.push_back(info);
    elements.push_back(count);
    Bytes bytes;
    for (std::size_t s = 0; s < steps; ++s)
      for (std::size_t e = 0; e < count; ++e)
        for (std::size_t c = 0; c < components; ++c) put(bytes, type, value(a, s, e, c));
    values.push_back(std::move(bytes));
  }

  std::vector<ValuesOfSteps> values_of_steps() const {
    std::vector<ValuesOfSteps> all;
    for (const Bytes& of_array : values) {
      const std::size_t size = of_array.size() / static_cast<std::size_t>(steps);
      for (all.emplace_back(); all.back().size() < steps;)
        all.back().push_back(std::span(of_array).subspan(all.back().size() * size, size));
    }
    return all;
  }

 private:
  static void put(Bytes& to, ScalarType type, double value) {
    const auto append = [&](auto it) {
      const std::size_t at = to.size();
      to.resize(at + sizeof it);
      std::memcpy(to.data() + at, &it, sizeof it);
    };
    switch (type) {
      case ScalarType::float64: return append(value);
      case ScalarType::float32: return append(static_cast<float>(value));
      case ScalarType::int32: return append(static_cast<std::int32_t>(value));
      case ScalarType::uint8: return append(static_cast<std::uint8_t>(value));
      default: return append(static_cast<std::int64_t>(value));
    }
  }
};

Bytes encoded(const Source& source) {
  BundlePlanner planner(source.steps);
  BundleEncoder encoder(9);
  const auto values = source.values_of_steps();
  for (std::size_t a = 0; a < source.infos.size(); ++a)
    EXPECT_TRUE(encoder.add(planner.plan(source.infos[a], values[a])));
  return encoder.finish();
}

std::optional<Bundle> bundle_of(const Source& source, const Bytes& bytes) {
  std::vector<BundleArray> arrays;
  for (std::size_t a = 0; a < source.infos.size(); ++a)
    arrays.push_back({&source.infos[a], source.elements[a]});
  return Bundle::read(bytes, arrays, source.steps);
}

/// Encodes and decodes all arrays. Returns the number of encoded bytes.
std::size_t expect_round_trip(const Source& source) {
  const Bytes bytes = encoded(source);
  const auto bundle = bundle_of(source, bytes);
  EXPECT_TRUE(bundle);
  if (!bundle) return 0;
  for (std::size_t a = 0; a < source.infos.size(); ++a) {
    const std::size_t each = source.values[a].size() / static_cast<std::size_t>(source.steps);
    for (std::size_t s = 0; s < source.steps; ++s) {
      const auto begin = source.values[a].begin() + static_cast<std::ptrdiff_t>(s * each);
      EXPECT_EQ(bundle->values(a, s), Bytes(begin, begin + static_cast<std::ptrdiff_t>(each)))
          << "array " << a << ", step " << s;
    }
  }
  return bytes.size();
}

TEST(Bundle, ConstantColumnsCostAByte) {
  Source source;
  source.steps = 30;
  for (int a = 0; a < 200; ++a) source.add(ScalarType::float64, 1, 1, [](auto...) { return 0.; });
  EXPECT_LT(expect_round_trip(source), 40u);
  Source other;
  other.steps = 30;
  for (int a = 0; a < 200; ++a) other.add(ScalarType::float64, 1, 7, [](auto...) { return 3.25; });
  EXPECT_LT(expect_round_trip(other), 60u);
}

TEST(Bundle, EqualColumnsCostOne) {
  std::mt19937 random(1);
  Source source;
  source.steps = 50;
  std::vector<double> noise(50 * 20);
  for (double& value : noise) value = std::normal_distribution<>()(random);
  const ValueOf value = [&](auto, auto s, auto e, auto) { return noise[s * 20 + e]; };
  source.add(ScalarType::float64, 1, 20, value);
  const std::size_t one = expect_round_trip(source);
  for (int a = 0; a < 19; ++a) source.add(ScalarType::float64, 1, 20, value);
  EXPECT_LT(expect_round_trip(source), one + 50);
}

TEST(Bundle, MultiplesCostFewBytes) {
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64}) {
    std::mt19937 random(4);
    Source source;
    source.steps = 30;
    std::vector<double> noise(30 * 20);
    for (double& value : noise) value = static_cast<float>(std::normal_distribution<>()(random));
    const auto multiple = [&](double factor) {
      source.add(type, 1, 20, [&noise, factor](auto, auto s, auto e, auto) {
        return noise[s * 20 + e] * factor;
      });
    };
    multiple(1);
    const std::size_t one = expect_round_trip(source);
    const std::vector<double> factors = {-1, 1.5, 1e-3, -1e-6, 0x1p-20, 3.6, 273.15};
    for (const double factor : factors) multiple(factor);
    EXPECT_LT(expect_round_trip(source), one + 12 * factors.size());
    // A column that differs in one value is no multiple.
    source.add(type, 1, 20, [&](auto, auto s, auto e, auto) {
      return noise[s * 20 + e] * (s == 17 && e == 5 ? 2.000001 : 2);
    });
    // A zero of the other sign is no multiple, either.
    source.add(type, 1, 20, [&](auto, auto s, auto e, auto) { return s + e == 0 ? -0. : 0.; });
    source.add(type, 1, 20, [&](auto, auto s, auto e, auto) {
      return s + e == 1 ? std::numeric_limits<double>::quiet_NaN() : -noise[s * 20 + e];
    });
    expect_round_trip(source);
  }
}

TEST(Bundle, AllKindsOfColumns) {
  std::mt19937 random(2);
  const std::vector<ValueOf> kinds = {
      [](auto, auto s, auto e, auto c) {
        return std::sin(.1 * static_cast<double>(s) + .3 * static_cast<double>(e) +
                        static_cast<double>(c));
      },
      [](auto, auto s, auto e, auto) { return static_cast<double>(s * 3 + e * 7); },
      [](auto, auto, auto e, auto) { return .1 * static_cast<double>(e); },
      [](auto, auto s, auto, auto) { return -1.5 * static_cast<double>(s); },
      [&](auto, auto, auto, auto) { return std::normal_distribution<>()(random); },
      [](auto, auto s, auto e, auto) {
        return (s + e) % 5 == 0   ? std::numeric_limits<double>::quiet_NaN()
               : (s + e) % 5 == 1 ? -0.
               : (s + e) % 5 == 2 ? std::numeric_limits<double>::infinity()
                                  : 1e300;
      },
  };
  for (const std::uint64_t steps : {1u, 2u, 3u, 40u})
    for (const std::size_t elements : {1u, 2u, 13u}) {
      Source source;
      source.steps = steps;
      for (const ScalarType type : {ScalarType::float64, ScalarType::float32})
        for (const std::uint32_t components : {1u, 3u})
          for (const ValueOf& kind : kinds) source.add(type, components, elements, kind);
      for (const ScalarType type : {ScalarType::int32, ScalarType::int64, ScalarType::uint8})
        for (std::size_t k = 1; k < 2; ++k) source.add(type, 2, elements, kinds[k]);
      expect_round_trip(source);
      if (HasFailure()) return;
    }
}

TEST(Bundle, TooManyValuesAreRefused) {
  std::mt19937 random(2);
  const ValueOf noise = [&](auto...) { return std::normal_distribution<>()(random); };
  Source source;
  source.steps = 16;
  source.add(ScalarType::float64, 1, 1500, noise);
  source.add(ScalarType::float64, 1, 600, noise);
  BundlePlanner planner(source.steps);
  BundleEncoder encoder(3);
  const auto values = source.values_of_steps();
  EXPECT_TRUE(encoder.add(planner.plan(source.infos[0], values[0])));
  EXPECT_FALSE(encoder.add(planner.plan(source.infos[1], values[1])));
  source.infos.pop_back();
  source.elements.pop_back();
  EXPECT_TRUE(bundle_of(source, encoder.finish()));
}

TEST(Bundle, DamagedOnesAreRefusedOrRead) {
  std::mt19937 random(3);
  Source source;
  source.steps = 12;
  source.add(ScalarType::float64, 2, 9, [&](auto, auto s, auto e, auto c) {
    return std::round(100 * std::sin(static_cast<double>(s + e + c)));
  });
  source.add(ScalarType::float32, 1, 9,
             [&](auto...) { return std::normal_distribution<>()(random); });
  source.add(ScalarType::float32, 1, 9, [](auto...) { return 2.; });
  const Bytes bytes = encoded(source);
  for (std::size_t at = 0; at < bytes.size(); ++at)
    for (int bit = 0; bit < 8; ++bit) {
      Bytes damaged = bytes;
      damaged[at] ^= static_cast<std::byte>(1 << bit);
      const auto bundle = bundle_of(source, damaged);
      if (bundle) {
        EXPECT_EQ(bundle->values(0, 11).size(), 9u * 16);
      }
    }
  for (std::size_t size = 0; size < bytes.size(); ++size)
    EXPECT_FALSE(
        bundle_of(source, Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size))));
}

}  // namespace
}  // namespace shm
