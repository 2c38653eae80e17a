// Tests of ShiftNeighbours, which finds neighbours by vertex and cell numbers. In the grids of this
// test, each number occurs in one row only. The neighbours must therefore equal those that the test
// finds by coordinates.
#include "codecs/shifts/shift_neighbours.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "mesh/hexahedron.h"

namespace shm {
namespace {

using Place = std::array<int, 3>;

constexpr std::array<std::uint32_t, 7> kSteps = {1, 2, 4, 3, 5, 6, 7};  // axes, as bits
constexpr std::uint32_t kRingBits = 12;
// Number of elements that the group is declared to have. It is large enough for a ring buffer of
// 2^kRingBits positions.
constexpr std::uint64_t kClaimed = 1024;

/// Returns the number of the vertex or cell at position `at` of the grid. The position may be up to
/// three steps outside the grid; its number then differs from the numbers of all elements.
std::uint64_t number_at(const Place& at) {
  return static_cast<std::uint64_t>((at[0] + 4) + 16 * (at[1] + 4) + 256 * (at[2] + 4));
}
Place moved(Place at, std::uint32_t axes, const std::array<int, 3>& by, int times = 1) {
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((axes >> a & 1) != 0) at[a] += times * by[a];
  return at;
}

/// The elements added so far, each with a flag. The flag is true if the whole lattice neighbourhood
/// of the element was known when the element was added.
class Met {
 public:
  bool has(const Place& at) const { return full_.contains(at); }
  bool is_full(const Place& at) const { return full_.at(at); }
  void add(const Place& at, bool full) { full_[at] = full; }

 private:
  std::map<Place, bool> full_;
};

/// Expected neighbourhood.
struct Expected {
  std::uint32_t known = 0;
  std::array<std::uint64_t, 13> at{};
  void take(std::uint32_t i, const Place& where) {
    known |= 1u << i;
    at[i] = number_at(where);
  }
};

void expect_item(const Neighbourhood& item, const Expected& expected, const Place& self) {
  EXPECT_EQ(item.self, number_at(self));
  EXPECT_EQ(item.known, expected.known);
  for (std::uint32_t i = 0; i < 13; ++i)
    if ((expected.known >> i & 1) != 0) {
      EXPECT_EQ(item.at[i], expected.at[i]) << "neighbour " << i;
    }
}

/// Processes each axis along which the nearest neighbour is known. Adds the second and third
/// neighbours along the axis to `expected`, if they exist. Sets the flag kThird for the axis if the
/// whole lattice neighbourhood of the nearest neighbour was known.
void go_on(Expected& expected, const Met& met, std::uint32_t axes, const Place& self,
           const std::array<int, 3>& direction) {
  for (std::uint32_t a = 0; a < axes; ++a) {
    if ((expected.known >> a & 1) == 0) continue;
    const Place near = moved(self, 1u << a, direction);
    if (met.is_full(near)) expected.known |= Neighbourhood::kThird << a;
    const Place beyond = moved(self, 1u << a, direction, 2),
                farther = moved(self, 1u << a, direction, 3);
    if (!met.has(beyond)) continue;
    expected.take(kAtBeyond + a, beyond);
    if (met.has(farther)) expected.take(kAtFarther + a, farther);
  }
}

bool is_full(const Expected& expected, std::uint32_t axes) {
  const std::uint32_t lattice =
      axes == 3 ? Neighbourhood::kLattice : 3 * Neighbourhood::kNear | Neighbourhood::kDiagonal;
  return (expected.known & lattice) == lattice;
}

/// Adds cells at given positions one after the other, and compares the neighbourhoods with the
/// expected ones.
class CheckedNeighbours {
 public:
  explicit CheckedNeighbours(std::uint32_t axes)
      : axes_(axes), neighbours_(schema_of(axes), true, true) {
    EXPECT_TRUE(neighbours_.begin_group(kRingBits, kClaimed));
  }

  void cell(const Place& low) {
    SCOPED_TRACE(testing::Message() << "cell " << low[0] << " " << low[1] << " " << low[2]);
    const std::uint32_t corners = 1u << axes_;
    std::vector<std::uint64_t> numbers;
    std::vector<Place> places;
    CellMarks marks;
    for (std::uint32_t p = 0; p < corners; ++p) {
      places.push_back(moved(low, kCornerBits[p], {1, 1, 1}));
      numbers.push_back(number_at(places.back()));
      if (!vertices_.has(places.back())) marks.introduced |= std::uint64_t{1} << p;
    }
    std::vector<Neighbourhood> vertices, cells;
    neighbours_.add_cells(marks, numbers, 1, vertices, cells);
    std::size_t next = 0;
    for (std::uint32_t p = 0; p < corners; ++p)
      if ((marks.introduced >> p & 1) != 0) {
        ASSERT_LT(next, vertices.size());
        vertex(vertices[next++], places[p], kCornerBits[p]);
      }
    EXPECT_EQ(next, vertices.size());
    ASSERT_EQ(cells.size(), 1u);
    whole(cells[0], low);
  }
  std::size_t full_vertices = 0, full_cells = 0;

 private:
  static const Schema& schema_of(std::uint32_t axes) {
    static const Schema hexahedra = with_block({1, "", CellShape::hexahedron, 8});
    static const Schema quads = with_block({1, "", CellShape::quad, 4});
    return axes == 3 ? hexahedra : quads;
  }
  static Schema with_block(BlockInfo block) {
    Schema schema;
    schema.blocks.push_back(std::move(block));
    return schema;
  }

  /// Checks a new vertex. Its neighbours are found along the edges of its cell.
  void vertex(const Neighbourhood& item, const Place& self, std::uint32_t bits) {
    std::array<int, 3> direction{};
    for (std::uint32_t a = 0; a < axes_; ++a) direction[a] = (bits >> a & 1) != 0 ? -1 : 1;
    Expected expected;
    for (std::uint32_t i = 0; i < kSteps.size(); ++i)
      if (kSteps[i] >> axes_ == 0 && vertices_.has(moved(self, kSteps[i], direction)))
        expected.take(i, moved(self, kSteps[i], direction));
    go_on(expected, vertices_, axes_, self, direction);
    expect_item(item, expected, self);
    EXPECT_EQ(item.kind, axes_ == 3 ? Neighbourhood::lattice : Neighbourhood::flat);
    EXPECT_EQ(item.corner, bits);
    vertices_.add(self, is_full(expected, axes_));
    full_vertices += is_full(expected, axes_) ? 1 : 0;
  }

  /// Checks a cell, which is identified by its last corner. Along each axis, the expected neighbour
  /// is the cell one step back or, if that cell does not exist, the cell one step forward.
  void whole(const Neighbourhood& item, const Place& low) {
    const Place self = moved(low, (1u << axes_) - 1, {1, 1, 1});
    std::array<int, 3> direction{-1, -1, -1};
    for (std::uint32_t a = 0; a < axes_; ++a)
      if (!cells_.has(moved(self, 1u << a, {-1, -1, -1}))) direction[a] = 1;
    Expected expected;
    for (std::uint32_t i = 0; i < kSteps.size(); ++i) {
      if (kSteps[i] >> axes_ != 0) continue;
      const Place there = moved(self, kSteps[i], i < axes_ ? direction : Place{-1, -1, -1});
      if (cells_.has(there)) expected.take(i, there);
    }
    go_on(expected, cells_, axes_, self, direction);
    expect_item(item, expected, self);
    cells_.add(self, is_full(expected, axes_));
    full_cells += is_full(expected, axes_) ? 1 : 0;
  }

  std::uint32_t axes_;
  ShiftNeighbours neighbours_;
  Met vertices_, cells_;
};

/// Visits the cells of a grid. Each axis runs upwards or downwards; axis `fastest` is the innermost
/// loop.
void for_grid(const Place& size, std::uint32_t downwards, std::uint32_t fastest,
              const std::function<void(const Place&)>& visit) {
  const std::uint32_t middle = (fastest + 1) % 3, slowest = (fastest + 2) % 3;
  const auto along = [&](std::uint32_t axis, int i) {
    return (downwards >> axis & 1) != 0 ? size[axis] - 1 - i : i;
  };
  for (int k = 0; k < size[slowest]; ++k)
    for (int j = 0; j < size[middle]; ++j)
      for (int i = 0; i < size[fastest]; ++i) {
        Place at{};
        at[fastest] = along(fastest, i);
        at[middle] = along(middle, j);
        at[slowest] = along(slowest, k);
        visit(at);
      }
}

TEST(ShiftNeighbours, OfHexahedraAreThoseInTheGrid) {
  for (std::uint32_t downwards = 0; downwards < 8; ++downwards)
    for (std::uint32_t fastest = 0; fastest < 3; ++fastest) {
      SCOPED_TRACE(testing::Message() << "downwards " << downwards << ", axis " << fastest);
      CheckedNeighbours checked(3);
      for_grid({5, 4, 4}, downwards, fastest, [&](const Place& at) { checked.cell(at); });
      EXPECT_GT(checked.full_vertices, 0u);
      if (downwards == 0) {
        EXPECT_EQ(checked.full_cells, 4u * 3 * 3);
      }
    }
}

TEST(ShiftNeighbours, OfQuadsAreThoseInTheGrid) {
  for (std::uint32_t downwards = 0; downwards < 4; ++downwards)
    for (std::uint32_t fastest = 0; fastest < 2; ++fastest) {
      SCOPED_TRACE(testing::Message() << "downwards " << downwards << ", axis " << fastest);
      CheckedNeighbours checked(2);
      for_grid({6, 5, 1}, downwards, fastest, [&](const Place& at) { checked.cell(at); });
      EXPECT_GT(checked.full_vertices, 0u);
    }
}

// The cells are added in random order. A neighbour must be found if it was added before.
TEST(ShiftNeighbours, OfScatteredCells) {
  std::vector<Place> cells;
  for_grid({4, 4, 4}, 0, 0, [&](const Place& at) { cells.push_back(at); });
  CheckedNeighbours checked(3);
  for (std::size_t i = 0; i < cells.size(); ++i) checked.cell(cells[i * 37 % cells.size()]);
}

TEST(ShiftNeighbours, RingsForgetWhatHasTheirPlace) {
  Schema schema;
  schema.blocks.push_back({1, "", CellShape::vertex, 1});
  ShiftNeighbours neighbours(schema, true, true);
  EXPECT_FALSE(
      neighbours.begin_group(12, 100));  // a ring of 2^12 positions is too large for 100 elements
  ASSERT_TRUE(neighbours.begin_group(3, 2));
  std::vector<Neighbourhood> vertices, cells;
  CellMarks marks;
  marks.introduced = 1;
  for (const std::uint64_t number : {5u, 6u, 13u, 5u})
    neighbours.add_cells(marks, std::array<std::uint64_t, 1>{number}, 1, vertices, cells);
  ASSERT_EQ(cells.size(), 4u);
  EXPECT_EQ(cells[0].known, 0u);
  for (const std::size_t i : {1u, 2u, 3u}) {  // the previous cell, which has that slot
    EXPECT_EQ(cells[i].known, Neighbourhood::kNear);
    EXPECT_EQ(cells[i].at[0], cells[i - 1].self);
  }
  EXPECT_EQ(cells[0].self, cells[2].self);
  EXPECT_EQ(vertices[3].self, 5u);
}

// The largest ring has at most four places for each element, and at most 2^18 places.
TEST(ShiftNeighbours, LargestRingIsInProportionToTheGroup) {
  Schema schema;
  schema.blocks.push_back({1, "", CellShape::vertex, 1});
  for (const auto& [elements, bits] : std::map<std::uint64_t, std::uint32_t>{
           {0, 2}, {1, 2}, {2, 3}, {3, 3}, {4, 4}, {1 << 15, 17}, {1 << 16, 18}, {1 << 30, 18}}) {
    EXPECT_EQ(most_ring_bits(elements), bits) << elements;
    ShiftNeighbours neighbours(schema, true, true);
    EXPECT_FALSE(neighbours.begin_group(bits + 1, elements));
    EXPECT_TRUE(neighbours.begin_group(bits, elements));
    EXPECT_EQ(neighbours.ring_bits(), bits);
  }
}

TEST(ShiftNeighbours, WithoutARingNoneAreFound) {
  Schema schema;
  schema.blocks.push_back({1, "", CellShape::vertex, 1});
  ShiftNeighbours neighbours(schema, true, true);
  ASSERT_TRUE(neighbours.begin_group(0, 100));
  EXPECT_EQ(neighbours.slots(), 0u);
  std::vector<Neighbourhood> vertices, cells;
  CellMarks marks;
  marks.introduced = 1;
  neighbours.add_cells(marks, std::array<std::uint64_t, 1>{5}, 1, vertices, cells);
  neighbours.add_unused(6, vertices);
  EXPECT_TRUE(vertices.empty());
  EXPECT_TRUE(cells.empty());
}

}  // namespace
}  // namespace shm
