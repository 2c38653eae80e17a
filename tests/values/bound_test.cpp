// Tests that errors stay within the absolute error bound: for coordinates, for static and stepped
// arrays on points and cells, and for values of any magnitude. Some of the bounds are smaller than
// the distance between neighbouring floats.
#include <bit>
#include <limits>

#include "shm/mesh.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

constexpr std::uint32_t kSide = 8;  // number of vertices along each edge of the grid

/// Returns a grid whose coordinates and arrays all contain `values`. It has static and stepped
/// arrays on points and on cells.
template <class Real>
Mesh filled_mesh(const std::vector<Real>& values, const Quantization& quantization) {
  const TestMesh from = grid(kSide - 1, kSide - 1, kSide - 1);
  Mesh mesh = mesh_from(from);
  const ScalarType type = sizeof(Real) == 4 ? ScalarType::float32 : ScalarType::float64;
  mesh.schema.coordinate_type = type;
  mesh.schema.coordinate_quantization = quantization;
  mesh.schema.coordinate_quantization.minimum.assign(3, quantization.minimum[0]);
  std::size_t next = 0;
  const auto fill = [&](std::size_t count) {
    std::vector<std::byte> bytes;
    for (std::size_t i = 0; i < count; ++i) append(bytes, values[next++ % values.size()]);
    return bytes;
  };
  mesh.xyz = fill(from.vertices * 3);
  for (const Location location : {Location::point, Location::cell})
    for (const bool per_step : {false, true}) {
      ArrayInfo info;
      info.name = "a" + std::to_string(mesh.schema.arrays.size());
      info.location = location;
      info.type = type;
      info.per_step = per_step;
      info.components = per_step ? 1 : 2;
      info.quantization = quantization;
      info.quantization.minimum.assign(info.components, quantization.minimum[0]);
      mesh.schema.arrays.push_back(info);
      const std::size_t elements = location == Location::point ? from.vertices : from.cells.size();
      mesh.arrays.push_back(per_step ? std::vector<std::byte>() : fill(elements * 2));
      mesh.steps.emplace_back();
      for (int step = 0; per_step && step < 2; ++step) mesh.steps.back().push_back(fill(elements));
    }
  mesh.step_times = {0, 1};
  return mesh;
}

Mesh there_and_back(const Mesh& mesh) {
  MemorySink sink;
  const auto report = write_mesh(sink, mesh);
  EXPECT_TRUE(report) << report.error().message();
  MemorySource source(sink.bytes);
  auto back = read_mesh(source);
  EXPECT_TRUE(back) << back.error().message();
  return back ? std::move(*back) : Mesh{};
}

/// Returns the values of a mesh as a list: first the coordinates, then the values of each array and
/// step.
std::vector<std::vector<std::byte>> all_values(const Mesh& mesh) {
  std::vector<std::vector<std::byte>> runs = {mesh.xyz};
  runs.insert(runs.end(), mesh.arrays.begin(), mesh.arrays.end());
  for (const auto& steps : mesh.steps) runs.insert(runs.end(), steps.begin(), steps.end());
  return runs;
}

/// Compares the values of two meshes. Returns the number of values that are not equal bit for bit.
/// The test fails if an error exceeds the bound.
template <class Real>
std::size_t expect_bound(const Mesh& before, const Mesh& after, double bound) {
  using Bits = std::conditional_t<sizeof(Real) == 4, std::uint32_t, std::uint64_t>;
  const auto sources = all_values(before), restored = all_values(after);
  EXPECT_EQ(before.schema, after.schema);
  EXPECT_EQ(sources.size(), restored.size());
  std::size_t moved = 0;
  for (std::size_t run = 0; run < sources.size() && run < restored.size(); ++run) {
    EXPECT_EQ(sources[run].size(), restored[run].size());
    for (std::size_t at = 0; at < sources[run].size(); at += sizeof(Real)) {
      Real a, b;
      std::memcpy(&a, &sources[run][at], sizeof a);
      std::memcpy(&b, &restored[run][at], sizeof b);
      if (std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b)) continue;
      ++moved;
      // Computes the error with higher precision than the coder does.
      const long double error = static_cast<long double>(a) - static_cast<long double>(b);
      if (std::isfinite(a) && std::isfinite(b) && std::fabs(error) <= bound) continue;
      ADD_FAILURE() << "run " << run << ", value " << at / sizeof(Real) << ": " << a << " became "
                    << b << " with bound " << bound;
      return moved;
    }
  }
  return moved;
}

template <class Real>
std::vector<Real> odd_values() {
  using Limits = std::numeric_limits<Real>;
  std::vector<Real> odd = {Limits::infinity(),
                           -Limits::infinity(),
                           Limits::quiet_NaN(),
                           Limits::max(),
                           Limits::lowest(),
                           Limits::denorm_min(),
                           -Limits::denorm_min(),
                           Limits::min(),
                           Real(-0.0),
                           Real(0.0)};
  if constexpr (sizeof(Real) == 4)
    for (const std::uint32_t bits : {0x7fc12345u, 0xffc00001u, 0x7f800001u})
      odd.push_back(std::bit_cast<float>(bits));
  else
    for (const std::uint64_t bits : {0x7ff8000000012345u, 0xfff8000000000001u, 0x7ff0000000000001u})
      odd.push_back(std::bit_cast<double>(bits));
  return odd;
}

template <class Real>
class Bound : public ::testing::Test {};
using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(Bound, Reals);

TYPED_TEST(Bound, HoldsAtAnyMagnitude) {
  using Real = TypeParam;
  std::mt19937_64 random(1);
  const auto odd = odd_values<Real>();
  std::vector<Real> values;
  for (int i = 0; i < 4000; ++i) {
    const double mantissa = 1 + static_cast<double>(random() % (1u << 30)) * 0x1p-30;
    const int exponent = static_cast<int>(random() % 200) - 100;  // 1e-30 to 1e30
    const double value = std::ldexp(random() % 2 == 0 ? mantissa : -mantissa, exponent);
    values.push_back(random() % 10 == 0 ? odd[random() % odd.size()] : static_cast<Real>(value));
  }
  for (const double bound :
       {1e-310, 1e-45, 1e-30, 1e-20, 1e-9, .5, 1.0, 12345.678, 1e20, 1e31, 9e299}) {
    const Mesh mesh = filled_mesh(values, Quantization::absolute(bound, 1));
    const std::size_t moved = expect_bound<Real>(mesh, there_and_back(mesh), bound);
    if (bound > 1e-30 && bound < 1e30) {
      EXPECT_GT(moved, 0u) << bound;
    }
  }
}

TYPED_TEST(Bound, HoldsNearTheDistanceOfNeighbours) {
  using Real = TypeParam;
  std::mt19937_64 random(2);
  const double ulp = std::numeric_limits<Real>::epsilon();
  std::vector<Real> values;
  for (int i = 0; i < 4000; ++i)
    values.push_back(static_cast<Real>(static_cast<double>(random() % (1u << 30)) * 0x1p-28));
  for (const double part :
       {.01, .49, .5, .51, .75, .99, 1.0, 1.01, 1.5, 1.99, 2.0, 2.5, 7.3, 100.0}) {
    const double bound = part * ulp;
    const Mesh mesh = filled_mesh(values, Quantization::absolute(bound, 1));
    expect_bound<Real>(mesh, there_and_back(mesh), bound);
  }
}

TYPED_TEST(Bound, HoldsForAnyStepAndAnchor) {
  using Real = TypeParam;
  std::mt19937_64 random(3);
  std::vector<Real> values;
  for (int i = 0; i < 4000; ++i)
    values.push_back(static_cast<Real>(static_cast<double>(random() % 2000001) / 1000 - 1000));
  for (const double step : {1e-200, 1e-9, .003, .02, .05, 7.0, 1e299})
    for (const double anchor : {0.0, -999.9, 1e12, -9e299}) {
      Quantization quantization = Quantization::absolute(.01, 1);
      quantization.spacing = step;
      quantization.minimum[0] = anchor;
      const Mesh mesh = filled_mesh(values, quantization);
      expect_bound<Real>(mesh, there_and_back(mesh), .01);
    }
}

// These decimal values are midway between quantization steps, so the error reaches the bound.
TYPED_TEST(Bound, HoldsForDecimals) {
  using Real = TypeParam;
  std::vector<Real> values;
  for (int i = 0; i < 4000; ++i)
    values.push_back(static_cast<Real>((i * 37 % 5000 - 2500) / 1000.0));
  for (const double bound : {.0005, .001, .0025, .005, .05, .5}) {
    const Mesh mesh = filled_mesh(values, Quantization::absolute(bound, 1));
    EXPECT_GT(expect_bound<Real>(mesh, there_and_back(mesh), bound), 0u);
  }
}

TYPED_TEST(Bound, WhatCameBackStays) {
  using Real = TypeParam;
  std::mt19937_64 random(4);
  std::vector<Real> values = odd_values<Real>();
  for (int i = 0; i < 4000; ++i)
    values.push_back(static_cast<Real>(static_cast<double>(random() % 1000000) / 7000));
  const Mesh once = there_and_back(filled_mesh(values, Quantization::absolute(.001, 1)));
  EXPECT_EQ(there_and_back(once), once);
}

TEST(Bound, SmallerFilesThanLossless) {
  std::vector<float> values;
  for (int i = 0; i < 4000; ++i)
    values.push_back(20.f + 5.f * std::sin(static_cast<float>(i) / 50));
  Mesh mesh = filled_mesh(values, Quantization::absolute(.01, 1));
  MemorySink rounded, lossless;
  ASSERT_TRUE(write_mesh(rounded, mesh));
  mesh.schema.coordinate_quantization = {};
  for (ArrayInfo& info : mesh.schema.arrays) info.quantization = {};
  ASSERT_TRUE(write_mesh(lossless, mesh));
  EXPECT_LT(2 * rounded.bytes.size(), lossless.bytes.size());
}

TEST(Bound, BitsOfABoxInStepsToo) {
  std::vector<double> values;
  for (int i = 0; i < 4000; ++i) values.push_back(std::sin(i));
  Mesh mesh = filled_mesh(values, Quantization::absolute(1, 1));
  mesh.schema.coordinate_quantization = {};
  for (ArrayInfo& info : mesh.schema.arrays) {
    info.quantization = {12, {}, {}};
    info.quantization.minimum.assign(info.components, -1);
    info.quantization.maximum.assign(info.components, 1);
  }
  const double promise = mesh.schema.arrays[1].quantization.max_error(ScalarType::float64);
  EXPECT_GT(expect_bound<double>(mesh, there_and_back(mesh), promise), 0u);
}

}  // namespace
}  // namespace shm
