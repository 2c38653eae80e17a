// Tests of the conversion of surfaces to polygons that halfedge structures can store. The tests
// check which faces stay connected, which are separated, which are omitted from the result, and how
// polygons are split.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "openmesh/polygons.h"

namespace shm::converters {
namespace {

using Ring = std::vector<std::uint32_t>;
using Place = std::array<double, 3>;

struct Drawn {
  std::vector<double> xyz;
  std::vector<std::uint64_t> face_begin{0};
  Ring corners, blocks;

  Drawn(const std::vector<Place>& places, const std::vector<Ring>& faces) {
    for (const Place& place : places) xyz.insert(xyz.end(), place.begin(), place.end());
    for (const Ring& face : faces) {
      corners.insert(corners.end(), face.begin(), face.end());
      face_begin.push_back(corners.size());
      blocks.push_back(0);
    }
  }
  Surface surface() const {
    Surface all;
    all.xyz = std::as_bytes(std::span(xyz));
    all.face_begin = face_begin;
    all.corners = corners;
    all.blocks = blocks;
    return all;
  }
};

// Returns arbitrary points that are all different.
std::vector<Place> scattered(std::size_t count) {
  std::vector<Place> places;
  for (std::size_t i = 0; i < count; ++i) {
    const double x = static_cast<double>(i);
    places.push_back({x, x * x, x * x * x});
  }
  return places;
}

Polygons made_of(const std::vector<Place>& places, const std::vector<Ring>& faces,
                 bool triangles = false) {
  const Drawn drawn(places, faces);
  auto polygons = polygons_of(drawn.surface(), {triangles});
  EXPECT_TRUE(polygons) << polygons.error().message();
  return std::move(*polygons);
}
Polygons made_of(std::size_t vertices, const std::vector<Ring>& faces, bool triangles = false) {
  return made_of(scattered(vertices), faces, triangles);
}

// Returns the polygons as lists of vertex numbers of the original surface.
std::vector<Ring> rings(const Polygons& polygons) {
  std::vector<Ring> all;
  for (std::size_t f = 0; f < polygons.face_count(); ++f) {
    all.emplace_back();
    for (const std::uint32_t corner : polygons.face(f))
      all.back().push_back(polygons.vertices[corner]);
  }
  return all;
}

// Checks the requirements of halfedge structures: each directed edge occurs once, and the faces
// around each vertex form a single fan or ring in which neighbouring faces share an edge.
void expect_manifold(const Polygons& polygons) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> ways;
  for (std::size_t f = 0; f < polygons.face_count(); ++f) {
    const auto face = polygons.face(f);
    ASSERT_GE(face.size(), 3U);
    ASSERT_EQ(std::set<std::uint32_t>(face.begin(), face.end()).size(), face.size()) << f;
    for (std::size_t i = 0; i < face.size(); ++i) {
      ASSERT_LT(face[i], polygons.vertices.size());
      ASSERT_TRUE(ways.emplace(std::pair(face[i], face[(i + 1) % face.size()]), f).second) << f;
    }
  }
  std::vector<std::map<std::uint32_t, std::uint32_t>> turns(polygons.vertices.size());
  for (std::size_t f = 0; f < polygons.face_count(); ++f) {
    const auto face = polygons.face(f);
    for (std::size_t i = 0; i < face.size(); ++i)
      turns[face[i]][face[(i + 1) % face.size()]] = face[(i + face.size() - 1) % face.size()];
  }
  for (const auto& around : turns) {
    ASSERT_FALSE(around.empty());  // every vertex is used
    std::set<std::uint32_t> ends;
    for (const auto& [from, to] : around) ends.insert(to);
    std::uint32_t at = around.begin()->first;
    for (const auto& [from, to] : around)
      if (!ends.contains(from)) at = from;
    std::size_t steps = 0;
    for (auto next = around.find(at); next != around.end() && steps < around.size();
         next = around.find(next->second))
      ++steps;
    EXPECT_EQ(steps, around.size());
  }
}

// Returns the Euler characteristic: number of vertices - number of edges + number of faces.
long euler(const Polygons& polygons) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> edges;
  for (std::size_t f = 0; f < polygons.face_count(); ++f) {
    const auto face = polygons.face(f);
    for (std::size_t i = 0; i < face.size(); ++i)
      edges.insert(std::minmax(face[i], face[(i + 1) % face.size()]));
  }
  return static_cast<long>(polygons.vertices.size()) - static_cast<long>(edges.size()) +
         static_cast<long>(polygons.face_count());
}

// Returns the sides of a cube. The numbering of its corners begins at the lower left front corner.
std::vector<Ring> cube(const std::array<std::uint32_t, 8>& v) {
  return {{v[0], v[3], v[2], v[1]}, {v[4], v[5], v[6], v[7]}, {v[0], v[1], v[5], v[4]},
          {v[1], v[2], v[6], v[5]}, {v[2], v[3], v[7], v[6]}, {v[3], v[0], v[4], v[7]}};
}
std::vector<Ring> both(std::vector<Ring> a, const std::vector<Ring>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(Polygons, ACubeStaysAsItIs) {
  const auto faces = cube({0, 1, 2, 3, 4, 5, 6, 7});
  const Polygons polygons = made_of(8, faces);
  expect_manifold(polygons);
  EXPECT_EQ(rings(polygons), faces);
  EXPECT_EQ(polygons.copies, 0U);
  EXPECT_EQ(polygons.vertices, (Ring{0, 1, 2, 3, 4, 5, 6, 7}));
  EXPECT_EQ(euler(polygons), 2);
}

TEST(Polygons, VerticesOfNoFaceAreLeftOut) {
  const Polygons polygons = made_of(9, {{7, 2, 4}});
  EXPECT_EQ(polygons.vertices, (Ring{2, 4, 7}));
  EXPECT_EQ(rings(polygons), (std::vector<Ring>{{7, 2, 4}}));
}

TEST(Polygons, AnEdgeOfThreeFacesIsTakenApart) {
  const Polygons polygons = made_of(5, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}});
  expect_manifold(polygons);
  EXPECT_EQ(polygons.copies, 4U);
  EXPECT_EQ(polygons.vertices.size(), 9U);
}

TEST(Polygons, FacesThatGoAlongAnEdgeAlikeAreTakenApart) {
  EXPECT_EQ(made_of(4, {{0, 1, 2}, {1, 0, 3}}).copies, 0U);
  const Polygons polygons = made_of(4, {{0, 1, 2}, {0, 1, 3}});
  expect_manifold(polygons);
  EXPECT_EQ(polygons.copies, 2U);
}

TEST(Polygons, CubesThatTouchAtAVertexAreTakenApart) {
  const auto faces = both(cube({0, 1, 2, 3, 4, 5, 6, 7}), cube({6, 8, 9, 10, 11, 12, 13, 14}));
  const Polygons polygons = made_of(15, faces);
  expect_manifold(polygons);
  EXPECT_EQ(polygons.copies, 1U);
  EXPECT_EQ(polygons.vertices.back(), 6U);  // copies come after all other vertices
  EXPECT_EQ(euler(polygons), 4);
  EXPECT_EQ(rings(polygons), faces);
}

TEST(Polygons, CubesThatTouchAtAnEdgeAreTakenApartAndStayClosed) {
  const auto faces = both(cube({0, 1, 2, 3, 4, 5, 6, 7}), cube({2, 8, 9, 10, 6, 11, 12, 13}));
  const Polygons polygons = made_of(14, faces);
  expect_manifold(polygons);
  EXPECT_EQ(polygons.copies, 2U);
  EXPECT_EQ(euler(polygons), 4);
}

TEST(Polygons, AStripWithATwistIsCutOnce) {
  const Polygons polygons =
      made_of(10, {{0, 1, 3, 2}, {2, 3, 5, 4}, {4, 5, 7, 6}, {6, 7, 9, 8}, {8, 9, 0, 1}});
  expect_manifold(polygons);
  EXPECT_EQ(polygons.copies, 2U);
  EXPECT_EQ(euler(polygons), 1);
}

TEST(Polygons, TheSameFaceTwice) {
  const Polygons alike = made_of(3, {{0, 1, 2}, {0, 1, 2}});
  expect_manifold(alike);
  EXPECT_EQ(alike.copies, 3U);
  const Polygons back_to_back = made_of(3, {{0, 1, 2}, {2, 1, 0}});
  expect_manifold(back_to_back);
  EXPECT_EQ(back_to_back.copies, 0U);
}

TEST(Polygons, AFaceThatComesUponItsVertexAgain) {
  // The surface is a single polygon that consists of two triangles with a common vertex.
  const Polygons alone = made_of(5, {{0, 1, 2, 0, 3, 4}});
  expect_manifold(alone);
  EXPECT_EQ(alone.copies, 1U);
  EXPECT_EQ(alone.vertices.size(), 6U);
  // The first polygon runs along an edge and back along the same edge.
  const Polygons spike = made_of(5, {{0, 1, 2, 3, 2}, {1, 0, 4}});
  expect_manifold(spike);
  EXPECT_EQ(spike.face_count(), 2U);
  // The polygon has vertex 0 at two corners. Other faces connect these two corners.
  const Polygons around =
      made_of(7, {{0, 1, 2, 0, 3, 4}, {0, 2, 5}, {0, 5, 3}, {0, 4, 6}, {0, 6, 1}});
  expect_manifold(around);
  EXPECT_EQ(around.face_count(), 5U);
  // As triangles, parts without area disappear.
  for (const Ring& face : rings(made_of(5, {{0, 1, 2, 0, 3, 4}, {0, 1, 2, 3, 2}}, true)))
    EXPECT_EQ(std::set<std::uint32_t>(face.begin(), face.end()).size(), 3U);
}

TEST(Polygons, WhatIsNoFaceIsCounted) {
  auto places = scattered(8);
  places[6][1] = std::numeric_limits<double>::quiet_NaN();
  places[7][2] = -3.5e38;
  const Polygons polygons = made_of(
      places, {{0}, {0, 1}, {1, 1, 1, 2}, {3, 4, 3, 4}, {0, 1, 6}, {0, 1, 7}, {5, 5, 4, 3, 5}});
  EXPECT_EQ(polygons.lines_and_points, 2U);
  EXPECT_EQ(polygons.collapsed, 2U);
  EXPECT_EQ(polygons.not_finite, 2U);
  EXPECT_EQ(rings(polygons), (std::vector<Ring>{{5, 4, 3}}));
  EXPECT_EQ(polygons.faces, (Ring{6}));
  EXPECT_EQ(polygons_of(Drawn({}, {}).surface())->face_count(), 0U);
}

TEST(Polygons, QuadsAreSplitAlongTheShorterDiagonalWithin) {
  const std::vector<Place> wide = {{0, 0, 0}, {3, -1, 0}, {6, 0, 0}, {3, 1, 0}};
  for (const Ring& quad : {Ring{0, 1, 2, 3}, Ring{1, 2, 3, 0}, Ring{3, 2, 1, 0}}) {
    const auto halves = rings(made_of(wide, {quad}, true));
    ASSERT_EQ(halves.size(), 2U);
    for (const Ring& half : halves)
      EXPECT_TRUE(std::count(half.begin(), half.end(), 1U) &&
                  std::count(half.begin(), half.end(), 3U));
  }
  // The shorter diagonal would be outside.
  const std::vector<Place> dart = {{0, 0, 0}, {1, 3, 0}, {0, 2, 0}, {-1, 3, 0}};
  const auto halves = rings(made_of(dart, {{0, 1, 2, 3}}, true));
  ASSERT_EQ(halves.size(), 2U);
  for (const Ring& half : halves)
    EXPECT_TRUE(std::count(half.begin(), half.end(), 0U) &&
                std::count(half.begin(), half.end(), 2U));
}

TEST(Polygons, PolygonsAreSplitWhereTheyHaveTo) {
  const auto ring = [](std::size_t count) {
    Ring all(count);
    for (std::size_t i = 0; i < count; ++i) all[i] = static_cast<std::uint32_t>(i);
    return all;
  };
  EXPECT_EQ(made_of(300, {ring(255)}).face_count(), 1U);
  EXPECT_EQ(made_of(300, {ring(256)}).face_count(), 254U);
  const Polygons five = made_of(8, {ring(5), {5, 6, 7}}, true);
  EXPECT_EQ(five.face_count(), 4U);
  EXPECT_EQ(five.faces, (Ring{0, 0, 0, 1}));
}

TEST(Polygons, DiagonalsThatMeetAreTakenApart) {
  // Two coinciding quads with opposite orientation share a diagonal, so four triangles meet at one
  // edge.
  const std::vector<Place> wide = {{0, 0, 0}, {3, -1, 0}, {6, 0, 0}, {3, 1, 0}};
  const Polygons polygons = made_of(wide, {{0, 1, 2, 3}, {3, 2, 1, 0}}, true);
  EXPECT_EQ(polygons.face_count(), 4U);
  expect_manifold(polygons);
}

TEST(Polygons, WhateverComesIsManifold) {
  std::mt19937 numbers(7);
  const auto random = [&] { return static_cast<std::uint32_t>(numbers()); };
  for (int round = 0; round < 600; ++round) {
    const std::uint32_t vertices = 3 + random() % 9;
    std::vector<Ring> faces(1 + random() % 24);
    for (Ring& face : faces) {
      face.resize(1 + random() % 6);
      for (std::uint32_t& corner : face) corner = random() % vertices;
    }
    for (const bool triangles : {false, true}) {
      const Polygons polygons = made_of(vertices, faces, triangles);
      expect_manifold(polygons);
      if (HasFatalFailure()) return;
      EXPECT_EQ(polygons.vertices.size() - polygons.copies,
                std::set<std::uint32_t>(polygons.vertices.begin(), polygons.vertices.end()).size());
      for (std::size_t f = 0; f < polygons.face_count(); ++f)
        EXPECT_LT(polygons.faces[f], faces.size());
    }
  }
}

}  // namespace
}  // namespace shm::converters
