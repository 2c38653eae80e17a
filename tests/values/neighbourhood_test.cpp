// Tests of neighbourhoods: on grids, for which the expected neighbourhoods are known; for all
// rotations of hexahedra; and in random meshes, in which a neighbourhood must contain only vertices
// of the mesh.
#include "codecs/shared/neighbourhood.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "values/seen_neighbours.h"

namespace shm {
namespace {

using Point = std::array<std::int32_t, 3>;

Point plus(const Point& p, const Point& q, std::int32_t times) {
  return {p[0] + times * q[0], p[1] + times * q[1], p[2] + times * q[2]};
}

/// A cell as a list of vertex numbers. A coder may process the corners of a hexahedron in a
/// different order from the order in which the file stores them. `stored_corner` maps each corner
/// in the coder's order to a corner in stored order.
struct TestedCell {
  std::vector<std::uint64_t> vertices;
  bool hexahedral = true;
  std::array<std::uint8_t, 8> stored_corner{0, 1, 2, 3, 4, 5, 6, 7};
};

/// Passes cells to a NeighbourFinder and assigns slots to vertices as a coder does: the slot of a
/// finalized vertex is reused.
class Walk : public SeenNeighbours {
 public:
  explicit Walk(const std::vector<TestedCell>& mesh, bool as_stored = true,
                Reach reach = Reach::farther, bool reuses = true, bool bare = false)
      : as_stored_(as_stored), reach_(reach), reuses_(reuses), bare_(bare) {
    for (std::uint64_t c = 0; c < mesh.size(); ++c)
      for (std::uint64_t v : mesh[c].vertices) last_[v] = c;
    for (std::uint64_t c = 0; c < mesh.size(); ++c) take(mesh[c], c);
  }

 private:
  void take(const TestedCell& tested, std::uint64_t number) {
    CellTopology cell;
    cell.hexahedral = tested.hexahedral;
    cell.stored_corner = tested.stored_corner;
    const auto meet = [&](std::size_t i) {
      const std::uint64_t v = tested.vertices[i];
      if (slot_.contains(v)) return;
      std::uint32_t slot = next_slot_;
      if (free_.size() <= slot_.size()) {  // slots are not reused immediately
        ++next_slot_;
      } else {
        slot = free_.front();
        free_.pop_front();
      }
      slot_[v] = slot;
      cell.new_positions.push_back(static_cast<std::uint32_t>(i));
    };
    if (tested.hexahedral)
      for (std::uint8_t i : kCornerOrder) meet(i);
    for (std::size_t i = 0; i < tested.vertices.size(); ++i) meet(i);
    for (std::uint64_t v : tested.vertices) cell.slots.push_back(slot_[v]);
    if (tested.hexahedral)
      layout_ = node_layout(
          {0, {}, CellShape::hexahedron, static_cast<std::uint32_t>(tested.vertices.size())});
    cell.layout = tested.hexahedral ? layout_.get() : nullptr;
    for (std::uint8_t i = 0; i < 8; ++i) cell.framed[cell.stored_corner[i]] = i;
    if (!bare_) cell.last_use.assign(cell.slots.size(), 1);

    add(cell, number, tested.vertices, as_stored_, slot_.size(), reach_);
    for (std::uint64_t v : tested.vertices)
      if (last_[v] == number && slot_.contains(v)) {
        if (reuses_) free_.push_back(slot_[v]);
        slot_.erase(v);
      }
  }

  bool as_stored_;
  Reach reach_;
  bool reuses_;                               // slots
  bool bare_;                                 // true if only the slots are known
  std::shared_ptr<const NodeLayout> layout_;  // of the current cell
  std::map<std::uint64_t, std::uint64_t> last_;
  std::map<std::uint64_t, std::uint32_t> slot_;
  std::deque<std::uint32_t> free_;
  std::uint32_t next_slot_ = 0;
};

bool same(const Seen& a, const Seen& b) {
  return a.element == b.element && a.cell == b.cell && a.at == b.at &&
         a.around.known == b.around.known && a.around.corner == b.around.corner &&
         a.around.kind == b.around.kind && a.around.self == b.around.self;
}

/// A grid of size[0] x size[1] x size[2] cells. In the order of the cells, x varies fastest. The
/// corners of each cell may be rotated or mirrored at random.
enum class Turned { no, rotated, mirrored };
struct Grid {
  Point size;
  std::vector<TestedCell> cells;
  /// Positions of the corners of each cell. In `stored`, the corners are in stored order; in
  /// `frame`, they are in the order that the coder uses.
  std::vector<std::array<Point, 8>> stored, frame;

  Grid(const Point& n, Turned turned) : size(n) {
    std::mt19937 random(7);
    for (std::int32_t z = 0; z < n[2]; ++z)
      for (std::int32_t y = 0; y < n[1]; ++y)
        for (std::int32_t x = 0; x < n[0]; ++x) add({x, y, z}, turned, random);
  }
  std::uint64_t vertex(const Point& p) const {
    return static_cast<std::uint64_t>(p[0] + (size[0] + 1) * (p[1] + (size[1] + 1) * p[2]));
  }
  Point point(std::uint64_t vertex) const {
    const auto v = static_cast<std::int32_t>(vertex);
    return {v % (size[0] + 1), v / (size[0] + 1) % (size[1] + 1),
            v / ((size[0] + 1) * (size[1] + 1))};
  }
  Point cell_at(std::uint64_t number) const {
    const auto c = static_cast<std::int32_t>(number);
    return {c % size[0], c / size[0] % size[1], c / (size[0] * size[1])};
  }

 private:
  void add(const Point& at, Turned turned, std::mt19937& random) {
    const auto corner = [&](std::uint32_t bits) {
      return Point{at[0] + static_cast<std::int32_t>(bits & 1),
                   at[1] + static_cast<std::int32_t>(bits >> 1 & 1),
                   at[2] + static_cast<std::int32_t>(bits >> 2)};
    };
    // box_of_stored maps each corner in stored order to a corner of the grid cell at (x, y, z).
    // box_of_frame does the same for each corner in the coder's order.
    std::array<std::uint8_t, 8> box_of_stored{}, box_of_frame{};
    const auto& rotation = kRotations[turned == Turned::no ? 0 : random() % kRotationCount];
    const auto& other = kRotations[turned == Turned::no ? 0 : random() % kRotationCount];
    for (std::uint32_t i = 0; i < 8; ++i) {
      box_of_stored[i] = rotation[i];
      box_of_frame[i] = other[i];
    }
    if (turned == Turned::mirrored && random() % 2 == 0)
      for (std::uint32_t i = 0; i < 4; ++i) std::swap(box_of_stored[i], box_of_stored[i + 4]);
    TestedCell cell;
    std::array<Point, 8> by_stored{}, by_frame{};
    for (std::uint32_t i = 0; i < 8; ++i) {
      const Point p = corner(kCornerBits[box_of_frame[i]]);
      const auto place = static_cast<std::uint8_t>(
          std::find(box_of_stored.begin(), box_of_stored.end(), box_of_frame[i]) -
          box_of_stored.begin());
      cell.vertices.push_back(vertex(p));
      cell.stored_corner[i] = place;
      by_stored[kCornerBits[place]] = p;
      by_frame[kCornerBits[i]] = p;
    }
    cells.push_back(std::move(cell));
    stored.push_back(by_stored);
    frame.push_back(by_frame);
  }
};

/// Checks that each known neighbour of a vertex is at the expected position. Returns the number of
/// known neighbours.
std::size_t expect_vertices(const Grid& grid, const Walk& walk, bool as_stored) {
  std::size_t known = 0;
  for (const Seen& seen : walk.vertices) {
    const auto& corners = as_stored ? grid.stored[seen.cell] : grid.frame[seen.cell];
    const Point self = grid.point(seen.element);
    const std::uint32_t bits = seen.around.corner;
    EXPECT_EQ(seen.around.kind, Neighbourhood::lattice);
    EXPECT_EQ(corners[bits], self);
    std::array<Point, 3> step{};
    for (std::uint32_t a = 0; a < 3; ++a) step[a] = plus(corners[bits ^ 1u << a], self, -1);
    const auto expect = [&](std::uint32_t at, const Point& where) {
      if (!seen.around.knows(1u << at)) return;
      ++known;
      EXPECT_EQ(grid.point(seen.at[at]), where) << at;
    };
    const auto diagonal = [&](std::uint32_t a, std::uint32_t b) {
      return plus(plus(self, step[a], 1), step[b], 1);
    };
    for (std::uint32_t a = 0; a < 3; ++a) {
      expect(a, plus(self, step[a], 1));
      expect(kAtBeyond + a, plus(self, step[a], 2));
      expect(kAtFarther + a, plus(self, step[a], 3));
    }
    expect(kAtDiagonal, diagonal(0, 1));
    expect(kAtDiagonal + 1, diagonal(0, 2));
    expect(kAtDiagonal + 2, diagonal(1, 2));
    expect(kAtOpposite, plus(diagonal(0, 1), step[2], 1));
  }
  return known;
}

TEST(Neighbourhood, OfVerticesOfAGrid) {
  const Grid grid({3, 3, 3}, Turned::no);
  const Walk walk(grid.cells, true, Reach::farther, false);
  expect_vertices(grid, walk, true);
  for (const Seen& seen : walk.vertices) {
    const Point p = grid.point(seen.element);
    if (p[0] < 1 || p[1] < 1 || p[2] < 1) continue;
    // A cell in the interior of the grid introduces a single vertex. The neighbourhood of this
    // vertex contains all other corners of the cell.
    std::uint32_t wanted = 0;
    const bool lattice = p[0] >= 2 && p[1] >= 2 && p[2] >= 2;
    if (lattice) wanted |= Neighbourhood::kLattice;
    for (std::uint32_t a = 0; lattice && a < 3; ++a) {
      wanted |= Neighbourhood::kBeyond << a;
      if (p[a] >= 3) wanted |= Neighbourhood::kFarther << a | Neighbourhood::kThird << a;
    }
    EXPECT_EQ(seen.around.known & wanted, wanted) << p[0] << p[1] << p[2];
    for (std::uint32_t a = 0; a < 3; ++a) {
      if (p[a] < 3) {
        EXPECT_FALSE(seen.around.knows(Neighbourhood::kFarther << a)) << p[0] << p[1] << p[2];
      }
    }
  }
  // The first vertex has no known neighbours. For the last vertex, all neighbours are known.
  EXPECT_EQ(walk.vertices.front().around.known, 0);
  EXPECT_EQ(walk.vertices.back().around.known, 0xffff);
  const Point last = grid.point(walk.vertices.back().element);
  EXPECT_EQ(last, (Point{3, 3, 3}));
  EXPECT_EQ(walk.vertices.size(), 64u);
}

TEST(Neighbourhood, FollowsTheCornersAsTheyStand) {
  const std::size_t straight =
      expect_vertices(Grid({5, 4, 4}, Turned::no), Walk(Grid({5, 4, 4}, Turned::no).cells), true);
  for (Turned turned : {Turned::rotated, Turned::mirrored}) {
    const Grid grid({5, 4, 4}, turned);
    // If cells are rotated, their corners are introduced in another order. The number of known
    // neighbours therefore differs.
    EXPECT_GT(expect_vertices(grid, Walk(grid.cells, true), true), straight / 2);
    EXPECT_GT(expect_vertices(grid, Walk(grid.cells, false), false), straight / 2);
  }
}

TEST(Neighbourhood, OfTheCellsOfAGrid) {
  const Grid grid({5, 4, 4},
                  Turned::no);  // more cells than the initial size of the ring
  const Walk walk(grid.cells);
  ASSERT_EQ(walk.cells.size(), 80u);
  for (const Seen& seen : walk.cells) {
    const Point p = grid.cell_at(seen.cell);
    ASSERT_EQ(seen.element, seen.cell);
    const auto has = [&](std::int32_t x, std::int32_t y, std::int32_t z) {
      return p[0] >= x && p[1] >= y && p[2] >= z;
    };
    const auto expect = [&](std::uint32_t at, std::int32_t x, std::int32_t y, std::int32_t z) {
      ASSERT_EQ(seen.around.knows(1u << at), has(x, y, z)) << at << ' ' << seen.cell;
      if (has(x, y, z)) {
        EXPECT_EQ(grid.cell_at(seen.at[at]), (Point{p[0] - x, p[1] - y, p[2] - z}));
      }
    };
    for (std::int32_t d = 1; d <= 3; ++d) {
      const std::uint32_t at = d == 1 ? 0 : d == 2 ? kAtBeyond : kAtFarther;
      expect(at, d, 0, 0);
      expect(at + 1, 0, d, 0);
      expect(at + 2, 0, 0, d);
    }
    expect(kAtDiagonal, 1, 1, 0);
    expect(kAtDiagonal + 1, 1, 0, 1);
    expect(kAtDiagonal + 2, 0, 1, 1);
    expect(kAtOpposite, 1, 1, 1);
    EXPECT_EQ(seen.around.knows(Neighbourhood::kThird), has(2, 1, 1));
    EXPECT_EQ(seen.around.knows(Neighbourhood::kThird << 1), has(1, 2, 1));
    EXPECT_EQ(seen.around.knows(Neighbourhood::kThird << 2), has(1, 1, 2));
  }
}

TEST(Neighbourhood, OfTurnedCells) {
  for (Turned turned : {Turned::rotated, Turned::mirrored}) {
    const Grid grid({6, 4, 5}, turned);
    const Walk walk(grid.cells);
    for (const Seen& seen : walk.cells) {
      const Point self = grid.cell_at(seen.cell);
      std::uint32_t near = 0;
      for (std::uint32_t a = 0; a < 3; ++a) {
        if (!seen.around.knows(1u << a)) continue;
        ++near;
        const Point other = grid.cell_at(seen.at[a]);
        const Point step = plus(other, self, -1);
        EXPECT_EQ(std::abs(step[0]) + std::abs(step[1]) + std::abs(step[2]), 1);
        // along the stored axis a
        const auto& corners = grid.stored[seen.cell];
        const Point axis = plus(corners[1u << a], corners[0], -1);
        EXPECT_EQ(std::abs(axis[0] * step[0] + axis[1] * step[1] + axis[2] * step[2]), 1);
        if (seen.around.knows(Neighbourhood::kBeyond << a)) {
          EXPECT_EQ(grid.cell_at(seen.at[kAtBeyond + a]), plus(self, step, 2));
        }
        if (seen.around.knows(Neighbourhood::kFarther << a)) {
          EXPECT_EQ(grid.cell_at(seen.at[kAtFarther + a]), plus(self, step, 3));
        }
      }
      EXPECT_EQ(near, static_cast<std::uint32_t>((self[0] > 0) + (self[1] > 0) + (self[2] > 0)));
    }
  }
}

TEST(Neighbourhood, SlotsAndPlacesAreTakenAgain) {
  // The bar has more cells than the ring has positions. Vertices are finalized when their layer is
  // complete, and their slots are reused.
  const Grid grid({2, 2, 5000}, Turned::no);
  const Walk walk(grid.cells);
  const std::size_t known = expect_vertices(grid, walk, true);
  EXPECT_GT(known, walk.vertices.size() * 4);
  const Seen &last = walk.vertices.back(), &cell = walk.cells.back();
  EXPECT_LT(last.around.self, 100u);
  EXPECT_TRUE(last.around.knows(Neighbourhood::kLattice | Neighbourhood::kBeyond << 1));
  EXPECT_TRUE(last.around.knows(Neighbourhood::kThird << 2 | Neighbourhood::kBeyond << 2));
  for (const Seen& seen : walk.cells) {
    const Point p = grid.cell_at(seen.cell);
    ASSERT_LT(seen.around.self, 1u << 14);
    for (std::uint32_t a = 0; a < 3; ++a) {
      Point step{};
      step[a] = -1;
      ASSERT_EQ(seen.around.knows(1u << a), p[a] > 0) << seen.cell;
      if (p[a] > 0) {
        ASSERT_EQ(grid.cell_at(seen.at[a]), plus(p, step, 1));
      }
      ASSERT_EQ(seen.around.knows(Neighbourhood::kFarther << a), p[a] > 2) << seen.cell;
      if (p[a] > 2) {
        ASSERT_EQ(grid.cell_at(seen.at[kAtFarther + a]), plus(p, step, 3));
      }
    }
  }
  EXPECT_EQ(cell.at[2], cell.cell - 4);
}

TEST(Neighbourhood, ReachOnlyAdds) {
  const Grid grid({5, 4, 4}, Turned::mirrored);
  const Walk far(grid.cells), middle(grid.cells, true, Reach::beyond),
      near(grid.cells, true, Reach::lattice);
  const auto expect = [](const std::vector<Seen>& all, const std::vector<Seen>& some,
                         std::uint32_t left_out) {
    ASSERT_EQ(all.size(), some.size());
    for (std::size_t i = 0; i < all.size(); ++i) {
      EXPECT_EQ(some[i].around.known, all[i].around.known & ~left_out);
      for (std::uint32_t at = 0; at < 13; ++at)
        if (some[i].around.knows(1u << at)) {
          EXPECT_EQ(some[i].at[at], all[i].at[at]);
        }
    }
  };
  constexpr std::uint32_t kFar = 7 * Neighbourhood::kFarther, kBeyond = 7 * Neighbourhood::kBeyond;
  expect(far.vertices, middle.vertices, kFar);
  expect(far.vertices, near.vertices, kFar | kBeyond);
  expect(far.cells, middle.cells, kFar);
  expect(far.cells, near.cells, kFar | kBeyond);
}

// The cell has 27 nodes. Within a cell, parallel edges are processed in the order of the positions
// of their nodes.
TEST(Neighbourhood, OfInnerNodes) {
  TestedCell cell;
  for (std::uint64_t v = 0; v < 27; ++v) cell.vertices.push_back(100 + v);
  cell.stored_corner = kRotations[5];
  const Walk walk({cell});
  ASSERT_EQ(walk.vertices.size(), 27u);
  // Returns the vertex at a position in stored order. Positions below 8 are corners; the others are
  // inner nodes.
  const auto stored = [&](std::uint32_t position) {
    const auto& corners = cell.stored_corner;
    return 100u + (position < 8
                       ? static_cast<std::uint64_t>(
                             std::find(corners.begin(), corners.end(), position) - corners.begin())
                       : position);
  };
  constexpr std::uint32_t kThird = Neighbourhood::kThird | Neighbourhood::kNear;
  for (const Seen& seen : walk.vertices) {
    const std::uint64_t position = seen.element - 100;
    const Neighbourhood& around = seen.around;
    if (position < 8) {
      EXPECT_EQ(around.kind, Neighbourhood::lattice);
      EXPECT_FALSE(around.is_mid_node());
    } else if (position < 20) {
      EXPECT_EQ(around.kind, Neighbourhood::midpoint);
      const auto [one, two] = kEdgeCorners[position - 8];
      EXPECT_EQ(seen.at[kAtDiagonal], stored(one));
      EXPECT_EQ(seen.at[kAtDiagonal + 1], stored(two));
      EXPECT_EQ(around.known & ~(7 * kThird), 3 * Neighbourhood::kDiagonal);
      for (std::uint32_t i = 0; i < 3; ++i) {
        EXPECT_EQ(around.knows(Neighbourhood::kNear << i), around.knows(kThird << i));
        if (around.knows(Neighbourhood::kNear << i)) {
          EXPECT_LT(seen.at[i], seen.element);
        }
      }
    } else {
      EXPECT_EQ(around.kind, Neighbourhood::centre);
      EXPECT_EQ(around.corner, position == 26 ? 1 : 0);
      const bool across = position < 26 && position % 2 == 1;  // the opposite face comes before
      EXPECT_EQ(around.known, 0xffu << kAtDiagonal | (across ? kThird : 0));
      if (across) {
        EXPECT_EQ(seen.at[0], seen.element - 1);
      }
      const auto layout = node_layout({0, {}, CellShape::hexahedron, 27});
      const MidNode* node = layout->at(position);
      for (std::uint32_t i = 0; i < 4; ++i) {
        EXPECT_EQ(seen.at[kAtDiagonal + i], stored(node->middle[i]));
        EXPECT_EQ(seen.at[kAtBeyond + i], stored(node->corner[i]));
      }
    }
  }
}

TEST(Neighbourhood, OfOtherCells) {
  TestedCell first, second, third;
  first.hexahedral = second.hexahedral = third.hexahedral = false;
  first.vertices = {1, 2, 3, 4};
  second.vertices = {4, 5, 5, 6, 7};
  third.vertices.resize(70);  // too many for masks of 64 bits
  for (std::size_t i = 0; i < 70; ++i) third.vertices[i] = 10 + i;
  const Walk walk({first, second, third});
  ASSERT_EQ(walk.vertices.size(), 4u + 3u + 70u);
  EXPECT_EQ(walk.vertices[0].around.known, 0);
  for (std::size_t i = 1; i < 4; ++i) EXPECT_EQ(walk.vertices[i].at[0], i);
  EXPECT_EQ(walk.vertices[4].at[0], 4u);  // follows a vertex that is already known
  EXPECT_EQ(walk.vertices[5].at[0], 5u);  // follows the second 5
  EXPECT_EQ(walk.vertices[6].at[0], 6u);
  for (std::size_t i = 1; i < 70; ++i) {
    const Seen& seen = walk.vertices[7 + i];
    EXPECT_EQ(seen.around.kind, Neighbourhood::other);
    EXPECT_EQ(seen.around.known, i <= 64 ? Neighbourhood::kNear : 0u) << i;
    if (i <= 64) {
      EXPECT_EQ(seen.at[0], 9 + i);
    }
  }
  for (const Seen& seen : walk.cells) {
    EXPECT_EQ(seen.around.kind, Neighbourhood::other);
    EXPECT_EQ(seen.around.known, 0);
  }
}

TEST(Neighbourhood, OfUnusedVertices) {
  NeighbourFinder finder(false);
  for (std::uint32_t slot : {0u, 7u, 100000u, 7u}) {
    const Neighbourhood item = finder.unused_vertex(slot);
    EXPECT_EQ(item.self, slot);
    EXPECT_EQ(item.known, 0);
    EXPECT_EQ(item.kind, Neighbourhood::other);
  }
}

TEST(Neighbourhood, ARepeatedCornerIsNotItsOwnNeighbour) {
  TestedCell wedge, needle;
  wedge.vertices = {0, 1, 2, 2, 4, 5, 6, 6};
  needle.vertices = {8, 8, 8, 8, 8, 8, 8, 8};
  const Walk walk({wedge, needle});
  ASSERT_EQ(walk.vertices.size(), 7u);
  for (const Seen& seen : walk.vertices)
    for (std::uint32_t at = 0; at < 13; ++at)
      if (seen.around.knows(1u << at)) {
        EXPECT_NE(seen.at[at], seen.element);
      }
  const Seen& last = walk.vertices[5];  // vertex 6 is introduced earlier, at position 7
  EXPECT_EQ(last.element, 5u);
  // Vertex 6 is at two corners of the cell. When vertex 5 is introduced, vertex 6 is already known
  // at both of them.
  EXPECT_TRUE(last.around.knows(Neighbourhood::kLattice));
  EXPECT_EQ(walk.vertices[6].around.known, 0);
}

// The cells have random vertices. Some cells are degenerate, and some are not hexahedra.
TEST(Neighbourhood, NamesOnlyWhatIsThere) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 20; ++round) {
    std::vector<TestedCell> cells;
    const std::uint64_t window = 4 + random() % 40;
    for (std::uint64_t c = 0; c < 600; ++c) {
      TestedCell cell;
      cell.hexahedral = random() % 8 != 0;
      const std::size_t nodes = cell.hexahedral
                                    ? (random() % 10 == 0 ? (random() % 2 == 0 ? 20 : 27) : 8)
                                    : 1 + random() % 9;
      for (std::size_t i = 0; i < nodes; ++i)
        cell.vertices.push_back(c / 2 + random() % window);  // older vertices are finalized
      cell.stored_corner = kRotations[random() % kRotationCount];
      cells.push_back(std::move(cell));
    }
    const Walk walk(cells);
    const Walk again(cells, true, Reach::farther, true, true);
    // Pairs of vertices that are the ends of an edge of a hexahedron that was already added.
    std::set<std::pair<std::uint64_t, std::uint64_t>> edges;
    std::uint64_t joined = 0;
    const auto join = [&](std::uint64_t cell) {
      for (; joined <= cell; ++joined) {
        if (!cells[joined].hexahedral) continue;
        for (const auto& [a, b] : kEdgeCorners) {
          edges.insert({cells[joined].vertices[a], cells[joined].vertices[b]});
          edges.insert({cells[joined].vertices[b], cells[joined].vertices[a]});
        }
      }
    };
    std::set<std::uint64_t> born;
    for (std::size_t i = 0; i < walk.vertices.size(); ++i) {
      const Seen& seen = walk.vertices[i];
      ASSERT_TRUE(same(seen, again.vertices[i]));
      join(seen.cell);
      for (std::uint32_t at = 0; at < 13; ++at)
        if (seen.around.knows(1u << at)) {
          ASSERT_TRUE(born.contains(seen.at[at])) << at;
        }
      for (std::uint32_t a = 0; a < 3 && !seen.around.is_mid_node(); ++a) {
        if (seen.around.knows(Neighbourhood::kBeyond << a)) {
          ASSERT_TRUE(seen.around.knows(Neighbourhood::kNear << a));
          ASSERT_TRUE(edges.contains({seen.at[a], seen.at[kAtBeyond + a]}));
        }
        if (seen.around.knows(Neighbourhood::kFarther << a)) {
          ASSERT_TRUE(edges.contains({seen.at[kAtBeyond + a], seen.at[kAtFarther + a]}));
        }
      }
      born.insert(seen.element);
    }
    for (std::size_t i = 0; i < walk.cells.size(); ++i) {
      const Seen& seen = walk.cells[i];
      ASSERT_TRUE(same(seen, again.cells[i]));
      for (std::uint32_t at = 0; at < 13; ++at)
        if (seen.around.knows(1u << at)) {
          ASSERT_LT(seen.at[at], seen.cell);
        }
    }
  }
}

}  // namespace
}  // namespace shm
