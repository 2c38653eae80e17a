#include "pipeline/spiral_reorderer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "mesh/hexahedron.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

SpiralReorderer::Corners corners_of(const TestCell& cell) {
  SpiralReorderer::Corners corners{};
  std::copy_n(cell.corners.begin(), 8, corners.begin());
  return corners;
}

/// Returns the order in which the cells of `mesh` leave a reordering buffer of `delay` cells.
std::vector<std::uint32_t> order_of(const TestMesh& mesh, std::size_t delay) {
  SpiralReorderer reorderer;
  std::vector<std::uint32_t> order;
  for (std::uint32_t c = 0; c < mesh.cells.size(); ++c) {
    reorderer.push_hexahedron(c, corners_of(mesh.cells[c]));
    if (reorderer.waiting() > delay) order.push_back(reorderer.pop());
  }
  while (reorderer.waiting() > 0) order.push_back(reorderer.pop());
  return order;
}

bool is_permutation_of_all(std::vector<std::uint32_t> order) {
  std::sort(order.begin(), order.end());
  for (std::uint32_t i = 0; i < order.size(); ++i)
    if (order[i] != i) return false;
  return true;
}

bool share_a_face(const TestCell& a, const TestCell& b) {
  return std::count_if(a.corners.begin(), a.corners.end(), [&](std::uint64_t v) {
           return std::find(b.corners.begin(), b.corners.end(), v) != b.corners.end();
         }) == 4;
}

std::size_t neighbours_in_sequence(const TestMesh& mesh, const std::vector<std::uint32_t>& order) {
  std::size_t count = 0;
  for (std::size_t i = 1; i < order.size(); ++i)
    count += share_a_face(mesh.cells[order[i - 1]], mesh.cells[order[i]]);
  return count;
}

TEST(SpiralReorderer, WithoutABufferNothingMoves) {
  const auto order = order_of(grid(5, 4, 3), 0);
  for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
}

TEST(SpiralReorderer, EveryCellLeavesOnce) {
  std::mt19937_64 random(1);
  for (std::size_t delay : {1u, 7u, 100u, 10000u})
    for (int kind = 0; kind < 4; ++kind) {
      TestMesh mesh =
          kind == 3 ? ring(2, 3, 4, ScalarType::float32)
                    : grid(6, 7, 8, ScalarType::float32, straight, kind == 1 ? porous : nullptr);
      if (kind == 2) shuffle_cells(mesh, random);
      rotate_corners(mesh, random, true);
      const auto order = order_of(mesh, delay);
      EXPECT_EQ(order.size(), mesh.cells.size());
      EXPECT_TRUE(is_permutation_of_all(order));
    }
}

// A cell cannot leave the buffer before it is added. It therefore comes at most `delay` positions
// earlier than in the input.
TEST(SpiralReorderer, NoCellIsEarlierThanTheBufferAllows) {
  std::mt19937_64 random(2);
  TestMesh mesh = grid(8, 8, 8);
  shuffle_cells(mesh, random);
  for (std::uint32_t delay : {3u, 50u}) {
    const auto order = order_of(mesh, delay);
    for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_LE(order[i], i + delay);
  }
}

TEST(SpiralReorderer, FollowsNeighbours) {
  std::mt19937_64 random(3);
  TestMesh mesh = grid(10, 10, 10);
  const auto straight_order = order_of(mesh, 0);
  EXPECT_GT(neighbours_in_sequence(mesh, order_of(mesh, 100)),
            neighbours_in_sequence(mesh, straight_order));
  shuffle_cells(mesh, random);
  // If the buffer is large enough for all cells, nearly every cell touches the cell before it.
  EXPECT_GT(neighbours_in_sequence(mesh, order_of(mesh, 1000)), 900u);
}

TEST(SpiralReorderer, OtherCellsLeaveByAge) {
  SpiralReorderer reorderer;
  for (std::uint32_t h = 10; h < 20; ++h) reorderer.push_other(h);
  for (std::uint32_t h = 10; h < 20; ++h) EXPECT_EQ(reorderer.pop(), h);
  EXPECT_EQ(reorderer.waiting(), 0u);
}

TEST(SpiralReorderer, DegenerateAndRepeatedCells) {
  SpiralReorderer reorderer;
  const SpiralReorderer::Corners point{}, line = {1, 2, 1, 2, 1, 2, 1, 2};
  const SpiralReorderer::Corners cube = {0, 1, 2, 3, 4, 5, 6, 7};
  std::uint32_t handle = 0;
  for (int n = 0; n < 5; ++n)
    for (const auto& corners : {point, line, cube}) reorderer.push_hexahedron(handle++, corners);
  std::set<std::uint32_t> seen;
  while (reorderer.waiting() > 0) EXPECT_TRUE(seen.insert(reorderer.pop()).second);
  EXPECT_EQ(seen.size(), handle);
}

TEST(SpiralReorderer, HandlesAreReused) {
  SpiralReorderer reorderer;
  const TestMesh mesh = grid(50, 2, 1);
  std::vector<std::uint32_t> free = {0, 1, 2, 3};
  std::size_t left = 0;
  for (const TestCell& cell : mesh.cells) {
    const std::uint32_t handle = free.back();
    free.pop_back();
    reorderer.push_hexahedron(handle, corners_of(cell));
    if (free.empty()) {
      free.push_back(reorderer.pop());
      ++left;
    }
  }
  EXPECT_EQ(left + reorderer.waiting(), mesh.cells.size());
}

}  // namespace
}  // namespace shm
