#include "codecs/shared/special_values.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "shm/step_reader.h"
#include "support/coded_meshes.h"
#include "support/feature_files.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

ArrayInfo info_of(ScalarType type, std::uint32_t components, std::vector<double> fills) {
  ArrayInfo info = array_of("a", Location::point, type, components);
  info.fills = std::move(fills);
  return info;
}

template <class T>
Bytes bytes_of(const std::vector<T>& values) {
  Bytes bytes(values.size() * sizeof(T));
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return bytes;
}

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(SpecialValues, PlainValuesRepeatTheLastOneOfTheirComponent) {
  const ArrayInfo info = info_of(ScalarType::float64, 2, {-9});
  const Bytes values = bytes_of<double>({kNan, 1, kNan, -9, 5, 3, kInfinity, -9, 6, kNan});
  EXPECT_EQ(plain_values(info, values.data(), 16, 5),
            bytes_of<double>({5, 1, 5, 1, 5, 3, 5, 3, 6, 3}));
  const Bytes none = bytes_of<double>({kNan, -9, kNan, kInfinity});
  EXPECT_EQ(plain_values(info, none.data(), 16, 2), bytes_of<double>({0, 0, 0, 0}));
}

TEST(SpecialValues, AreFoundOnlyWhereThereAreAny) {
  const Bytes values = bytes_of<double>({1, 2, -9, 4});
  EXPECT_FALSE(SpecialValues::find(info_of(ScalarType::float64, 1, {}), values.data(), 8, 4));
  EXPECT_TRUE(SpecialValues::find(info_of(ScalarType::float64, 1, {-9}), values.data(), 8, 4));
  EXPECT_FALSE(SpecialValues::find(info_of(ScalarType::float64, 1, {-9}), values.data(), 8, 2));
  EXPECT_FALSE(SpecialValues::find(info_of(ScalarType::int64, 1, {}), values.data(), 8, 4));
  std::vector<double> different;
  for (std::uint64_t i = 0; i < 256; ++i)
    different.push_back(std::bit_cast<double>(0x7ff8000000000000 + i));
  const Bytes many = bytes_of(different);
  const ArrayInfo info = info_of(ScalarType::float64, 1, {});
  EXPECT_TRUE(SpecialValues::find(info, many.data(), 8, 255));
  EXPECT_FALSE(SpecialValues::find(info, many.data(), 8, 256));
}

/// Random values of which about one in `one_in` is special. Returns values of type float32 or
/// float64, with a payload in some NaN.
Bytes random_values(ScalarType type, std::size_t count, std::uint64_t seed, unsigned one_in) {
  std::mt19937_64 random(seed);
  Bytes bytes;
  bool in_run = false;
  for (std::size_t i = 0; i < count; ++i) {
    if (random() % one_in == 0) in_run = !in_run;
    const double value = static_cast<double>(random() % 1000) * .25;
    const std::uint64_t kind = random() % 5;
    if (type == ScalarType::float64)
      append(bytes, !in_run     ? std::bit_cast<std::uint64_t>(value)
                    : kind == 0 ? 0x7ff0000000000000
                    : kind == 1 ? std::bit_cast<std::uint64_t>(-1e30)
                                : 0xfff8000000000000 + kind);
    else
      append(bytes, !in_run     ? std::bit_cast<std::uint32_t>(static_cast<float>(value))
                    : kind == 0 ? 0x7f800000u
                    : kind == 1 ? std::bit_cast<std::uint32_t>(-1e30f)
                                : 0xffc00000u + static_cast<std::uint32_t>(kind));
  }
  return bytes;
}

TEST(SpecialValues, ComeBackInPieces) {
  for (const ScalarType type : {ScalarType::float32, ScalarType::float64})
    for (const std::uint32_t components : {1u, 3u})
      for (std::uint64_t seed = 0; seed < 40; ++seed) {
        const double fill = static_cast<double>(static_cast<float>(-1e30));
        const ArrayInfo info =
            info_of(type, components, {type == ScalarType::float32 ? fill : -1e30});
        const std::size_t stride = scalar_bytes(type) * components, count = 1 + seed * 7 % 100;
        const Bytes values =
            random_values(type, count * components, seed, 1 + static_cast<unsigned>(seed % 9));
        const auto special = SpecialValues::find(info, values.data(), stride, count);
        if (!special) continue;
        Bytes coded = special->encode();
        coded.push_back(std::byte{42});
        std::span<const std::byte> rest = coded;
        auto decoder = SpecialValuesDecoder::read(info, rest, count * components);
        ASSERT_TRUE(decoder);
        ASSERT_EQ(rest.size(), 1u);
        Bytes restored = plain_values(info, values.data(), stride, count);
        for (std::size_t from = 0, step = 1; from < restored.size(); from += step) {
          step = std::min(stride * (1 + from % 5), restored.size() - from);
          EXPECT_FALSE(decoder->at_end() && from == 0);
          ASSERT_TRUE(decoder->restore(std::span(restored).subspan(from, step)));
        }
        EXPECT_TRUE(decoder->at_end());
        EXPECT_EQ(restored, values);
      }
}

TEST(SpecialValues, OfTheReferenceNeedFewBytes) {
  const ArrayInfo info = info_of(ScalarType::float32, 1, {-9});
  const Bytes reference = bytes_of<float>({-9, 2, -9, -9, 7}),
              values = bytes_of<float>({-9, 4, -9, -9, 8});
  const auto special = SpecialValues::find(info, values.data(), 4, 5);
  ASSERT_TRUE(special);
  EXPECT_TRUE(special == SpecialValues::find(info, reference.data(), 4, 5));
  const Bytes coded = special->encode(true);
  EXPECT_LE(coded.size(), 4u);
  std::span<const std::byte> rest = coded;
  auto decoder = SpecialValuesDecoder::read(info, rest, 5, reference);
  ASSERT_TRUE(decoder);
  const Bytes plain = bytes_of<float>({2, 2, 2, 2, 7});
  PlainReference plain_reference;
  EXPECT_TRUE(std::ranges::equal(plain_reference.of(info, {reference, {}}).values, plain));
  EXPECT_TRUE(std::ranges::equal(plain_reference.of(info, {plain, reference}).last, plain));
  Bytes restored = plain_values(info, values.data(), 4, 5);
  ASSERT_TRUE(decoder->restore(restored));
  EXPECT_TRUE(decoder->at_end());
  EXPECT_EQ(restored, values);
  std::span<const std::byte> again = coded;
  EXPECT_FALSE(SpecialValuesDecoder::read(info, again, 5));
  again = coded;
  EXPECT_FALSE(SpecialValuesDecoder::read(info, again, 5, plain));
}

TEST(SpecialValues, DamagedBytesAreRefusedOrRestoreSomething) {
  const ArrayInfo info = info_of(ScalarType::float64, 1, {-1e30});
  const Bytes values = random_values(ScalarType::float64, 300, 3, 4);
  const Bytes coded = SpecialValues::find(info, values.data(), 8, 300)->encode();
  std::mt19937_64 random(5);
  for (int i = 0; i < 3000; ++i) {
    Bytes damaged = coded;
    damaged[random() % damaged.size()] = static_cast<std::byte>(random());
    damaged.resize(damaged.size() - random() % 3);
    std::span<const std::byte> rest = damaged;
    auto decoder = SpecialValuesDecoder::read(info, rest, 300);
    Bytes out(300 * 8);
    if (decoder && decoder->restore(out)) (void)decoder->at_end();
  }
}

/// A smooth array of a grid, in which the points of a slab or scattered points are special.
TestMesh smooth(bool scattered, double special, double fill) {
  TestMesh mesh = bent_grid(30, 20, 10);
  ArrayInfo info = array_of("t", Location::point, ScalarType::float64);
  info.quantization = Quantization::absolute(.01, 1);
  if (fill != 0) info.fills = {fill};
  Bytes values;
  for (std::uint64_t v = 0; v < mesh.vertices; ++v) {
    const double x = static_cast<double>(v % 31), y = static_cast<double>(v / 31 % 21),
                 z = static_cast<double>(v / 651);
    const bool is_special = scattered ? v * 7919 % 10 == 3 : v / 651 > 4;
    append(values, is_special ? special : 300 + .01 * x * y - .02 * z * z);
  }
  mesh.schema.arrays.push_back(info);
  mesh.arrays.push_back(values);
  return mesh;
}

Bytes written_at(const TestMesh& mesh, Level level) {
  MemorySink sink;
  WriteOptions options;
  options.level = level;
  EXPECT_TRUE(write_mesh(mesh, sink, options));
  return std::move(sink.bytes);
}

/// Returns the values of the only array, as a reader restores them.
std::vector<double> restored(const Bytes& file) {
  MemorySource source(file);
  const auto mesh = read_mesh(source);
  EXPECT_TRUE(mesh);
  std::vector<double> values(mesh->arrays[0].size() / 8);
  std::memcpy(values.data(), mesh->arrays[0].data(), mesh->arrays[0].size());
  return values;
}

TEST(SpecialValues, InRunsCostNextToNothing) {
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const double special : {kNan, kInfinity, 9.969209968386869e36, -9999.0}) {
      SCOPED_TRACE(special);
      const double fill = std::isfinite(special) ? special : 0;
      const TestMesh with = smooth(false, special, fill), without = smooth(false, 300, 0);
      const Bytes file = written_at(with, level);
      // About half of the 7161 values are special. The bound is .1 bit for each of them, and the
      // sizes of the schema's fill values and of the special values in a group.
      EXPECT_LE(file.size(), written_at(without, level).size() + 7161 / 2 / 80 + 48);
      const auto values = restored(file);
      for (std::size_t v = 0; v < values.size(); ++v) {
        double source = 0;
        std::memcpy(&source, with.arrays[0].data() + v * 8, 8);
        if (v / 651 > 4) {
          EXPECT_EQ(std::bit_cast<std::uint64_t>(values[v]), std::bit_cast<std::uint64_t>(special));
        } else {
          EXPECT_LE(std::fabs(values[v] - source), .01);
        }
      }
    }
}

TEST(SpecialValues, AreExactWhereverTheyAre) {
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const double special : {kNan, -kInfinity, 9.969209968386869e36, -9999.0, 301.003}) {
      const TestMesh mesh = smooth(true, special, std::isfinite(special) ? special : 0);
      const auto values = restored(written_at(mesh, level));
      for (std::size_t v = 0; v < values.size(); ++v) {
        if (v * 7919 % 10 != 3) continue;
        ASSERT_EQ(std::bit_cast<std::uint64_t>(values[v]), std::bit_cast<std::uint64_t>(special));
      }
    }
}

// Steps of the same arrays, coded by references, alone and in bundles, must give the same values.
TEST(SpecialValues, OfStepsComeBackHoweverTheyAreCoded) {
  for (const std::uint64_t waiting : {0, 1 << 20})
    for (const Level level : {Level::fast, Level::standard, Level::best}) {
      const Bytes file = filled_steps(level, waiting);
      MemoryRandomSource source(file);
      auto reader = StepReader::open(source);
      ASSERT_TRUE(reader);
      for (std::uint32_t array = 0; array < 3; ++array)
        for (const std::uint64_t step : {4, 1, 3, 0, 2}) {
          const auto groups = reader->read({.array = array, .step = step});
          ASSERT_TRUE(groups);
          Bytes values;
          for (const StepValues& group : *groups)
            values.insert(values.end(), group.values.begin(), group.values.end());
          std::size_t special = 0;
          const std::size_t width = array == 0 ? 4 : 8;
          for (std::size_t i = 0; i < values.size() / width; ++i) {
            double value = 0;
            float narrow = 0;
            if (width == 4)
              std::memcpy(&narrow, values.data() + 4 * i, 4), value = narrow;
            else
              std::memcpy(&value, values.data() + 8 * i, 8);
            const bool expected = array == 0   ? i % 23 < 8
                                  : array == 1 ? (i + 5 * step) % 31 < 6
                                               : step == 2 || i % 13 == 6;
            const double which = array == 0 ? -9999 : array == 1 ? kInfinity : -kInfinity;
            ASSERT_EQ(value == which, expected) << array << ' ' << step << ' ' << i;
            special += expected ? 1 : 0;
          }
          EXPECT_GT(special, 0u);
        }
    }
}

}  // namespace
}  // namespace shm
