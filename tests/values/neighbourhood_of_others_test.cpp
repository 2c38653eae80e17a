// Tests of the neighbourhoods of cells that are not hexahedra. On lattices, the expected
// neighbourhoods are known. In random meshes, a neighbourhood must contain only vertices of the
// mesh.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "codecs/shared/cell_frames.h"
#include "codecs/shared/neighbourhood.h"
#include "mesh/cell_shapes.h"
#include "mesh/open_faces.h"
#include "values/seen_neighbours.h"

namespace shm {
namespace {

using Point = std::array<std::int32_t, 3>;

struct TestedCell {
  CellShape shape = CellShape::hexahedron;
  std::vector<std::uint64_t> vertices;
};

/// Passes cells to a NeighbourFinder as a coder does: each vertex is finalized with the last cell
/// that uses it, and its slot is reused later.
class Walk : public SeenNeighbours {
 public:
  explicit Walk(const std::vector<TestedCell>& mesh, Reach reach = Reach::farther) : reach_(reach) {
    for (std::uint64_t c = 0; c < mesh.size(); ++c)
      for (std::uint64_t v : mesh[c].vertices) last_[v] = c;
    for (std::uint64_t c = 0; c < mesh.size(); ++c) take(mesh[c], c);
  }

 private:
  void take(const TestedCell& tested, std::uint64_t number) {
    CellTopology cell;
    cell.hexahedral = tested.shape == CellShape::hexahedron;
    for (std::uint32_t i = 0; i < tested.vertices.size(); ++i)
      if (!slot_.contains(tested.vertices[i])) {
        slot_[tested.vertices[i]] = new_slot();
        cell.new_positions.push_back(i);
      }
    for (std::uint64_t v : tested.vertices) cell.slots.push_back(slot_[v]);
    cell.shape = tested.shape;
    cell.corners = corner_count(tested.shape, cell.slots.size());
    if (cell.corners > 0)
      faces_.add_cell(sides_of(tested.shape, cell.corners),
                      std::span(cell.slots).first(cell.corners));
    else
      faces_.skip_cell();
    cell.behind = faces_.behind();

    add(cell, number, tested.vertices, true, slot_.size(), reach_);
    for (std::uint64_t v : tested.vertices)
      if (last_[v] == number && slot_.contains(v)) {
        faces_.forget(slot_[v]);
        free_.push_back(slot_[v]);
        slot_.erase(v);
      }
  }

  std::uint32_t new_slot() {
    if (free_.size() <= slot_.size() + 100) return next_slot_++;
    const std::uint32_t slot = free_.front();
    free_.pop_front();
    return slot;
  }

  Reach reach_;
  OpenFaces faces_;
  std::map<std::uint64_t, std::uint64_t> last_;
  std::map<std::uint64_t, std::uint32_t> slot_;
  std::deque<std::uint32_t> free_;
  std::uint32_t next_slot_ = 0;
};

using Parts = std::vector<std::vector<std::size_t>>;
constexpr std::uint64_t kSide = 6;  // number of vertices along each edge of the lattice

Point place(std::uint64_t vertex) {
  return {static_cast<std::int32_t>(vertex % kSide),
          static_cast<std::int32_t>(vertex / kSide % kSide),
          static_cast<std::int32_t>(vertex / kSide / kSide)};
}
Point sum(std::initializer_list<std::pair<std::int32_t, std::uint64_t>> terms) {
  Point p{};
  for (const auto& [times, vertex] : terms)
    for (std::size_t c = 0; c < 3; ++c) p[c] += times * place(vertex)[c];
  return p;
}

/// Returns the cells of a lattice in which each cube is divided in the same way. `parts` contains
/// the corners of each cell of a cube, in VTK's order. `layers` is the number of layers of cubes.
std::vector<TestedCell> cut_lattice(CellShape shape, const Parts& parts,
                                    std::uint64_t layers = kSide - 1) {
  std::vector<TestedCell> cells;
  for (std::uint64_t k = 0; k < layers; ++k)
    for (std::uint64_t j = 0; j + 1 < kSide; ++j)
      for (std::uint64_t i = 0; i + 1 < kSide; ++i) {
        std::array<std::uint64_t, 8> corner{};
        for (std::uint64_t c = 0; c < 8; ++c) {
          const std::uint64_t bits = kCornerBits[c];
          corner[c] = i + (bits & 1) + kSide * (j + (bits >> 1 & 1) + kSide * (k + (bits >> 2)));
        }
        for (const auto& part : parts) {
          cells.push_back({shape, {}});
          for (std::size_t at : part) cells.back().vertices.push_back(corner[at]);
        }
      }
  return cells;
}
const Parts kWedges = {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}};
const Parts kTetrahedra = {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6},
                           {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}};

TEST(NeighbourhoodOfOthers, WedgesStandInALattice) {
  const Walk walk(cut_lattice(CellShape::wedge, kWedges));
  ASSERT_EQ(walk.vertices.size(), kSide * kSide * kSide);
  std::size_t lattices = 0, lines = 0, farther = 0;
  for (const Seen& seen : walk.vertices) {
    EXPECT_EQ(seen.around.kind, Neighbourhood::layered);
    const Point self = place(seen.element);
    if (seen.knows(Neighbourhood::kLattice)) {
      ++lattices;
      EXPECT_EQ(sum({{1, seen.at[0]},
                     {1, seen.at[1]},
                     {1, seen.at[2]},
                     {-1, seen.at[3]},
                     {-1, seen.at[4]},
                     {-1, seen.at[5]},
                     {1, seen.at[6]}}),
                self);
    }
    if (seen.knows(3 * Neighbourhood::kNear | Neighbourhood::kDiagonal)) {
      EXPECT_EQ(sum({{1, seen.at[0]}, {1, seen.at[1]}, {-1, seen.at[3]}}), self);
    }
    if (seen.knows(1 << kAtBeyond)) {
      ++lines;
      EXPECT_EQ(sum({{2, seen.at[0]}, {-1, seen.at[kAtBeyond]}}), self);
    }
    if (seen.knows(1 << kAtFarther)) {
      ++farther;
      EXPECT_EQ(sum({{3, seen.at[0]}, {-1, seen.at[kAtFarther]}}), sum({{2, seen.element}}));
    }
  }
  // From the third layer of vertices on, the two vertices below each vertex are known. From the
  // fourth layer on, the three vertices below it are known.
  EXPECT_EQ(lines, kSide * kSide * (kSide - 2));
  EXPECT_EQ(farther, kSide * kSide * (kSide - 3));
  EXPECT_GT(lattices, (kSide - 1) * (kSide - 1) * (kSide - 2));
}

TEST(NeighbourhoodOfOthers, TetrahedraSeeBehindTheirFace) {
  const auto mesh = cut_lattice(CellShape::tetrahedron, kTetrahedra);
  const Walk walk(mesh);
  std::set<std::vector<std::uint64_t>> cells;  // added so far
  std::uint64_t added = 0;
  std::size_t behind = 0;
  for (const Seen& seen : walk.vertices) {
    for (; added < seen.cell; ++added) {
      auto corners = mesh[added].vertices;
      std::sort(corners.begin(), corners.end());
      cells.insert(corners);
    }
    EXPECT_EQ(seen.around.kind, Neighbourhood::simplex);
    if (!seen.knows(1 << kAtOpposite)) continue;
    ++behind;
    ASSERT_TRUE(seen.knows(7 * Neighbourhood::kNear | 7 * Neighbourhood::kDiagonal));
    std::vector<std::uint64_t> other{seen.at[0], seen.at[1], seen.at[2], seen.at[kAtOpposite]};
    std::sort(other.begin(), other.end());
    EXPECT_TRUE(cells.contains(other));
    for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(seen.at[kAtDiagonal + i], seen.at[kAtOpposite]);
  }
  EXPECT_GT(behind, walk.vertices.size() / 2);
}

TEST(NeighbourhoodOfOthers, QuadrilateralsAndTrianglesSeeAcrossTheirEdges) {
  const Walk quads(cut_lattice(CellShape::quad, {{0, 1, 2, 3}}, 1));
  ASSERT_EQ(quads.vertices.size(), kSide * kSide);
  std::size_t lines = 0, faces = 0;
  for (const Seen& seen : quads.vertices) {
    EXPECT_EQ(seen.around.kind, Neighbourhood::flat);
    if (seen.knows(3 * Neighbourhood::kNear | Neighbourhood::kDiagonal)) {
      ++faces;
      EXPECT_EQ(sum({{1, seen.at[0]}, {1, seen.at[1]}, {-1, seen.at[3]}}), place(seen.element));
    }
    for (std::uint32_t a = 0; a < 2; ++a)
      if (seen.knows(Neighbourhood::kBeyond << a)) {
        ++lines;
        EXPECT_EQ(sum({{2, seen.at[a]}, {-1, seen.at[kAtBeyond + a]}}), place(seen.element));
      }
  }
  EXPECT_GE(faces, (kSide - 1) * (kSide - 1));
  EXPECT_GT(lines, kSide * (kSide - 2));

  const Walk triangles(cut_lattice(CellShape::triangle, {{0, 1, 2}, {0, 2, 3}}, 1));
  faces = 0;
  for (const Seen& seen : triangles.vertices)
    if (seen.knows(Neighbourhood::kDiagonal)) {
      ++faces;
      EXPECT_EQ(seen.at[kAtDiagonal], seen.at[kAtOpposite]);
      const Point p = sum({{1, seen.at[0]}, {1, seen.at[1]}, {-1, seen.at[3]}}),
                  q = place(seen.element);
      EXPECT_LE(std::abs(p[0] - q[0]) + std::abs(p[1] - q[1]), 2);
    }
  EXPECT_GT(faces, (kSide - 1) * (kSide - 2));
}

TEST(NeighbourhoodOfOthers, APyramidSeesTheHexahedronBelow) {
  auto mesh = cut_lattice(CellShape::hexahedron, {{0, 1, 2, 3, 4, 5, 6, 7}}, 1);
  const std::uint64_t apex = kSide * kSide * kSide;
  for (std::uint64_t c = 0; c < 25; ++c) {
    const auto& v = mesh[c].vertices;
    mesh.push_back({CellShape::pyramid, {v[4], v[5], v[6], v[7], apex + c}});
  }
  const Walk walk(mesh);
  for (std::uint64_t c = 0; c < 25; ++c) {
    const Seen& seen = walk.vertices[2 * kSide * kSide + c];
    const auto& below = mesh[c].vertices;
    EXPECT_EQ(seen.element, apex + c);
    EXPECT_EQ(seen.around.kind, Neighbourhood::simplex);
    ASSERT_TRUE(seen.knows(3 * Neighbourhood::kNear | 3 * Neighbourhood::kDiagonal |
                           3 * Neighbourhood::kBeyond));
    EXPECT_EQ(seen.at[0], below[4]);
    EXPECT_EQ(seen.at[1], below[6]);
    EXPECT_EQ(seen.at[kAtDiagonal], below[5]);
    EXPECT_EQ(seen.at[kAtBeyond], below[0]);
    EXPECT_EQ(seen.at[kAtBeyond + 1], below[2]);
    EXPECT_EQ(walk.cells[25 + c].at[0], c);
  }
}

TEST(NeighbourhoodOfOthers, FramesStayWithinTheCell) {
  using enum CellShape;
  for (const CellShape shape : {line, triangle, quad, polygon, tetrahedron, pyramid, wedge})
    for (std::uint32_t nodes = 2; nodes < 40; ++nodes) {
      const std::uint32_t corners = corner_count(shape, nodes);
      const std::size_t sides = corners == 0 ? 0 : faces_of(shape, corners).size();
      for (std::uint32_t p = 0; p < corners; ++p) {
        const CornerFrame frame = corner_frame(shape, corners, p);
        for (const std::uint8_t at : frame.near) EXPECT_TRUE(at == kNoPlace || at < corners);
        for (const std::uint8_t at : frame.diagonal) EXPECT_TRUE(at == kNoPlace || at < corners);
        for (const std::uint8_t k : {frame.across[0], frame.across[1], frame.around}) {
          if (k == kNoPlace) continue;
          ASSERT_LT(k, sides);
          const ShapeFace& side = faces_of(shape, corners)[k];
          for (std::size_t i = 0; i < side.size; ++i) EXPECT_NE(side.at[i], p);
        }
        for (const std::uint8_t at : corner_neighbours(flat_shape(shape, corners), p))
          EXPECT_TRUE(at == kNoPlace || at < corners);
      }
    }
}

TEST(NeighbourhoodOfOthers, LinesGoOn) {
  std::vector<TestedCell> mesh;
  for (std::uint64_t i = 0; i < 9; ++i) mesh.push_back({CellShape::line, {i, i + 1}});
  const Walk walk(mesh);
  for (const Seen& seen : walk.vertices) {
    EXPECT_EQ(seen.knows(Neighbourhood::kNear), seen.element > 0);
    EXPECT_EQ(seen.knows(Neighbourhood::kBeyond), seen.element > 1);
    if (seen.element > 1) {
      EXPECT_EQ(seen.at[kAtBeyond], seen.element - 2);
    }
  }
}

TEST(NeighbourhoodOfOthers, CellsSeeTheCellsBehindTheirSides) {
  const auto mesh = cut_lattice(CellShape::wedge, kWedges);
  const Walk walk(mesh);
  const std::uint64_t layer = 2 * (kSide - 1) * (kSide - 1);
  for (const Seen& seen : walk.cells) {
    EXPECT_EQ(seen.around.kind, Neighbourhood::beside);
    ASSERT_EQ(seen.element, seen.cell);
    if (seen.cell >= layer) {
      EXPECT_EQ(seen.at[0], seen.cell - layer);
    }
    EXPECT_EQ(seen.knows(Neighbourhood::kBeyond) && seen.at[kAtBeyond] == seen.cell - 2 * layer,
              seen.cell >= 2 * layer);
    const bool second = seen.cell % 2 == 1;
    if (second) {  // the second half of its cube
      const auto near = std::span(seen.at).first(3);
      EXPECT_NE(std::find(near.begin(), near.end(), seen.cell - 1), near.end());
    }
  }
}

TEST(NeighbourhoodOfOthers, ReachOnlyAdds) {
  const auto mesh = cut_lattice(CellShape::wedge, kWedges);
  const Walk far(mesh), near(mesh, Reach::lattice);
  constexpr std::uint32_t counts = Neighbourhood::kLattice | 7 * Neighbourhood::kThird;
  for (std::size_t i = 0; i < far.vertices.size(); ++i) {
    EXPECT_EQ(far.vertices[i].around.known & counts, near.vertices[i].around.known & counts);
    EXPECT_EQ(std::vector(far.vertices[i].at.begin(), far.vertices[i].at.begin() + 7),
              std::vector(near.vertices[i].at.begin(), near.vertices[i].at.begin() + 7));
  }
}

// The cells have random shapes, and some are degenerate. Their vertices are chosen from a window
// that moves along the vertex numbers.
TEST(NeighbourhoodOfOthers, NamesOnlyWhatIsThere) {
  using enum CellShape;
  constexpr std::array<std::pair<CellShape, std::size_t>, 12> kShapes = {{{hexahedron, 8},
                                                                          {wedge, 6},
                                                                          {pyramid, 5},
                                                                          {tetrahedron, 4},
                                                                          {quad, 4},
                                                                          {triangle, 3},
                                                                          {line, 2},
                                                                          {polygon, 3},
                                                                          {polygon, 4},
                                                                          {polygon, 11},
                                                                          {other, 5},
                                                                          {tetrahedron, 10}}};
  std::mt19937_64 random(23);
  std::size_t known = 0;
  for (int round = 0; round < 30; ++round) {
    std::vector<TestedCell> mesh;
    const std::uint64_t window = 3 + random() % 9;
    const std::size_t shapes = 1 + random() % kShapes.size();
    for (std::uint64_t c = 0; c < 800; ++c) {
      const auto& [shape, nodes] = kShapes[random() % shapes];
      TestedCell cell{shape, {}};
      for (std::size_t i = 0; i < nodes; ++i)
        cell.vertices.push_back(c / 3 + random() % window);  // older vertices are finalized
      mesh.push_back(std::move(cell));
    }
    const Walk walk(mesh), again(mesh);
    std::set<std::uint64_t> born;
    for (std::size_t i = 0; i < walk.vertices.size(); ++i) {
      const Seen& seen = walk.vertices[i];
      ASSERT_EQ(seen.at, again.vertices[i].at);
      ASSERT_EQ(seen.around.known, again.vertices[i].around.known);
      for (std::uint32_t at = 0; at < 13; ++at)
        if (seen.knows(1u << at)) {
          ++known;
          ASSERT_TRUE(born.contains(seen.at[at])) << at;
        }
      born.insert(seen.element);
    }
    for (const Seen& seen : walk.cells)
      for (std::uint32_t at = 0; at < 13; ++at)
        if (seen.knows(1u << at)) {
          ASSERT_LT(seen.at[at], seen.cell);
        }
  }
  EXPECT_GT(known, 10000u);
}

}  // namespace
}  // namespace shm
