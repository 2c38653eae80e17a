// Tests of components that have the same values as an earlier component of their array: they make
// files only slightly larger, and a copy of a component that is not an earlier one is refused.
#include "codecs/shared/equal_components.h"

#include <gtest/gtest.h>

#include "codecs/patterns/term_column.h"
#include "codecs/shifts/difference_column.h"
#include "codecs/weighted/weighted_column.h"
#include "support/feature_files.h"

namespace shm {
namespace {

using Bytes = std::vector<std::byte>;

/// The components of a symmetric tensor in rows, and those of them that differ.
const std::vector<std::uint64_t> kAll = {0, 1, 2, 1, 3, 4, 2, 4, 5}, kSome = {0, 1, 2, 3, 4, 5};

double value_at(std::uint64_t element, std::uint64_t component, std::uint64_t step) {
  return std::sin(.1 * double(element % 7) + double(component) + .2 * double(step)) +
         .01 * random_share(element, component + 10 * step);
}

Bytes with_tensor(const std::vector<std::uint64_t>& components, ConnectivityCodec codec,
                  Level level) {
  TestMesh mesh = bent_grid(8, 7, 7);
  ArrayInfo info = array_of("t", Location::cell, ScalarType::float64,
                            static_cast<std::uint32_t>(components.size()));
  std::vector<std::byte> values;
  for (std::uint64_t e = 0; e < mesh.cells.size(); ++e)
    for (const std::uint64_t c : components) append(values, value_at(e, c, 0));
  mesh.schema.arrays.push_back(std::move(info));
  mesh.arrays.push_back(std::move(values));
  return written(mesh, 100, codec, level);
}

Bytes with_tensor_at_steps(const std::vector<std::uint64_t>& components, Level level,
                           double bound) {
  WriteOptions options;
  options.level = level;
  options.waiting_bytes = 0;  // no bundles
  options.slow_step_values = 0;
  const auto count = static_cast<std::uint32_t>(components.size());
  ArrayInfo info = array_of("t", Location::point, ScalarType::float64, count);
  if (bound > 0) info.quantization = Quantization::absolute(bound, count);
  return written_with_steps(
      bent_grid(8, 7, 7), {info}, options, 5,
      [&](std::uint32_t, std::uint64_t scalar, std::uint64_t step) -> std::optional<double> {
        return value_at(scalar / count, components[scalar % count], step);
      });
}

TEST(EqualComponents, NeedLittleSpace) {
  using enum ConnectivityCodec;
  for (const auto& [codec, level] :
       {std::pair(rows, Level::standard), std::pair(mixed, Level::best),
        std::pair(shifts, Level::standard), std::pair(shifts, Level::fast),
        std::pair(patterns, Level::fast)})
    EXPECT_LT(with_tensor(kAll, codec, level).size(), with_tensor(kSome, codec, level).size() + 100)
        << codec_name(codec) << " at level " << static_cast<int>(level);
}

TEST(EqualComponents, NeedLittleSpaceAtTimeSteps) {
  for (const Level level : {Level::fast, Level::standard, Level::best})
    for (const double bound : {0.0, 1e-3})
      EXPECT_LT(double(with_tensor_at_steps(kAll, level, bound).size()),
                1.02 * double(with_tensor_at_steps(kSome, level, bound).size()))
          << "level " << static_cast<int>(level) << ", bound " << bound;
}

TEST(EqualComponents, AreFoundIfTheyAreRoundedAlike) {
  ArrayInfo info = array_of("t", Location::cell, ScalarType::float32, 3);
  Bytes values;
  for (int i = 0; i < 30; ++i) append(values, static_cast<float>(i / 3));
  const auto equal_to = [&](std::size_t component, std::size_t elements = 10) {
    return equal_component(info, values.data(), 12, elements, component);
  };
  EXPECT_FALSE(equal_to(0));
  EXPECT_EQ(equal_to(1), 0u);
  EXPECT_EQ(equal_to(2), 0u);
  info.quantization = {8, {0, 0, 0}, {10, 11, 10}};
  EXPECT_FALSE(equal_to(1));
  EXPECT_EQ(equal_to(2), 0u);
  values.back() = std::byte{1};
  EXPECT_FALSE(equal_to(2));
  EXPECT_EQ(equal_to(2, 9), 0u);
}

/// Two components with one element, a zero. The second one is a copy of the component `source`.
Bytes copy_of(int source, std::initializer_list<int> zero) {
  Bytes bytes;
  for (const int number : zero) bytes.push_back(static_cast<std::byte>(number));
  bytes.push_back(std::byte{7});
  bytes.push_back(static_cast<std::byte>(source));
  return bytes;
}

TEST(EqualComponents, ACopyHasAnEarlierSource) {
  const ArrayInfo info = array_of("t", Location::cell, ScalarType::float32, 2);
  for (const int source : {0, 1, 2, 127}) {
    TermColumn terms(info, true);
    TermScratch scratch;
    EXPECT_EQ(terms.begin_group(Codec::terms, copy_of(source, {1, 0, 0, 0}), 8, scratch),
              source == 0);
    TiledItems elements;
    elements.items.resize(1);
    elements.items[0].self = 0;
    WeightedDecoder weighted(info, {});
    weighted.make_room(1);
    Bytes out;
    EXPECT_EQ(weighted.decode(
                  elements,
                  copy_of(source, {1, 3 << 3, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0x80, 0, 0, 0, 0, 0}),
                  {}, out),
              source == 0);
  }
}

}  // namespace
}  // namespace shm
