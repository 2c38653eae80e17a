// Families of hexahedral meshes that are degenerate or not manifold: cells with collapsed corners,
// repeated cells, faces and edges that many cells share, closed rows of cells with and without a
// twist, and cells with random corners.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "mesh/hexahedron.h"
#include "support/test_mesh.h"

namespace shm {

struct Family {
  std::string name;
  TestMesh mesh;
};

using Corners = std::array<std::uint64_t, 8>;

/// Returns a mesh with the given cells. It has enough vertices for all corners; their coordinates
/// are arbitrary.
inline TestMesh mesh_of(const std::vector<Corners>& cells, std::uint64_t vertices = 0) {
  TestMesh mesh;
  mesh.schema = hexahedra_schema(ScalarType::float64);
  for (const Corners& corners : cells) {
    for (const std::uint64_t v : corners) vertices = std::max(vertices, v + 1);
    mesh.cells.push_back({0, {corners.begin(), corners.end()}});
  }
  std::vector<std::array<double, 3>> points;
  for (std::uint64_t v = 0; v < vertices; ++v)
    points.push_back({static_cast<double>(v % 7), static_cast<double>(v / 7 % 11),
                      static_cast<double>(v) * .25});
  mesh.set_points(points);
  return mesh;
}

/// Returns prisms over the 2 * n * n triangles of a square, in `layers` layers. Each prism is a
/// hexahedron with two collapsed edges.
inline TestMesh layered_prisms(std::uint64_t n, std::uint64_t layers) {
  TestMesh mesh = grid(n, n, layers, ScalarType::float64, warped);
  std::vector<TestCell> prisms;
  for (const TestCell& cell : mesh.cells) {
    const auto& c = cell.corners;
    prisms.push_back({0, {c[0], c[1], c[2], c[2], c[4], c[5], c[6], c[6]}});
    prisms.push_back({0, {c[0], c[2], c[3], c[3], c[4], c[6], c[7], c[7]}});
  }
  mesh.cells = std::move(prisms);
  return mesh;
}

/// Returns sectors of a cylinder around its axis, in layers. One face of each sector is collapsed
/// to an edge.
inline TestMesh sectors(std::uint64_t around, std::uint64_t layers) {
  std::vector<std::array<double, 3>> points;
  for (std::uint64_t k = 0; k <= layers; ++k) {
    const double z = static_cast<double>(k) * .1;
    points.push_back({0, 0, z});
    for (std::uint64_t i = 0; i < around; ++i) {
      const double a = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(around);
      points.push_back({std::cos(a), std::sin(a), z});
    }
  }
  std::vector<Corners> cells;
  for (std::uint64_t k = 0; k < layers; ++k)
    for (std::uint64_t i = 0; i < around; ++i) {
      const std::uint64_t low = k * (around + 1), high = low + around + 1;
      const std::uint64_t a = 1 + i, b = 1 + (i + 1) % around;
      cells.push_back({low, low + a, low + b, low, high, high + a, high + b, high});
    }
  TestMesh mesh = mesh_of(cells);
  mesh.set_points(points);
  return mesh;
}

/// Returns a grid in which each cell is divided into six pyramids. A pyramid is stored as a
/// hexahedron whose top face is collapsed to a point.
inline TestMesh pyramids(std::uint64_t n) {
  constexpr std::array<std::array<std::size_t, 4>, 6> kFaces = {
      {{0, 1, 2, 3}, {4, 7, 6, 5}, {0, 4, 5, 1}, {1, 5, 6, 2}, {2, 6, 7, 3}, {3, 7, 4, 0}}};
  TestMesh mesh = grid(n, n, n, ScalarType::float64);
  std::vector<TestCell> cells;
  for (const TestCell& cell : mesh.cells) {
    const std::uint64_t top = mesh.vertices++;
    for (int c = 0; c < 3; ++c) append(mesh.xyz, static_cast<double>(top) * .01);
    for (const auto& face : kFaces) {
      TestCell pyramid{0, {}};
      for (const std::size_t i : face) pyramid.corners.push_back(cell.corners[i]);
      pyramid.corners.resize(8, top);
      cells.push_back(std::move(pyramid));
    }
  }
  mesh.cells = std::move(cells);
  return mesh;
}

/// Returns a grid in which each cell is divided into six tetrahedra. A tetrahedron is stored as a
/// hexahedron whose top face and one edge are collapsed.
inline TestMesh tetrahedra(std::uint64_t n) {
  constexpr std::array<std::array<std::size_t, 2>, 6> kPaths = {
      {{1, 2}, {1, 5}, {3, 2}, {3, 7}, {4, 5}, {4, 7}}};
  TestMesh mesh = grid(n, n, n, ScalarType::float64, warped);
  std::vector<TestCell> cells;
  for (const TestCell& cell : mesh.cells)
    for (const auto& path : kPaths) {
      const auto& c = cell.corners;
      const std::uint64_t a = c[0], b = c[path[0]], d = c[path[1]], top = c[6];
      cells.push_back({0, {a, b, d, d, top, top, top, top}});
    }
  mesh.cells = std::move(cells);
  return mesh;
}

/// Returns a grid after how(index, corners) has changed the corners of each cell.
inline TestMesh changed_grid(
    std::uint64_t n, const std::function<void(std::size_t, std::vector<std::uint64_t>&)>& how) {
  TestMesh mesh = grid(n, n, n, ScalarType::float64, warped);
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) how(c, mesh.cells[c].corners);
  return mesh;
}

/// Returns a grid without the cells for which `stays` returns false.
inline TestMesh part_of_grid(
    std::uint64_t n,
    const std::function<bool(std::uint64_t, std::uint64_t, std::uint64_t)>& stays) {
  TestMesh mesh = grid(n, n, n, ScalarType::float64);
  std::vector<TestCell> cells;
  for (std::uint64_t c = 0; c < mesh.cells.size(); ++c)
    if (stays(c % n, c / n % n, c / n / n)) cells.push_back(mesh.cells[c]);
  mesh.cells = std::move(cells);
  return mesh;
}

/// Returns a row of `count` cells that is closed into a ring: corner i of the last face is the same
/// vertex as corner glue[i] of the first face.
inline TestMesh closed_row(std::uint64_t count, const std::array<std::uint64_t, 4>& glue) {
  std::vector<Corners> cells;
  for (std::uint64_t c = 0; c < count; ++c) {
    Corners corners;
    for (std::uint64_t i = 0; i < 4; ++i) {
      corners[i] = 4 * c + i;
      corners[4 + i] = c + 1 < count ? 4 * (c + 1) + i : glue[i];
    }
    cells.push_back(corners);
  }
  return mesh_of(cells);
}

/// Returns a grid that is periodic along all three axes: along each axis, the last layer is
/// connected to the first layer.
inline TestMesh torus(std::uint64_t nx, std::uint64_t ny, std::uint64_t nz) {
  const auto v = [&](std::uint64_t i, std::uint64_t j, std::uint64_t k) {
    return i % nx + nx * (j % ny + ny * (k % nz));
  };
  std::vector<Corners> cells;
  for (std::uint64_t k = 0; k < nz; ++k)
    for (std::uint64_t j = 0; j < ny; ++j)
      for (std::uint64_t i = 0; i < nx; ++i)
        cells.push_back({v(i, j, k), v(i + 1, j, k), v(i + 1, j + 1, k), v(i, j + 1, k),
                         v(i, j, k + 1), v(i + 1, j, k + 1), v(i + 1, j + 1, k + 1),
                         v(i, j + 1, k + 1)});
  return mesh_of(cells);
}

inline TestMesh garbage(std::uint64_t cells, std::uint64_t vertices, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Corners> list(cells);
  for (Corners& corners : list)
    for (std::uint64_t& v : corners) v = random() % vertices;
  return mesh_of(list, vertices);
}

/// Returns cells whose corners are chosen at random from a window that moves along the vertex
/// numbers. The cells therefore share corners in many accidental ways.
inline TestMesh moving_garbage(std::uint64_t cells, std::uint64_t window, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::vector<Corners> list(cells);
  for (std::uint64_t c = 0; c < cells; ++c)
    for (std::uint64_t& v : list[c]) v = c + random() % window;
  return mesh_of(list);
}

inline void add_collapsed(std::vector<Family>& all) {
  all.push_back({"prisms", layered_prisms(4, 3)});
  all.push_back({"sectors", sectors(7, 5)});
  all.push_back({"one sector around", sectors(1, 9)});
  all.push_back({"two sectors around", sectors(2, 9)});
  all.push_back({"pyramids", pyramids(3)});
  all.push_back({"tetrahedra", tetrahedra(3)});
  all.push_back({"any two corners are one", changed_grid(4, [](std::size_t c, auto& v) {
                   const std::size_t a = c % 8, b = (a + 1 + c / 8 % 7) % 8;
                   v[a] = v[b];
                 })});
  all.push_back({"an edge is a point", changed_grid(4, [](std::size_t c, auto& v) {
                   v[kEdgeCorners[c % 12][0]] = v[kEdgeCorners[c % 12][1]];
                 })});
  all.push_back({"a face is an edge", changed_grid(4, [](std::size_t c, auto& v) {
                   v[c % 2 == 0 ? 1 : 3] = v[0];
                   v[c % 3 == 0 ? 1 : 3] = v[2];
                 })});
  all.push_back({"a face is a point", changed_grid(4, [](std::size_t c, auto& v) {
                   for (std::size_t i = 1; i < 4; ++i) v[(c % 2) * 4 + i] = v[(c % 2) * 4];
                 })});
  all.push_back({"flat cells", changed_grid(4, [](std::size_t c, auto& v) {
                   if (c % 2 == 0) std::copy_n(v.begin(), 4, v.begin() + 4);
                 })});
  all.push_back({"cells are edges", changed_grid(4, [](std::size_t c, auto& v) {
                   for (std::size_t i = 0; i < 8; ++i) v[i] = i < 1 + c % 7 ? v[0] : v[7];
                 })});
  all.push_back({"cells are points", changed_grid(4, [](std::size_t c, auto& v) {
                   if (c % 3 != 2) std::fill(v.begin(), v.end(), v[c % 8]);
                 })});
}

inline void add_shared(std::vector<Family>& all) {
  TestMesh twice = grid(4, 4, 4, ScalarType::float64), again = twice, copies = twice;
  for (std::size_t c = twice.cells.size(); c-- > 0;)
    twice.cells.insert(twice.cells.begin() + static_cast<std::ptrdiff_t>(c), twice.cells[c]);
  all.push_back({"each cell twice", std::move(twice)});
  const auto cells = again.cells;
  again.cells.insert(again.cells.end(), cells.begin(), cells.end());
  std::mt19937_64 random(3);
  rotate_corners(again, random, true);
  all.push_back({"each cell twice, turned and much later", std::move(again)});
  for (TestCell& cell : copies.cells) cell = cells[0];
  all.push_back({"one cell many times", std::move(copies)});

  std::vector<Corners> book, fan, open_fan, star;
  for (std::uint64_t i = 0; i < 42; ++i) {
    const std::uint64_t f = 4 * (i / 3),
                        n = 200 + 4 * i;  // three more cells at each cross-section of the row
    book.push_back({f, f + 1, f + 2, f + 3, n, n + 1, n + 2, n + 3});
    if (i % 3 == 2) book.push_back({f, f + 1, f + 2, f + 3, f + 4, f + 5, f + 6, f + 7});
    const std::uint64_t a = 2 + 4 * i, b = 2 + 4 * ((i + 1) % 42), o = 2 + 6 * i;
    fan.push_back({0, a, a + 2, b, 1, a + 1, a + 3, b + 1});
    open_fan.push_back({0, o, o + 1, o + 2, 1, o + 3, o + 4, o + 5});
    const std::uint64_t s = 1 + 7 * i;
    star.push_back({0, s, s + 1, s + 2, s + 3, s + 4, s + 5, s + 6});
  }
  all.push_back({"faces of four cells", mesh_of(book)});
  all.push_back({"a closed fan around an edge", mesh_of(fan)});
  all.push_back({"an edge of many cells", mesh_of(open_fan)});
  all.push_back({"a vertex of many cells", mesh_of(star)});

  TestMesh pages = grid(2, 2, 2, ScalarType::float64);
  for (int n = 0; n < 40; ++n) {
    TestCell cell = pages.cells[0];
    for (std::size_t i = 4; i < 8; ++i) cell.corners[i] = 20 + random() % 7;
    pages.cells.push_back(cell);
  }
  all.push_back({"a face of many cells", std::move(pages)});
  all.push_back({"edges touch",
                 part_of_grid(6, [](auto i, auto j, auto k) { return (i + j + k) % 2 == 0; })});
  all.push_back({"vertices touch", part_of_grid(6, [](auto i, auto j, auto k) {
                   return i % 2 == j % 2 && j % 2 == k % 2;
                 })});
  all.push_back({"nothing touches", part_of_grid(7, [](auto i, auto j, auto k) {
                   return i % 2 == 0 && j % 2 == 0 && k % 2 == 0;
                 })});
}

inline void add_glued(std::vector<Family>& all) {
  for (const std::uint64_t count : {1, 2, 3, 20}) {
    const std::string row = "row of " + std::to_string(count) + " glued ";
    all.push_back({row + "straight", closed_row(count, {0, 1, 2, 3})});
    all.push_back({row + "with a quarter turn", closed_row(count, {1, 2, 3, 0})});
    all.push_back({row + "with half a turn", closed_row(count, {2, 3, 0, 1})});
    all.push_back({row + "mirrored", closed_row(count, {1, 0, 3, 2})});
    all.push_back({row + "across", closed_row(count, {0, 2, 1, 3})});
  }
  all.push_back({"torus of 1", torus(1, 1, 1)});
  all.push_back({"torus of 2", torus(2, 2, 2)});
  all.push_back({"torus of 3 x 2 x 1", torus(3, 2, 1)});
  all.push_back({"torus of 6 x 5 x 4", torus(6, 5, 4)});
  // In the first mesh, each cell shares two faces with the previous cell. In the second mesh, each
  // cell shares all six faces with the previous cell.
  std::vector<Corners> two_faces, all_faces;
  for (std::uint64_t c = 0; c < 30; ++c) {
    const std::uint64_t v = 2 * c;
    two_faces.push_back({v, v + 1, v + 3, v + 2, v + 4, v + 5, v + 7, v + 6});
    two_faces.push_back({v, v + 1, v + 3, v + 2, v + 8, v + 9, v + 7, v + 6});
    all_faces.push_back({v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6, v + 7});
    all_faces.push_back({v + 4, v + 5, v + 6, v + 7, v, v + 1, v + 2, v + 3});
  }
  all.push_back({"cells that share two faces", mesh_of(two_faces)});
  all.push_back({"cells that share six faces", mesh_of(all_faces)});
}

inline void add_disordered(std::vector<Family>& all) {
  std::mt19937_64 random(4);
  all.push_back({"inverted cells", changed_grid(4, [](std::size_t c, auto& v) {
                   if (c % 3 == 0) std::swap_ranges(v.begin(), v.begin() + 4, v.begin() + 4);
                 })});
  all.push_back({"all cells inverted", changed_grid(4, [](std::size_t, auto& v) {
                   std::swap_ranges(v.begin(), v.begin() + 4, v.begin() + 4);
                 })});
  all.push_back({"twisted tops", changed_grid(4, [](std::size_t c, auto& v) {
                   if (c % 3 == 0) std::rotate(v.begin() + 4, v.begin() + 5, v.end());
                   if (c % 4 == 0) std::swap(v[5], v[6]);
                 })});
  all.push_back({"corners in any order", changed_grid(4, [&](std::size_t, auto& v) {
                   std::shuffle(v.begin(), v.end(), random);
                 })});
  TestMesh scattered = changed_grid(4, [&](std::size_t c, auto& v) {
    if (c % 2 == 0) std::shuffle(v.begin(), v.end(), random);
  });
  shuffle_cells(scattered, random);
  shuffle_vertices(scattered, random);
  all.push_back({"corners and cells in any order", std::move(scattered)});
  all.push_back({"garbage over few vertices", garbage(80, 9, 5)});
  all.push_back({"garbage", garbage(80, 60, 6)});
  all.push_back({"garbage over many vertices", garbage(60, 1500, 7)});
  all.push_back({"garbage that moves along", moving_garbage(80, 12, 8)});
}

inline const std::vector<Family>& degenerate_families() {
  static const std::vector<Family> families = [] {
    std::vector<Family> all;
    add_collapsed(all);
    add_shared(all);
    add_glued(all);
    add_disordered(all);
    TestMesh mix;
    mix.schema = hexahedra_schema(ScalarType::float64);
    for (const Family& family : all) {
      for (TestCell cell : family.mesh.cells) {
        if (mix.cells.size() % 5 > 0)
          mix.cells.push_back(cell);  // overlapping cells of all families above
        for (auto& v : cell.corners) v = (v + mix.vertices) % 397;
        if (mix.cells.size() % 5 == 0) mix.cells.push_back(cell);
      }
      mix.vertices += 13;
    }
    for (TestCell& cell : mix.cells)
      for (auto& v : cell.corners) v %= 397;
    mix.cells.resize(std::min<std::size_t>(mix.cells.size(), 400));
    const TestMesh places = mesh_of({}, 397);
    mix.vertices = places.vertices;
    mix.xyz = places.xyz;
    all.push_back({"all of them over each other", std::move(mix)});
    return all;
  }();
  return families;
}

}  // namespace shm
