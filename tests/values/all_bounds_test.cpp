// Tests that no value exceeds its error bound, for 2000 random arrays with random bounds of every
// kind. The arrays have all kinds of values: smooth, noisy, of all magnitudes, repeated, with runs
// of fill values, infinities, NaN, zeros of both signs and denormals.
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <string>

#include "shm/mesh.h"
#include "support/sanitized.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

constexpr std::uint64_t kArrays = kSanitized ? 300 : 2000, kArraysOfMesh = 20;
constexpr double kFill = -9999;

class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15u + 1) {}
  std::uint64_t next() {
    state_ ^= state_ << 13;
    state_ ^= state_ >> 7;
    return state_ ^= state_ << 17;
  }
  std::uint64_t below(std::uint64_t end) { return next() % end; }
  /// Returns a number from 0 to 1.
  double share() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

using Field = std::function<double(std::uint64_t i, std::uint64_t step)>;

/// Returns one of eight kinds of fields. `random` must outlive it.
Field field_of(std::uint64_t kind, Random& random) {
  const double size = std::ldexp(1 + random.share(), static_cast<int>(random.below(60)) - 30);
  const double slope = random.share() - .5;
  switch (kind) {
    case 0:
      return [=](auto i, auto s) { return size * std::sin(double(i) / 40 + slope * double(s)); };
    case 1: return [=, &random](auto, auto) { return size * (random.share() - .5); };
    case 2:
      return [=, &random](auto, auto) {
        return std::ldexp(random.share() - .5, static_cast<int>(random.below(2000)) - 1000);
      };
    case 3: return [=](auto i, auto s) { return size * double((i * 7 + s) % 5); };
    case 4: return [=](auto i, auto s) { return double((i * 37 + s * 11) % 1000) / 100; };
    case 5:
      return [=](auto i, auto s) { return size + std::fabs(slope) * double(i + s) * 1e-9 * size; };
    case 6: return [=](auto i, auto s) { return size * std::exp(-double((i + 3 * s) % 200) / 4); };
    default:
      return
          [=, &random](auto i, auto) { return random.below(9) == 0 ? 0.0 : size / double(i + 1); };
  }
}

double special_value(Random& random, ScalarType type) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  switch (random.below(7)) {
    case 0: return kInfinity;
    case 1: return -kInfinity;
    case 2: return std::numeric_limits<double>::quiet_NaN();
    case 3: return -0.0;
    case 4: return type == ScalarType::float32 ? 0x1p-140 : 0x1p-1060;
    case 5: return type == ScalarType::float32 ? 0x1.fffffep127 : 0x1.fffffffffffffp1023;
    default: return kFill;
  }
}

Quantization random_bound(Random& random, ScalarType type, std::uint32_t components, double size) {
  const double part = std::ldexp(1 + random.share(), -static_cast<int>(random.below(24)) - 2);
  switch (random.below(3)) {
    case 0: return Quantization::absolute(size * part, components);
    case 1: return Quantization::relative(std::min(part, .5), type);
    default: {
      const auto bits = static_cast<std::uint32_t>(2 + random.below(30));
      return {bits, std::vector<double>(components, -size), std::vector<double>(components, size)};
    }
  }
}

template <class Real>
std::vector<std::byte> values_of(const Field& field, ScalarType type, std::uint64_t count,
                                 std::uint64_t step, std::uint64_t specials, Random& random) {
  std::vector<std::byte> out;
  std::uint64_t left = 0;  // number of special values still to come in a run
  double special = 0;
  for (std::uint64_t i = 0; i < count; ++i) {
    double value = field(i, step);
    if (left == 0 && specials > 0 && random.below(specials) == 0) {
      left = 1 + random.below(12);
      special = special_value(random, type);
    }
    if (left > 0) {
      --left;
      value = special;
    }
    append(out, static_cast<Real>(value));
  }
  return out;
}

/// Checks that the restored values are within the bound of the array. Values that are not finite
/// and fill values must not change.
template <class Real>
void expect_within(const ArrayInfo& info, const std::vector<std::byte>& before,
                   const std::vector<std::byte>& after) {
  ASSERT_EQ(before.size(), after.size()) << info.name;
  for (std::size_t at = 0; at < before.size(); at += sizeof(Real)) {
    Real a, b;
    std::memcpy(&a, &before[at], sizeof a);
    std::memcpy(&b, &after[at], sizeof b);
    if (std::memcmp(&before[at], &after[at], sizeof a) == 0) continue;
    const auto error = std::fabs(static_cast<long double>(a) - static_cast<long double>(b));
    const long double bound =
        info.quantization.bits == Quantization::kRelative
            ? std::fabs(static_cast<long double>(a)) * info.quantization.max_rel
            : static_cast<long double>(info.quantization.max_error(info.type));
    const bool is_fill = !info.fills.empty() && a == Real(kFill);
    // The coder computes errors in double precision.
    const bool is_within = error <= bound * (1 + 0x1p-50L);
    if (std::isfinite(a) && std::isfinite(b) && is_within && !is_fill) continue;
    ADD_FAILURE() << info.name << ", value " << at / sizeof(Real) << ": " << a << " became " << b
                  << " with bits " << info.quantization.bits;
    return;
  }
}

/// Returns a mesh with random arrays.
Mesh random_mesh(Random& random) {
  const auto side = static_cast<int>(2 + random.below(7));
  const TestMesh from = grid(side, side, side);
  Mesh mesh = mesh_from(from);
  mesh.step_times = {0, 1, 2, 3};
  for (std::uint64_t a = 0; a < kArraysOfMesh; ++a) {
    ArrayInfo info;
    info.location = std::array{Location::point, Location::cell, Location::global,
                               Location::side_set}[random.below(4)];
    info.type = random.below(2) == 0 ? ScalarType::float32 : ScalarType::float64;
    info.components = static_cast<std::uint32_t>(1 + random.below(3));
    info.per_step = !is_on_mesh(info.location) || random.below(3) > 0;
    if (!is_on_mesh(info.location)) info.elements = 1 + random.below(40);
    if (random.below(2) == 0) info.fills = {kFill};
    const std::uint64_t kind = random.below(8), specials = random.below(3) == 0 ? 20 : 0;
    info.name = "array " + std::to_string(a) + " of kind " + std::to_string(kind);
    const Field field = field_of(kind, random);
    const std::uint64_t elements = info.location == Location::point  ? from.vertices
                                   : info.location == Location::cell ? from.cells.size()
                                                                     : info.elements;
    const auto values = [&](std::uint64_t step) {
      return info.type == ScalarType::float32
                 ? values_of<float>(field, info.type, elements * info.components, step, specials,
                                    random)
                 : values_of<double>(field, info.type, elements * info.components, step, specials,
                                     random);
    };
    double size = 0;
    for (std::uint64_t i = 0; i < 20; ++i) size = std::max(size, std::fabs(field(i, 0)));
    info.quantization =
        random_bound(random, info.type, info.components, size > 0 && size < 1e200 ? size : 1.0);
    mesh.arrays.push_back(info.per_step ? std::vector<std::byte>() : values(0));
    mesh.steps.emplace_back();
    for (std::uint64_t step = 0; info.per_step && step < 4; ++step)
      mesh.steps.back().push_back(values(step));
    mesh.schema.arrays.push_back(std::move(info));
  }
  return mesh;
}

TEST(AllBounds, HoldForRandomArrays) {
  for (std::uint64_t m = 0; m < kArrays / kArraysOfMesh; ++m) {
    SCOPED_TRACE("mesh " + std::to_string(m));
    Random random(m + 1);
    const Mesh mesh = random_mesh(random);
    WriteOptions options;
    options.level = static_cast<Level>(m % 3);
    options.waiting_bytes = m % 4 == 0 ? options.waiting_bytes : 0;
    options.slow_step_values = m % 2 == 0 ? options.slow_step_values : 0;
    options.segment_cells = m % 5 == 0 ? 50 : 0;
    MemorySink sink;
    const auto report = write_mesh(sink, mesh, options);
    ASSERT_TRUE(report) << report.error().message();
    MemorySource source(sink.bytes);
    const auto back = read_mesh(source);
    ASSERT_TRUE(back) << back.error().message();
    for (std::size_t a = 0; a < mesh.schema.arrays.size(); ++a) {
      const ArrayInfo& info = mesh.schema.arrays[a];
      const auto check = [&](const std::vector<std::byte>& before,
                             const std::vector<std::byte>& after) {
        info.type == ScalarType::float32 ? expect_within<float>(info, before, after)
                                         : expect_within<double>(info, before, after);
      };
      if (!info.per_step) check(mesh.arrays[a], back->arrays[a]);
      for (std::size_t s = 0; s < mesh.steps[a].size(); ++s)
        check(mesh.steps[a][s], back->steps[a][s]);
    }
  }
}

// Zeros remain zeros under absolute and relative bounds, and relative bounds keep signs.
TEST(AllBounds, ZerosAndSignsStay) {
  for (const bool is_relative : {false, true}) {
    const TestMesh from = grid(6, 6, 6);
    Mesh mesh = mesh_from(from);
    std::vector<double> values(from.vertices);
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = i % 3 == 0 ? 0.0 : std::ldexp(i % 2 == 0 ? 1.3 : -1.3, static_cast<int>(i % 40));
    mesh.add_array<double>("a", Location::point, values);
    mesh.schema.arrays[0].quantization = is_relative
                                             ? Quantization::relative(.3, ScalarType::float64)
                                             : Quantization::absolute(10, 1);
    MemorySink sink;
    ASSERT_TRUE(write_mesh(sink, mesh));
    MemorySource source(sink.bytes);
    const auto back = read_mesh(source);
    ASSERT_TRUE(back);
    const auto restored = back->values_as<double>(0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (values[i] == 0) {
        EXPECT_EQ(restored[i], 0) << i;
      }
      if (is_relative) {
        EXPECT_EQ(std::signbit(restored[i]), std::signbit(values[i])) << i;
      }
    }
  }
}

// Fields of many magnitudes: each bit less of the bound saves about a bit a value.
TEST(AllBounds, RelativeBoundsSaveSpace) {
  const auto size_at = [](double bound) {
    const TestMesh from = grid(16, 16, 16);
    Mesh mesh = mesh_from(from);
    Random random(3);
    std::vector<double> values(from.vertices);
    for (double& value : values)
      value = std::ldexp(1 + random.share(), static_cast<int>(random.below(30)));
    mesh.add_array<double>("a", Location::point, values);
    if (bound > 0)
      mesh.schema.arrays[0].quantization = Quantization::relative(bound, ScalarType::float64);
    MemorySink sink;
    EXPECT_TRUE(write_mesh(sink, mesh));
    return static_cast<double>(8 * sink.bytes.size()) / static_cast<double>(values.size());
  };
  const double coarse = size_at(0x1p-8), fine = size_at(0x1p-16), exact = size_at(0);
  EXPECT_NEAR(fine - coarse, 8, .6);
  EXPECT_LT(fine, exact / 2);
}

}  // namespace
}  // namespace shm
