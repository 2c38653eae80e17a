#include "programs/mesh_families.h"

#include <numeric>
#include <unordered_map>

namespace make_mesh {

namespace {

// Assigns numbers to edges and faces, which are identified by two or three vertices in any order.
// The same vertices always get the same number.
class Numbering {
 public:
  explicit Numbering(Id first) : next_(first) {}
  // Returns the number of an edge or face, and true if it is new.
  std::pair<Id, bool> number(Id a, Id b, Id c = std::numeric_limits<Id>::max()) {
    std::array<Id, 3> key{a, b, c};
    std::sort(key.begin(), key.end());
    const auto [place, fresh] = numbers_.try_emplace(key, next_);
    if (fresh) ++next_;
    return {place->second, fresh};
  }

 private:
  struct Hash {
    std::size_t operator()(const std::array<Id, 3>& key) const {
      std::uint64_t hash = 0;
      for (const Id part : key) hash = (hash ^ part) * 0x9e3779b97f4a7c15u + (hash >> 29);
      return static_cast<std::size_t>(hash);
    }
  };
  std::unordered_map<std::array<Id, 3>, Id, Hash> numbers_;
  Id next_;
};

Mesh make_grid(std::uint64_t cells) {
  const Id n = rounded(side_for(cells, 1));
  return lattice(n, n, n, [](double x, double y, double z) { return Point3{x, y, z}; });
}

Mesh make_ogrid(std::uint64_t cells) {
  const double side = side_for(cells, (1 + 4 * 0.92) * 1.94);
  return sweep(disk(rounded(side), rounded(0.92 * side)), rounded(1.94 * side), pipe);
}

// Numbers the grid points on the surface of an n x n x n cube. Also computes, for each point, the
// unit vector from the centre to the point. These vectors are the points of a cubed sphere.
class SphereSurface {
 public:
  explicit SphereSurface(Id n) : n_(n) {}
  Id at(Id x, Id y, Id z) {
    const auto [place, fresh] =
        numbers_.try_emplace(x + (n_ + 1ull) * (y + (n_ + 1ull) * z), Id(directions.size()));
    if (fresh) {
      const Point3 p{warp(x), warp(y), warp(z)};
      directions.push_back(p * (1 / std::sqrt(dot(p, p))));
    }
    return place->second;
  }
  std::vector<Point3> directions;

 private:
  // Maps grid line `i` to a coordinate -1..1 on the cube. The angles between grid lines, as seen
  // from the centre, are equal. If the lines were evenly spaced on the cube instead, cells of the
  // sphere would be much smaller near the cube's corners.
  double warp(Id i) const { return std::tan(kPi / 4 * (2.0 * i / n_ - 1)); }
  Id n_;
  std::unordered_map<std::uint64_t, Id> numbers_;
};

Mesh make_shell(std::uint64_t cells) {
  const double side = side_for(cells, 6 * 2.25 * 2.25);
  const Id layers = rounded(side), n = rounded(2.25 * side);
  SphereSurface surface(n);
  std::vector<Quad> quads;
  for (int face = 0; face < 6; ++face) {
    const int axis = face / 2;
    const bool far = face % 2 == 1;
    const auto corner = [&](Id u, Id v) {  // counter-clockwise as seen from outside
      if (!far) std::swap(u, v);
      std::array<Id, 3> position{};
      position[axis] = far ? n : 0;
      position[(axis + 1) % 3] = u;
      position[(axis + 2) % 3] = v;
      return surface.at(position[0], position[1], position[2]);
    };
    for (Id j = 0; j < n; ++j)
      for (Id i = 0; i < n; ++i)
        quads.push_back({corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)});
  }
  Mesh mesh;
  for (const Point3& direction : surface.directions)
    for (Id layer = 0; layer <= layers; ++layer)
      mesh.points.push_back(direction * (0.55 + 0.45 * std::pow(double(layer) / layers, 1.3)));
  for (const Quad& quad : quads)
    for (Id layer = 0; layer < layers; ++layer) {
      Hexahedron cell;
      for (std::size_t c = 0; c < 4; ++c) {
        cell[c] = quad[c] * (layers + 1) + layer;
        cell[c + 4] = cell[c] + 1;
      }
      mesh.cells.push_back(cell);
    }
  return mesh;
}

// Generates the cubes of a lattice that are inside a thickened gyroid surface. The mesh has many
// handles and a staircase boundary.
Mesh make_voxel(std::uint64_t cells) {
  const Id n = std::max<Id>(2, rounded(side_for(cells, 0.39)));
  const auto inside = [n](Id i, Id j, Id k) {
    const double x = 4 * kPi * i / n, y = 4 * kPi * j / n, z = 4 * kPi * k / n;
    return std::abs(std::sin(x) * std::cos(y) + std::sin(y) * std::cos(z) +
                    std::sin(z) * std::cos(x) + 0.15 * std::sin(3.1 * x + 1.7 * y)) < 0.52;
  };
  Mesh mesh;
  for (Id k = 0; k <= n; ++k)
    for (Id j = 0; j <= n; ++j)
      for (Id i = 0; i <= n; ++i)
        mesh.points.push_back({i * 0.0375 - 3.1, j * 0.0375 + 2.7, k * 0.0375 + 11.9});
  for (Id k = 0; k < n; ++k)
    for (Id j = 0; j < n; ++j)
      for (Id i = 0; i < n; ++i)
        if (inside(i, j, k)) mesh.cells.push_back(lattice_cell(i, j, k, n, n));
  number_by_first_use(mesh);
  return mesh;
}

// Splits each counter-clockwise triangle into three quads. A point of the resulting mesh may have
// any number of neighbours.
Plane split_triangles(std::vector<Point2> points, const std::vector<std::array<Id, 3>>& triangles) {
  Plane plane;
  plane.points = std::move(points);
  std::unordered_map<std::uint64_t, Id> middles;
  const auto middle = [&](Id a, Id b) {
    const auto [low, high] = std::minmax(a, b);
    const auto [place, fresh] =
        middles.try_emplace(std::uint64_t{low} << 32 | high, Id(plane.points.size()));
    if (fresh) {
      const Point2 p = plane.points[a], q = plane.points[b];
      plane.points.push_back({(p.x + q.x) / 2, (p.y + q.y) / 2});
    }
    return place->second;
  };
  for (const auto& [a, b, c] : triangles) {
    const Id ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    const Id center = static_cast<Id>(plane.points.size());
    const Point2 p = plane.points[a], q = plane.points[b], r = plane.points[c];
    plane.points.push_back({(p.x + q.x + r.x) / 3, (p.y + q.y + r.y) / 3});
    plane.quads.push_back({a, ab, center, ca});
    plane.quads.push_back({b, bc, center, ab});
    plane.quads.push_back({c, ca, center, bc});
  }
  return plane;
}

// Generates an irregular quad mesh of a plate with two holes, swept along a curve.
Mesh make_swept(std::uint64_t cells) {
  // Number of cells: each square has two triangles, each triangle has three quads, and 86 % of the
  // squares are outside the holes. The number of layers is half the number of squares along one
  // side.
  const double side = side_for(cells, 6 * 0.86 * 0.5);
  const Id n = std::max<Id>(2, rounded(side)), layers = rounded(0.5 * side);
  Random random(1);
  std::vector<Point2> points;
  for (Id j = 0; j <= n; ++j)
    for (Id i = 0; i <= n; ++i) {
      const bool edge = i == 0 || j == 0 || i == n || j == n;
      const double dx = edge ? 0 : 0.3 * (random.uniform() - 0.5);
      const double dy = edge ? 0 : 0.3 * (random.uniform() - 0.5);
      points.push_back({2 * (i + dx) / n - 1, 2 * (j + dy) / n - 1});
    }
  const auto in_hole = [n](Id i, Id j) {
    const double x = (2.0 * i + 1) / n - 1, y = (2.0 * j + 1) / n - 1;
    return std::hypot(x + 0.4, y - 0.1) < 0.33 || std::hypot(x - 0.5, y + 0.3) < 0.26;
  };
  std::vector<std::array<Id, 3>> triangles;
  for (Id j = 0; j < n; ++j)
    for (Id i = 0; i < n; ++i) {
      if (in_hole(i, j)) continue;
      const Id a = i + (n + 1) * j, b = a + 1, c = a + n + 2, d = a + n + 1;
      if (random.next() & 1) {
        triangles.push_back({a, b, c});
        triangles.push_back({a, c, d});
      } else {
        triangles.push_back({a, b, d});
        triangles.push_back({b, c, d});
      }
    }
  Mesh mesh = sweep(split_triangles(std::move(points), triangles), layers, pipe);
  number_by_first_use(mesh);
  return mesh;
}

// Splits each cube of a jittered lattice into six tetrahedra around its main diagonal.
std::vector<Tetrahedron> cube_tetrahedra(Id n) {
  // The three bits of a corner number are the corner's x, y and z. The four corners of each
  // tetrahedron are on a path along three edges from corner 0 to corner 7.
  constexpr std::array<std::array<Id, 4>, 6> kWalks{
      {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};
  std::vector<Tetrahedron> tetrahedra;
  for (Id k = 0; k < n; ++k)
    for (Id j = 0; j < n; ++j)
      for (Id i = 0; i < n; ++i)
        for (const auto& walk : kWalks) {
          Tetrahedron t{};
          for (std::size_t c = 0; c < 4; ++c)
            t[c] = (i + (walk[c] & 1)) +
                   (n + 1) * ((j + (walk[c] >> 1 & 1)) + (n + 1) * (k + (walk[c] >> 2)));
          tetrahedra.push_back(t);
        }
  return tetrahedra;
}

// Splits each tetrahedron into four hexahedra. The new points are numbered after the old points:
// first the midpoints of edges, then the centres of faces, then the centres of tetrahedra.
Mesh split_tetrahedra(std::vector<Point3> points, const std::vector<Tetrahedron>& tetrahedra) {
  Mesh mesh;
  mesh.points = std::move(points);
  const auto& p = mesh.points;
  Numbering edges(static_cast<Id>(p.size()));
  for (const Tetrahedron& t : tetrahedra)
    for (std::size_t a = 0; a < 4; ++a)
      for (std::size_t b = a + 1; b < 4; ++b)
        if (edges.number(t[a], t[b]).second) mesh.points.push_back((p[t[a]] + p[t[b]]) * 0.5);
  Numbering faces(static_cast<Id>(p.size()));
  for (const Tetrahedron& t : tetrahedra)
    for (std::size_t opposite = 4; opposite-- > 0;) {
      const Id a = t[opposite == 0], b = t[opposite <= 1 ? 2 : 1], c = t[opposite == 3 ? 2 : 3];
      if (faces.number(a, b, c).second) mesh.points.push_back((p[a] + p[b] + p[c]) * (1.0 / 3));
    }
  // For each corner of a tetrahedron, the other three corners, counter-clockwise as seen from that
  // corner.
  constexpr std::array<std::array<std::size_t, 3>, 4> kOthers{
      {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  for (const Tetrahedron& t : tetrahedra) {
    const Id center = static_cast<Id>(p.size());
    mesh.points.push_back((p[t[0]] + p[t[1]] + p[t[2]] + p[t[3]]) * 0.25);
    for (std::size_t v = 0; v < 4; ++v) {
      const Id o = t[v], a = t[kOthers[v][0]], b = t[kOthers[v][1]], c = t[kOthers[v][2]];
      mesh.cells.push_back({o, edges.number(o, a).first, faces.number(o, a, b).first,
                            edges.number(o, b).first, edges.number(o, c).first,
                            faces.number(o, a, c).first, center, faces.number(o, b, c).first});
    }
  }
  return mesh;
}

Mesh make_tets(std::uint64_t cells) {
  const Id n = rounded(side_for(cells, 24));
  Random random(2);
  std::vector<Point3> points;
  for (Id k = 0; k <= n; ++k)
    for (Id j = 0; j <= n; ++j)
      for (Id i = 0; i <= n; ++i) {
        const auto jittered = [&](Id index) {
          const double shift = 0.3 * (random.uniform() - 0.5);
          return (index == 0 || index == n ? index : index + shift) / n;
        };
        const double x = jittered(i), y = jittered(j), z = jittered(k);
        points.push_back({x, y, z});
      }
  return split_tetrahedra(std::move(points), cube_tetrahedra(n));
}

// Generates a curved lattice that is divided into blocks, as block-structured mesh generators do.
// The blocks are in random order. Within a block, cells are numbered along the axes of the block;
// the order and the directions of these axes are random.
Mesh make_blocks(std::uint64_t cells) {
  constexpr Id kBlocks = 4;  // number of blocks per axis
  const Id width = rounded(side_for(cells, 1) / kBlocks), n = width * kBlocks;
  const Mesh whole = lattice(n, n, n, [](double x, double y, double z) {
    return pipe({0.7 * (2 * x - 1) * (1 + 0.2 * y), 0.7 * (2 * y - 1) * (1 - 0.1 * x * z)}, z);
  });
  Random random(3);
  std::vector<Id> order(kBlocks * kBlocks * kBlocks);
  std::iota(order.begin(), order.end(), 0);
  shuffle(order, random);
  Mesh mesh;
  mesh.points = whole.points;
  for (const Id block : order) {
    const std::array<Id, 3> first{block % kBlocks * width, block / kBlocks % kBlocks * width,
                                  block / kBlocks / kBlocks * width};
    std::vector<std::size_t> axes{0, 1, 2};
    shuffle(axes, random);
    const std::uint64_t flips = random.next();
    for (Id c = 0; c < width * width * width; ++c) {
      const std::array<Id, 3> steps{c % width, c / width % width, c / width / width};
      std::array<Id, 3> position{};
      for (std::size_t d = 0; d < 3; ++d) {
        const bool flip = flips >> d & 1;
        position[axes[d]] = first[axes[d]] + (flip ? width - 1 - steps[d] : steps[d]);
      }
      mesh.cells.push_back(whole.cells[position[0] + n * (position[1] + n * position[2])]);
    }
  }
  number_by_first_use(mesh);
  return mesh;
}

// Generates the mesh of make_ogrid() with vertices and cells in random order, as some programs
// write meshes.
Mesh make_shuffled(std::uint64_t cells) {
  const Mesh ordered = make_ogrid(cells);
  Random random(4);
  std::vector<Id> place(ordered.points.size());
  std::iota(place.begin(), place.end(), 0);
  shuffle(place, random);
  Mesh mesh;
  mesh.points.resize(ordered.points.size());
  for (std::size_t v = 0; v < place.size(); ++v) mesh.points[place[v]] = ordered.points[v];
  mesh.cells = ordered.cells;
  for (Hexahedron& cell : mesh.cells)
    for (Id& corner : cell) corner = place[corner];
  shuffle(mesh.cells, random);
  return mesh;
}

}  // namespace

const std::array<Family, 8>& families() {
  static constexpr std::array<Family, 8> kFamilies{{
      {"grid", "a cube of cubes", make_grid},
      {"ogrid", "a bent pipe around an O-grid", make_ogrid},
      {"shell", "a spherical shell of six patches", make_shell},
      {"voxel", "cubes inside a gyroid", make_voxel},
      {"swept", "an irregular quad mesh with holes, swept", make_swept},
      {"tets", "tetrahedra split into four hexahedra each", make_tets},
      {"blocks", "64 blocks, each numbered its own way", make_blocks},
      {"shuffled", "the O-grid in random order", make_shuffled},
  }};
  return kFamilies;
}

}  // namespace make_mesh
