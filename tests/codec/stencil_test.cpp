// Checks prediction stencils against Table 1 of the paper, and with functions that they must
// predict exactly.
#include "codecs/shared/stencil.h"

#include <gtest/gtest.h>

#include <numeric>
#include <random>

namespace shm {
namespace {

CellTopology hexahedron(std::size_t nodes = 8) {
  CellTopology cell;
  cell.hexahedral = true;
  cell.slots.resize(nodes);
  std::iota(cell.slots.begin(), cell.slots.end(), 100u);
  return cell;
}

std::array<double, 3> corner_point(std::uint32_t corner) {
  const std::uint32_t bits = kCornerBits[corner];
  return {static_cast<double>(bits & 1), static_cast<double>(bits >> 1 & 1),
          static_cast<double>(bits >> 2)};
}

double predict(const Stencil& s, const std::array<double, 8>& value) {
  const auto at = [&](std::size_t i) { return value[s.at[i] - 100]; };
  switch (s.kind) {
    case Stencil::last: return 0;
    case Stencil::copy: return at(0);
    case Stencil::parallelogram: return at(0) + at(1) - at(2);
    case Stencil::lorenzo: return at(0) + at(1) + at(2) - at(3) - at(4) - at(5) + at(6);
  }
  return 0;
}

TEST(Stencil, NothingIsKnown) {
  const auto cell = hexahedron();
  for (std::uint32_t i = 0; i < 8; ++i) EXPECT_EQ(stencil_of(cell, i, 0).kind, Stencil::last);
}

// Expects these predictions: v1 = v0, v2 = v1, v3 = v0 + v2 - v1, v4 = v0, v7 = v4 + v3 - v0, v5 =
// v1 + v4 - v0. v6 is predicted from all seven other corners.
TEST(Stencil, Table1OfThePaper) {
  const auto cell = hexahedron();
  const std::array<Stencil::Kind, 8> kinds = {
      Stencil::last, Stencil::copy,          Stencil::copy,          Stencil::parallelogram,
      Stencil::copy, Stencil::parallelogram, Stencil::parallelogram, Stencil::lorenzo};
  std::uint64_t known = 0;
  for (std::size_t n = 0; n < 8; ++n) {
    const std::uint8_t position = kCornerOrder[n];
    EXPECT_EQ(stencil_of(cell, position, known).kind, kinds[n]) << int{position};
    known |= std::uint64_t{1} << position;
  }
}

TEST(Stencil, UsesKnownCornersOnly) {
  const auto cell = hexahedron();
  for (std::uint64_t known = 0; known < 256; ++known)
    for (std::uint32_t i = 0; i < 8; ++i) {
      if ((known >> i & 1) != 0) continue;
      const Stencil s = stencil_of(cell, i, known);
      for (std::uint32_t n = 0; n < s.size(); ++n) EXPECT_TRUE(known >> (s.at[n] - 100) & 1);
    }
}

// A parallelogram stencil predicts linear functions on a parallelepiped exactly; the Lorenzo
// stencil also predicts products of two coordinates exactly.
TEST(Stencil, ExactOnSmoothFunctions) {
  const auto cell = hexahedron();
  const auto linear = [](const std::array<double, 3>& p) {
    return 3 + 5 * p[0] - 2 * p[1] + 7 * p[2];
  };
  const auto mixed = [&](const std::array<double, 3>& p) {
    return linear(p) + 11 * p[0] * p[1] - 4 * p[1] * p[2] + 6 * p[0] * p[2];
  };
  std::array<double, 8> values{}, more{};
  for (std::uint32_t i = 0; i < 8; ++i) {
    values[i] = linear(corner_point(i));
    more[i] = mixed(corner_point(i));
  }
  for (std::uint64_t known = 0; known < 256; ++known)
    for (std::uint32_t i = 0; i < 8; ++i) {
      if ((known >> i & 1) != 0) continue;
      const Stencil s = stencil_of(cell, i, known);
      if (s.kind == Stencil::parallelogram || s.kind == Stencil::lorenzo) {
        EXPECT_EQ(predict(s, values), values[i]);
      }
      if (s.kind == Stencil::lorenzo) {
        EXPECT_EQ(predict(s, more), more[i]);
      }
    }
}

TEST(Stencil, OtherCellsCopyTheNodeBefore) {
  CellTopology cell = hexahedron(70);
  cell.hexahedral = false;
  EXPECT_EQ(stencil_of(cell, 0, ~std::uint64_t{0}).kind, Stencil::last);
  const Stencil s = stencil_of(cell, 5, 1 << 4);
  EXPECT_EQ(s.kind, Stencil::copy);
  EXPECT_EQ(s.at[0], 104u);
  EXPECT_EQ(stencil_of(cell, 5, 0).kind, Stencil::last);
  EXPECT_EQ(stencil_of(cell, 64, ~std::uint64_t{0}).kind, Stencil::copy);
  EXPECT_EQ(stencil_of(cell, 69, ~std::uint64_t{0}).kind, Stencil::last);
}

TEST(Stencil, NewVerticesAreKnownOnlyOnceTheyAreCoded) {
  CellTopology cell = hexahedron();
  cell.slots[6] = cell.slots[4];  // occurs twice
  cell.new_positions = {4, 7, 5};
  std::vector<std::uint32_t> order;
  const auto visit = [&](std::uint32_t position, const Stencil& s, std::uint64_t known) {
    const std::uint32_t slot = cell.slots[position];
    EXPECT_EQ(known >> position & 1, 0u);
    for (std::uint32_t n = 0; n < s.size(); ++n) {
      const std::uint32_t used = s.at[n];
      const bool is_old = used <= 103;
      EXPECT_TRUE(is_old || std::find(order.begin(), order.end(), used) != order.end());
    }
    order.push_back(slot);
  };
  for_each_new_vertex(cell, cell.new_positions, visit);
  EXPECT_EQ(order, (std::vector<std::uint32_t>{104, 107, 105}));
}

}  // namespace
}  // namespace shm
