// Tests of Schema: names, properties of arrays and blocks, encoded bytes, and schemas that are
// refused.
#include "shm/schema.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>
#include <vector>

#include "format/schema.h"
#include "support/feature_files.h"

namespace shm {
namespace {

Schema rich_schema() {
  Schema schema = mixed_cells().schema;
  schema.source_format = "test";
  schema.order = Order::stream;
  schema.corner_order = false;
  schema.delay = 4000000000;
  schema.coordinate_quantization = {16, {0, -1, -2}, {1, 1, 1}};
  schema.arrays.push_back(array_of("name with spaces, ü", Location::point, ScalarType::int8, 4000));
  schema.arrays.push_back(array_of("", Location::cell, ScalarType::float32, 3, {0, 2, 5}));
  schema.arrays.back().quantization = {52, {0, 0, 0}, {1, 1, 1}};
  schema.arrays.back().role = "test:role";
  schema.arrays.push_back(array_of("steps", Location::cell, ScalarType::uint64));
  schema.arrays.back().per_step = true;
  schema.arrays.push_back(array_of("bounded", Location::point, ScalarType::float64, 2));
  schema.arrays.back().quantization = Quantization::absolute(1e-6, 2);
  schema.arrays.back().per_step = true;
  return schema;
}

TEST(Schema, BytesAndBack) {
  ReadLimits limits;
  Schema fewer = rich_schema();
  for (const StepReference most :
       {StepReference::nothing, StepReference::before, StepReference::trend}) {
    fewer.step_references = most;
    ByteWriter out;
    put(out, fewer);
    Schema back;
    ByteReader in(out.bytes);
    ASSERT_TRUE(get(in, back, limits));
    EXPECT_EQ(back, fewer);
    for (const unsigned unknown : {3u, 4u, 255u}) {
      out.bytes.back() = static_cast<std::byte>(unknown);
      ByteReader inconsistent(out.bytes);
      EXPECT_FALSE(get(inconsistent, back, limits));
    }
  }
  for (const Schema& schema : {Schema{}, rich_schema()}) {
    EXPECT_TRUE(check_schema(schema, limits));
    ByteWriter out;
    put(out, schema);
    Schema back;
    ByteReader in(out.bytes);
    ASSERT_TRUE(get(in, back, limits));
    EXPECT_EQ(back, schema);
    for (std::size_t size = 0; size < out.bytes.size(); ++size) {
      ByteReader cut(std::span<const std::byte>(out.bytes).first(size));
      EXPECT_FALSE(get(cut, back, limits)) << size;
    }
  }
}

TEST(Schema, WhatIsRefused) {
  const double infinity = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::function<void(Schema&)>> lies = {
      [](Schema& s) { s.order = static_cast<Order>(3); },
      [](Schema& s) { s.step_references = static_cast<StepReference>(4); },
      [](Schema& s) { s.order = Order::keep; },  // with corner_order off
      [](Schema& s) { s.coordinate_type = ScalarType::int32; },
      [](Schema& s) { s.coordinate_type = static_cast<ScalarType>(0); },
      [](Schema& s) { s.coordinate_quantization.bits = 53; },
      [](Schema& s) { s.coordinate_quantization.minimum.pop_back(); },
      [](Schema& s) { s.coordinate_quantization.maximum.push_back(1); },
      [](Schema& s) { s.coordinate_quantization.minimum[1] = 2; },
      [&](Schema& s) { s.coordinate_quantization.minimum[1] = -infinity; },
      [&](Schema& s) { s.coordinate_quantization.maximum[2] = nan; },
      [](Schema& s) { s.coordinate_quantization.maximum[2] = 1e301; },
      [](Schema& s) { s.blocks[1].shape = static_cast<CellShape>(12); },
      [](Schema& s) { s.blocks[1].nodes_per_cell = kMaxNodesPerCell + 1; },
      [](Schema& s) { s.arrays[0].type = static_cast<ScalarType>(11); },
      [](Schema& s) { s.arrays[0].location = static_cast<Location>(2); },
      [](Schema& s) { s.arrays[0].components = 0; },
      [](Schema& s) { s.arrays[0].components = 65536; },
      [](Schema& s) { s.arrays[0].blocks = {0}; },  // a point array
      [](Schema& s) {
        s.arrays[0].quantization = {8, {0}, {1}};
      },  // integers
      [](Schema& s) {
        s.arrays[1].blocks = {0, 6};
      },
      [](Schema& s) {
        s.arrays[1].blocks = {2, 0};
      },
      [](Schema& s) {
        s.arrays[1].blocks = {2, 2};
      },
      [](Schema& s) { s.arrays[1].quantization.minimum.pop_back(); },
      [](Schema& s) { s.arrays[1].quantization.max_abs = 1; },  // in addition to bits
      [](Schema& s) { s.arrays[1].quantization.bits = 0, s.arrays[1].quantization.spacing = 1; },
      [](Schema& s) { s.arrays.back().quantization.max_abs = 0; },
      [](Schema& s) { s.arrays.back().quantization.max_abs = -1; },
      [](Schema& s) { s.arrays.back().quantization.max_abs = 1e300; },
      [&](Schema& s) { s.arrays.back().quantization.max_abs = infinity; },
      [&](Schema& s) { s.arrays.back().quantization.max_abs = nan; },
      [](Schema& s) { s.arrays.back().quantization.spacing = 0; },
      [](Schema& s) { s.arrays.back().quantization.spacing = -1; },
      [&](Schema& s) { s.arrays.back().quantization.spacing = infinity; },
      [&](Schema& s) { s.arrays.back().quantization.spacing = nan; },
      [&](Schema& s) { s.arrays.back().quantization.minimum[1] = nan; },
      [&](Schema& s) { s.arrays.back().quantization.minimum[1] = -infinity; },
      [](Schema& s) { s.arrays.back().quantization.minimum.pop_back(); },
      [](Schema& s) {
        s.arrays.back().quantization.maximum = {1, 1};
      },
      [](Schema& s) { s.arrays.back().type = ScalarType::int64; },
  };
  for (std::size_t i = 0; i < lies.size(); ++i) {
    Schema schema = rich_schema();
    lies[i](schema);
    const auto checked = check_schema(schema);
    ASSERT_FALSE(checked) << "lie " << i;
    EXPECT_EQ(checked.error().code, ErrorCode::misuse) << "lie " << i;
    EXPECT_FALSE(checked.error().detail.empty());
    NullSink sink;
    EXPECT_FALSE(Writer::create(sink, schema)) << "lie " << i;
  }
}

TEST(Schema, LimitsAreKept) {
  const auto code = [](const ReadLimits& limits) {
    return check_schema(rich_schema(), limits).error().code;
  };
  ReadLimits limits;
  EXPECT_TRUE(check_schema(rich_schema(), limits));
  limits.max_blocks = 5;
  EXPECT_EQ(code(limits), ErrorCode::over_limit);
  limits = {};
  limits.max_arrays = 2;
  EXPECT_EQ(code(limits), ErrorCode::over_limit);
  limits = {};
  // The static arrays have 4000 + 3 components. The limit does not apply to stepped arrays.
  limits.max_static_components = 4002;
  EXPECT_EQ(code(limits), ErrorCode::over_limit);
}

TEST(Schema, ReadingStopsAtTheLimits) {
  ByteWriter out;
  put(out, rich_schema());
  for (const bool arrays : {false, true}) {
    ReadLimits limits;
    (arrays ? limits.max_arrays : limits.max_blocks) = 2;
    Schema back;
    ByteReader in(out.bytes);
    const auto status = get(in, back, limits);
    ASSERT_FALSE(status);
    EXPECT_EQ(status.error().code, ErrorCode::over_limit);
    EXPECT_LE(arrays ? back.arrays.size() : back.blocks.size(), 3u);
  }
}

TEST(Schema, NamesOfStreams) {
  Schema schema;
  for (const char* name : {"a", "b", "a", "a"})
    schema.arrays.push_back(array_of(name, Location::point, ScalarType::int8));
  schema.arrays.push_back(array_of("a", Location::cell, ScalarType::int8));
  EXPECT_EQ(array_stream_name(schema, 0), "array:point/a");
  EXPECT_EQ(array_stream_name(schema, 1), "array:point/b");
  EXPECT_EQ(array_stream_name(schema, 2), "array:point/a#2");
  EXPECT_EQ(array_stream_name(schema, 3), "array:point/a#3");
  EXPECT_EQ(array_stream_name(schema, 4), "array:cell/a");
}

TEST(Schema, NamesAndSizesOfScalars) {
  const std::array<std::size_t, 10> sizes = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  for (std::size_t t = 0; t < 10; ++t) {
    const auto type = static_cast<ScalarType>(t + 1);
    EXPECT_EQ(scalar_bytes(type), sizes[t]);
    EXPECT_NE(scalar_name(type), "unknown");
  }
  EXPECT_EQ(scalar_bytes(static_cast<ScalarType>(0)), 0u);
  EXPECT_EQ(scalar_name(ScalarType::float32), "float32");
  EXPECT_EQ(shape_name(CellShape::hexahedron), "hexahedron");
}

TEST(Schema, StepOfAQuantization) {
  const Quantization q{8, {0, 10}, {1, 520}};
  EXPECT_EQ(q.step(), 2.0);
  EXPECT_GE(q.max_error(ScalarType::float64), 1.0);
  EXPECT_LT(q.max_error(ScalarType::float64), 1.0001);
  EXPECT_EQ((Quantization{8, {1}, {1}}).step(), 1.0);
}

TEST(Schema, StepOfABound) {
  const Quantization q = Quantization::absolute(.5, 3);
  EXPECT_TRUE(q.lossy());
  EXPECT_EQ(q.max_error(ScalarType::float32), .5);
  EXPECT_EQ(q.max_error(ScalarType::float64), .5);
  EXPECT_LT(q.step(), 1.0);
  EXPECT_GT(q.step(), .97);
  EXPECT_EQ(q.minimum, std::vector<double>(3));
  EXPECT_FALSE(Quantization{}.lossy());
}

TEST(Extra, BytesAndBack) {
  for (const Extra& extra :
       {Extra{"k", ScalarType::uint8, Reference::nothing, {}, std::vector<std::byte>(1)},
        Extra{"", ScalarType::float64, Reference::nothing, {2, 0, 3}, {}},
        Extra{"a/b",
              ScalarType::int32,
              Reference::cell,
              {2, 2},
              std::vector<std::byte>(16, std::byte{9})}}) {
    ByteWriter out;
    put(out, extra);
    ByteReader in(out.bytes);
    Extra back;
    ASSERT_TRUE(get(in, back));
    EXPECT_EQ(back, extra);
  }
}

TEST(Error, SaysFilePlaceAndCause) {
  EXPECT_EQ((Error{ErrorCode::corrupt, "detail", "section", 7, "file"}).message(),
            "file: section, at byte 7: detail");
  EXPECT_EQ((Error{ErrorCode::corrupt, "detail", "", 7, "file"}).message(),
            "file: at byte 7: detail");
  EXPECT_EQ((Error{ErrorCode::corrupt, "detail", "section", kNoOffset, ""}).message(),
            "section: detail");
  EXPECT_EQ((Error{ErrorCode::corrupt, "detail", "", kNoOffset, ""}).message(), "detail");
}

}  // namespace
}  // namespace shm
