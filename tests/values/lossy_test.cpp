// Tests of the options --abs, --rel, --bits and --array: their syntax, the names of arrays,
// precedence, bounds that depend on ranges, and complete round trips through a .shm file.
#include "accuracy/lossy.h"
#include "accuracy/block_bounds.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "base/failure.h"
#include "compare/compare.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

std::string complaint(const std::function<void()>& call) {
  try {
    call();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::misuse);
    return failure.error().message();
  }
  return "no complaint";
}

Schema schema_of(MeshSource& mesh, const Lossy& lossy) {
  Schema schema = mesh.info().schema;
  set_accuracy(mesh, lossy, schema, {});
  return schema;
}

Lossy named(std::initializer_list<const char*> list) {
  Lossy lossy;
  for (const char* text : list) lossy.named.push_back(parse_named_accuracy(text, "--array"));
  return lossy;
}

TEST(Accuracy, IsReadFromWords) {
  EXPECT_EQ(parse_accuracy("lossless", "x").kind, Accuracy::Kind::lossless);
  EXPECT_EQ(parse_accuracy("abs=1e-6", "x").bound, 1e-6);
  EXPECT_EQ(parse_accuracy("rel=.25", "x").kind, Accuracy::Kind::relative);
  EXPECT_EQ(parse_accuracy("bits=52", "x").bits, 52u);
  EXPECT_EQ(parse_accuracy("pwrel=.125", "x").kind, Accuracy::Kind::pointwise);
  EXPECT_EQ(parse_accuracy("pwrel=.125", "x").bound, .125);
  EXPECT_DOUBLE_EQ(parse_accuracy("digits=3", "x").bound, .5e-3);
  const NamedAccuracy odd = parse_named_accuracy("a:b=c:abs=2", "x");
  EXPECT_EQ(odd.name, "a:b=c");
  EXPECT_EQ(odd.accuracy.bound, 2.0);
  for (const char* text :
       {"",        "abs",      "abs=",       "abs=0",    "abs=-1",    "abs=1e300",  "abs=nan",
        "abs=inf", "abs=1x",   "abs= 1",     "rel=1",    "rel=0",     "rel=1e-400", "bits=0",
        "bits=53", "pwrel=.5", "pwrel=0",    "digits=0", "digits=16", "bits=-1",    "bits=1.5",
        "bits=",   "exact",    "lossless=1", "Abs=1"})
    EXPECT_NE(complaint([&] { parse_accuracy(text, "--opt"); }).find("--opt: "), std::string::npos)
        << text;
  for (const char* text : {"", "heat", ":abs=1", "heat=abs:1", "heat:"})
    EXPECT_NE(complaint([&] { parse_named_accuracy(text, "--opt"); }).find("--opt: "),
              std::string::npos)
        << text;
}

// The mesh has the arrays tag (int64), normal (float32 points), heat (float64 points, stepped),
// mark and level (integers), and stress (float32, stepped, on one block).
TEST(Lossy, FieldsAreWhatFloatsAndHasNoRole) {
  MemoryMesh mesh = rich_mesh();
  std::vector<double> weights(mesh.mesh.vertices, 1.5);
  mesh.add_array<double>(
      {"weight", Location::point, ScalarType::float64, 1, false, {}, "test:weight", {}}, {weights});
  Lossy lossy;
  lossy.fields = Accuracy::absolute(.01);
  const Schema schema = schema_of(mesh, lossy);
  EXPECT_FALSE(schema.coordinate_quantization.lossy());
  for (const ArrayInfo& array : schema.arrays) {
    const bool field = array.name == "normal" || array.name == "heat" || array.name == "stress";
    EXPECT_EQ(array.quantization.lossy(), field) << array.name;
    if (field) {
      EXPECT_EQ(array.quantization.max_abs, .01);
      EXPECT_GT(array.quantization.step(), .015);
      EXPECT_LT(array.quantization.step(), .0201);
    }
  }
  // An array that is not a field (it has a role) is quantized only if an option names it.
  lossy = named({"weight:abs=.125"});
  EXPECT_EQ(schema_of(mesh, lossy).arrays.back().quantization.max_abs, .125);
}

TEST(Lossy, NamesBeatTheRest) {
  MemoryMesh mesh = rich_mesh();
  Lossy lossy = named({"coordinates:abs=.5", "heat:lossless", "point/normal:bits=9"});
  lossy.coordinates = Accuracy::of_bits(16);
  lossy.fields = Accuracy::relative(.001);
  const Schema schema = schema_of(mesh, lossy);
  EXPECT_EQ(schema.coordinate_quantization.max_abs, .5);
  EXPECT_EQ(schema.arrays[1].quantization.bits, 9u);
  EXPECT_EQ(schema.arrays[1].quantization.minimum, (std::vector<double>{-0.0, 0, 0}));
  EXPECT_FALSE(schema.arrays[2].quantization.lossy());
  // Across all steps, the values of the array stress range from 1/3 to the number of wedges.
  const double most = static_cast<double>(mesh.mesh.block_cells[1]);
  EXPECT_NEAR(schema.arrays[5].quantization.max_abs, .001 * (most - 1.0 / 3), 1e-9);
}

TEST(Lossy, RangesGoOverComponentsAndSteps) {
  MemoryMesh mesh = grid_mesh(2, 1, 1);  // .2 x .12 x .3
  mesh.mesh.step_times = {0, 1};
  const double odd = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::vector<double>> steps(2, std::vector<double>(24, 1.0));
  steps[0][3] = -4;
  steps[1][22] = 6;
  steps[1][5] = odd;
  steps[1][6] = std::numeric_limits<double>::infinity();
  mesh.add_array<double>({"v", Location::point, ScalarType::float64, 2, true, {}, "", {}}, steps);
  mesh.add_array<double>({"same", Location::cell, ScalarType::float64, 1, false, {}, "", {}},
                         {{7, 7}});
  mesh.add_array<double>({"none", Location::cell, ScalarType::float64, 1, false, {}, "", {}},
                         {{odd, odd}});
  Lossy lossy;
  lossy.coordinates = lossy.fields = Accuracy::relative(.01);
  Schema schema = schema_of(mesh, lossy);
  EXPECT_DOUBLE_EQ(schema.coordinate_quantization.max_abs, .003);
  EXPECT_DOUBLE_EQ(schema.arrays[0].quantization.max_abs, .1);
  EXPECT_FALSE(schema.arrays[1].quantization.lossy());  // no range
  EXPECT_FALSE(schema.arrays[2].quantization.lossy());
  lossy.fields = Accuracy::of_bits(8);
  schema = schema_of(mesh, lossy);
  EXPECT_EQ(schema.arrays[0].quantization.minimum, (std::vector<double>{1, -4}));
  EXPECT_EQ(schema.arrays[0].quantization.maximum, (std::vector<double>{6, 1}));
  EXPECT_EQ(schema.arrays[2].quantization.maximum, (std::vector<double>{0}));
}

TEST(Lossy, NamesThatDoNotFit) {
  MemoryMesh mesh = rich_mesh();
  const auto error_of = [&](std::initializer_list<const char*> list) {
    return complaint([&] { schema_of(mesh, named(list)); });
  };
  EXPECT_EQ(error_of({"Heat:abs=1"}), "--array: the mesh has no array 'Heat'");
  EXPECT_EQ(error_of({"cell/heat:abs=1"}), "--array: the mesh has no array 'cell/heat'");
  EXPECT_EQ(error_of({"mark:abs=1"}),
            "--array: 'mark' holds uint8, and integers are never rounded");
  EXPECT_EQ(error_of({"mark:lossless"}), "no complaint");
  EXPECT_EQ(error_of({"heat:abs=1", "point/heat:lossless"}), "--array: 'point/heat' comes twice");
  EXPECT_EQ(error_of({"coordinates:abs=1", "coordinates:abs=1"}),
            "--array: 'coordinates' comes twice");
  const std::vector<float> values(mesh.cells.size(), 1.0f);
  for (int i = 0; i < 2; ++i)
    mesh.add_array<float>({"heat", Location::cell, ScalarType::float32, 1, false, {}, "", {}},
                          {values});
  EXPECT_EQ(error_of({"heat:abs=1"}),
            "--array: several arrays are called 'heat'; use 'point/heat' or 'cell/heat' or "
            "'cell/heat#2'");
  const Schema schema = schema_of(mesh, named({"cell/heat#2:abs=1", "point/heat:abs=2"}));
  EXPECT_EQ(schema.arrays[2].quantization.max_abs, 2);
  EXPECT_FALSE(schema.arrays[6].quantization.lossy());
  EXPECT_EQ(schema.arrays[7].quantization.max_abs, 1);
}

CompareReport round_trip(MeshSource& mesh, const CompressOptions& options,
                         std::size_t* bytes = nullptr) {
  Spool spool(::testing::TempDir());
  MemorySink sink;
  compress_mesh(mesh, sink, options, spool);
  if (bytes != nullptr) *bytes = sink.bytes.size();
  MemorySource source(sink.bytes);
  StagedMesh restored(source, "test.shm", spool);
  return compare_meshes(mesh, restored, spool);
}

std::string words(const CompareReport& report) {
  std::string text;
  for (const std::string& sentence : report.first) text += sentence + "\n";
  return text;
}

TEST(Lossy, ThroughAFileInEveryOrder) {
  MemoryMesh mesh = rich_mesh();
  for (const Order order : {Order::keep, Order::stream, Order::free})
    for (const double part : {1e-2, 1e-5, 1e-9}) {
      CompressOptions options;
      options.order = order;
      options.delay = order == Order::free ? 0 : 7;
      options.lossy.coordinates = Accuracy::absolute(part);
      options.lossy.fields = Accuracy::relative(part);
      const CompareReport report = round_trip(mesh, options);
      EXPECT_TRUE(report.equal()) << part << "\n" << words(report);
      if (part == 1e-2) {
        // Rounding would not make one of the four arrays smaller, so it is exact.
        EXPECT_EQ(report.measured.size(), 3u);
      }
      for (const MeasuredError& error : report.measured)
        EXPECT_LE(error.largest, error.promised) << error.what;
    }
}

// Values stay within the bound, zeros stay zeros, and values that cannot be rounded stay as they
// are.
TEST(Lossy, RoundedWithinABound) {
  std::mt19937 random(8);
  for (int i = 0; i < 20000; ++i) {
    const auto magnitude = [&](unsigned most) {
      const auto exponent = static_cast<int>(random() % (2 * most)) - static_cast<int>(most);
      return std::ldexp(static_cast<double>(random()) + 1, exponent - 32);
    };
    double value = magnitude(120) * (random() % 2 ? 1 : -1);
    const double bound = magnitude(130);
    for (const ScalarType type : {ScalarType::float64, ScalarType::float32}) {
      if (type == ScalarType::float32) value = static_cast<double>(static_cast<float>(value));
      const double rounded = rounded_within(bound, value, type);
      EXPECT_LE(std::fabs(rounded - value), bound);
      if (type == ScalarType::float32) {
        EXPECT_EQ(rounded, static_cast<double>(static_cast<float>(rounded)));
      }
      EXPECT_EQ(rounded_within(bound, rounded, type), rounded);
    }
  }
  EXPECT_EQ(rounded_within(.5, 2.25, ScalarType::float64), 2);
  EXPECT_EQ(rounded_within(.4, 2.3, ScalarType::float64), 2.5);
  EXPECT_EQ(rounded_within(0, 2.3, ScalarType::float64), 2.3);
  EXPECT_TRUE(std::signbit(rounded_within(1, -0.0, ScalarType::float64)));
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(rounded_within(1, -kInfinity, ScalarType::float64), -kInfinity);
  EXPECT_TRUE(std::isnan(rounded_within(1, std::nan(""), ScalarType::float32)));
  for (const double value : {1e-310, 1e308})
    for (const double bound : {5e-324, 1e-308, 1e299})
      EXPECT_LE(std::fabs(rounded_within(bound, value, ScalarType::float64) - value), bound);
}

TEST(Lossy, ThroughShifts) {
  MemoryMesh mesh = grid_mesh(12, 12, 12);
  std::vector<double> values(2 * mesh.mesh.vertices);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = std::sin(static_cast<double>(i) * .01) * 30;
  values[5] = std::bit_cast<double>(0x7ff8000000000123u);
  values[6] = -std::numeric_limits<double>::infinity();
  values[7] = 1e300;
  mesh.add_array<double>({"odd", Location::point, ScalarType::float64, 2, false, {}, "", {}},
                         {values});
  std::vector<float> tame(mesh.cells.size());
  for (std::size_t i = 0; i < tame.size(); ++i) tame[i] = static_cast<float>(i % 144) * .7f;
  mesh.add_array<float>({"tame", Location::cell, ScalarType::float32, 1, false, {}, "", {}},
                        {tame});
  for (const bool of_bits : {false, true}) {
    std::size_t last = 0;
    for (const double part : {1e-2, 1e-5, 1e-9}) {
      CompressOptions options;
      options.connectivity = ConnectivityCodec::shifts;
      options.lossy.coordinates = Accuracy::absolute(part);
      options.lossy.fields = of_bits ? Accuracy::of_bits(part > 1e-4   ? 8
                                                         : part > 1e-8 ? 18
                                                                       : 40)
                                     : Accuracy::absolute(part);
      std::size_t bytes = 0;
      const CompareReport report = round_trip(mesh, options, &bytes);
      EXPECT_TRUE(report.equal()) << part << "\n" << words(report);
      EXPECT_GE(report.measured.size(), 2u);  // with 40 bits, float32 arrays are not rounded
      for (const MeasuredError& error : report.measured)
        EXPECT_LE(error.largest, error.promised) << error.what;
      EXPECT_GT(bytes, last);
      last = bytes;
    }
  }
}

// The quantization step depends on the magnitude of the values. Even if the bound is near the
// distance between neighbouring floats, errors must be within the bound, and the file may be at
// most 2 % larger than with lossless values.
TEST(Lossy, TighterBoundsCostMoreButNotMoreThanLossless) {
  MemoryMesh mesh = grid_mesh(12, 12, 12);
  std::mt19937_64 random(1);
  std::vector<float> values(mesh.cells.size());
  for (float& v : values) v = 300 + static_cast<float>(random() % 1000000) * 1e-4f;
  values[7] = 9.97e36f;  // no data
  values[8] = std::bit_cast<float>(0x7fc00123u);
  mesh.add_array<float>({"t", Location::cell, ScalarType::float32, 1, false, {}, "", {}}, {values});
  std::size_t lossless = 0, last = 0;
  EXPECT_TRUE(round_trip(mesh, {}, &lossless).equal());
  for (double bound = 1; bound > 1e-8; bound *= .6) {
    CompressOptions options;
    options.lossy.fields = Accuracy::absolute(bound);
    std::size_t bytes = 0;
    const CompareReport report = round_trip(mesh, options, &bytes);
    EXPECT_TRUE(report.equal()) << bound << "\n" << words(report);
    EXPECT_GE(bytes + 32, last) << bound;
    EXPECT_LE(bytes, lossless + lossless / 50) << bound;
    last = bytes;
  }
  EXPECT_NEAR(static_cast<double>(last), static_cast<double>(lossless), 32);
}

TEST(Compare, BrokenPromisesAreNamed) {
  MemoryMesh source = rich_mesh(), restored = rich_mesh();
  restored.mesh.schema.arrays[2].quantization = Quantization::absolute(.25, 1);  // heat
  Spool spool(::testing::TempDir());
  const auto set = [&](MemoryMesh& mesh, double value) {
    std::memcpy(mesh.arrays[2][1].data() + 5 * 8, &value, 8);
  };
  const auto report = [&] { return compare_meshes(source, restored, spool); };
  set(source, 10);
  set(restored, 10.25);
  EXPECT_TRUE(report().equal());
  ASSERT_EQ(report().measured.size(), 1u);
  EXPECT_EQ(report().measured[0].what, "array 'heat'");
  EXPECT_EQ(report().measured[0].largest, .25);
  EXPECT_EQ(report().measured[0].promised, .25);
  set(restored, 10.5);
  EXPECT_EQ(words(report()),
            "array 'heat', step 1, vertex 5: 10 in the source, 10.5 in the restored mesh; error "
            "0.5, allowed 0.25\n");
  EXPECT_EQ(report().measured[0].largest, .5);
  set(source, std::numeric_limits<double>::infinity());
  EXPECT_EQ(words(report()),
            "array 'heat', step 1, vertex 5: inf in the source, 10.5 in the restored mesh\n");
  set(source, std::bit_cast<double>(0x7ff8000000000001u));
  set(restored, std::bit_cast<double>(0x7ff8000000000002u));
  EXPECT_EQ(report().differences, 1u);
  set(source, -0.0);
  set(restored, 0.0);
  EXPECT_TRUE(report().equal());
}

TEST(Compare, ArraysOfOneNameAreMeasuredApart) {
  MemoryMesh mesh = grid_mesh(3, 3, 3);
  for (const Location location : {Location::point, Location::cell}) {
    ArrayInfo info{"t", location, ScalarType::float32, 1, false, {}, "", {}};
    std::vector<float> values(location == Location::point ? 64 : 27);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = static_cast<float>(i) * .7f;
    mesh.add_array<float>(info, {values});
  }
  CompressOptions options;
  options.lossy = named({"point/t:abs=1", "cell/t:abs=2"});
  const CompareReport report = round_trip(mesh, options);
  EXPECT_TRUE(report.equal());
  ASSERT_EQ(report.measured.size(), 2u);
  EXPECT_EQ(report.measured[0].what, "array 'point/t'");
  EXPECT_EQ(report.measured[1].what, "array 'cell/t'");
  EXPECT_EQ(report.measured[1].promised, 2.0);
}

}  // namespace
}  // namespace shm::converters
