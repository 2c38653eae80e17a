// Tests of RecordedOrder, which records the order in which a Writer codes a mesh. A caller needs
// this order to pass values in the order that the Writer expects, and to determine which vertex and
// cell numbers a Reader will return.
#include "shm/recorded_order.h"

#include "support/feature_files.h"

namespace shm {
namespace {

RecordedOrder some_order() {
  RecordedOrder order;
  for (const std::uint64_t v : {2, 0, 3, 1}) order.vertex(v);
  for (const std::uint64_t c : {1, 0, 3, 2}) order.cell(c);
  return order;
}

Schema two_blocks() {
  Schema schema;
  schema.blocks.resize(2);
  schema.arrays = {array_of("p", Location::point, ScalarType::int32),
                   array_of("c", Location::cell, ScalarType::int32),
                   array_of("b", Location::cell, ScalarType::int32)};
  schema.arrays[2].blocks = {1};
  return schema;
}

using Numbers = std::vector<std::uint64_t>;

TEST(RecordedOrder, ElementsAreInCodingOrder) {
  const RecordedOrder order = some_order();
  const Schema schema = two_blocks();
  const std::vector<std::uint32_t> blocks{1, 0, 1, 1};
  EXPECT_EQ(*order.elements(schema, 0, {}), (Numbers{2, 0, 3, 1}));
  EXPECT_EQ(*order.elements(schema, 1, {}), (Numbers{1, 0, 3, 2}));
  EXPECT_EQ(*order.elements(schema, 2, blocks), (Numbers{0, 2, 1}));  // of cells 0, 2, 3
  EXPECT_EQ(order.elements(schema, 2, {}).error().code, ErrorCode::misuse);
  EXPECT_EQ(order.elements(schema, 3, blocks).error().code, ErrorCode::misuse);
}

TEST(RecordedOrder, NumbersMustBeThoseFromZeroOn) {
  const Schema schema = two_blocks();
  for (const Numbers& numbers : {Numbers{0, 2}, Numbers{1, 1}, Numbers{7}}) {
    RecordedOrder order;
    order.vertices = numbers;
    EXPECT_EQ(order.elements(schema, 0, {}).error().code, ErrorCode::misuse);
    Extra extra{"k", ScalarType::int32, Reference::vertex, {0}, {}};
    EXPECT_EQ(order.renumber(extra).error().code, ErrorCode::misuse);
    order.cells = numbers;
    const std::vector<std::uint32_t> blocks(numbers.size(), 1);
    for (const std::size_t array : {1u, 2u})
      EXPECT_EQ(order.elements(schema, array, blocks).error().code, ErrorCode::misuse);
  }
}

TEST(RecordedOrder, ReferencesAreBroughtToWhatReadersSee) {
  const RecordedOrder order = some_order();
  Extra vertices{"k", ScalarType::int64, Reference::vertex, {4}, {}};
  for (const std::int64_t v : {2, 3, -1, 4}) append(vertices.data, v);
  ASSERT_TRUE(order.renumber(vertices));
  std::vector<std::byte> expected;
  for (const std::int64_t v : {0, 2, -1, 4}) append(expected, v);  // numbers outside the mesh stay
  EXPECT_EQ(vertices.data, expected);
  Extra cells{"k", ScalarType::int32, Reference::cell, {2}, {}};
  for (const std::int32_t c : {3, 0}) append(cells.data, c);
  ASSERT_TRUE(order.renumber(cells));
  expected.clear();
  for (const std::int32_t c : {2, 1}) append(expected, c);
  EXPECT_EQ(cells.data, expected);
  cells.type = ScalarType::uint8;
  EXPECT_EQ(order.renumber(cells).error().code, ErrorCode::misuse);
  cells.refers = Reference::nothing;
  EXPECT_TRUE(order.renumber(cells));
}

}  // namespace
}  // namespace shm
