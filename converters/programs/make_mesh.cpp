// shm_make_mesh: hexahedral meshes of known kinds and any size, for the demo and the benchmarks.
// Writes binary legacy VTK 4.2. The same arguments give the same bytes on one machine; between
// machines the last bit of a coordinate may differ, because sin and cos do.
#include <algorithm>
#include <array>
#include <bit>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace {

using Id = std::uint32_t;
using Hexahedron = std::array<Id, 8>;
using Quad = std::array<Id, 4>;
using Tetrahedron = std::array<Id, 4>;

// The VTK 4.2 CELLS section counts its 32-bit words in one signed 32-bit number: nine a cell.
constexpr std::uint64_t kMaxCells = std::numeric_limits<std::int32_t>::max() / 9;
constexpr double kPi = std::numbers::pi;

struct Point2 {
  double x = 0, y = 0;
};
struct Point3 {
  double x = 0, y = 0, z = 0;
  Point3 operator+(const Point3& o) const { return {x + o.x, y + o.y, z + o.z}; }
  Point3 operator-(const Point3& o) const { return {x - o.x, y - o.y, z - o.z}; }
  Point3 operator*(double f) const { return {x * f, y * f, z * f}; }
};
double dot(const Point3& a, const Point3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

struct Mesh {
  std::vector<Point3> points;
  std::vector<Hexahedron> cells;
};
// Counterclockwise quads in the plane.
struct Plane {
  std::vector<Point2> points;
  std::vector<Quad> quads;
};

// splitmix64: small, fast, the same everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
  }
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }  // [0, 1)
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(next() % end); }

 private:
  std::uint64_t state_;
};

template <class T>
void shuffle(std::vector<T>& values, Random& random) {
  for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.below(i)]);
}

// At least 1, so that a family never comes out empty.
Id rounded(double value) { return std::max<Id>(1, static_cast<Id>(std::lround(value))); }

// Side of a shape whose cell count is `per_cube` times the side's cube.
double side_for(std::uint64_t cells, double per_cube) {
  return std::cbrt(static_cast<double>(cells) / per_cube);
}

// ---- building blocks

// Cells of a lattice with ni x nj x nk cells, i fastest.
Hexahedron lattice_cell(Id i, Id j, Id k, Id ni, Id nj) {
  const Id row = ni + 1, layer = row * (nj + 1);
  const Id corner = i + row * j + layer * k;
  return {corner,         corner + 1,         corner + row + 1,         corner + row,
          corner + layer, corner + layer + 1, corner + layer + row + 1, corner + layer + row};
}

Mesh lattice(Id ni, Id nj, Id nk, const std::function<Point3(double, double, double)>& place) {
  Mesh mesh;
  for (Id k = 0; k <= nk; ++k)
    for (Id j = 0; j <= nj; ++j)
      for (Id i = 0; i <= ni; ++i)
        mesh.points.push_back(place(double(i) / ni, double(j) / nj, double(k) / nk));
  for (Id k = 0; k < nk; ++k)
    for (Id j = 0; j < nj; ++j)
      for (Id i = 0; i < ni; ++i) mesh.cells.push_back(lattice_cell(i, j, k, ni, nj));
  return mesh;
}

// Sweeps a plane through `layers` layers, one layer after the other.
Mesh sweep(const Plane& plane, Id layers, const std::function<Point3(Point2, double)>& place) {
  const Id stride = static_cast<Id>(plane.points.size());
  Mesh mesh;
  mesh.points.reserve(std::size_t{stride} * (layers + 1));
  mesh.cells.reserve(plane.quads.size() * layers);
  for (Id k = 0; k <= layers; ++k)
    for (const Point2& p : plane.points) mesh.points.push_back(place(p, double(k) / layers));
  for (Id k = 0; k < layers; ++k)
    for (const Quad& q : plane.quads) {
      const Id low = k * stride, high = low + stride;
      mesh.cells.push_back({q[0] + low, q[1] + low, q[2] + low, q[3] + low, q[0] + high,
                            q[1] + high, q[2] + high, q[3] + high});
    }
  return mesh;
}

// A bent, twisted, necked pipe; `p` lies in the unit disk.
Point3 pipe(Point2 p, double along) {
  const double bend = along * kPi * 0.6, twist = 0.5 * along;
  const double neck = 1 - 0.3 * std::pow(std::sin(kPi * along), 2);
  const double x = (p.x * std::cos(twist) - p.y * std::sin(twist)) * neck;
  const double y = (p.x * std::sin(twist) + p.y * std::cos(twist)) * neck;
  return {(3 + x) * std::cos(bend), y, (3 + x) * std::sin(bend)};
}

// Counterclockwise walk around a core of n x n quads, from its lower left corner: 4 n points.
std::vector<std::pair<Id, Id>> core_boundary(Id n) {
  std::vector<std::pair<Id, Id>> walk;
  for (Id i = 0; i < n; ++i) walk.emplace_back(i, 0);
  for (Id j = 0; j < n; ++j) walk.emplace_back(n, j);
  for (Id i = n; i > 0; --i) walk.emplace_back(i, n);
  for (Id j = n; j > 0; --j) walk.emplace_back(0, j);
  return walk;
}

// The unit disk as an O-grid: a bulged square core and `rings` rings of quads around it.
Plane disk(Id core, Id rings) {
  Plane plane;
  const double half = 0.5 / std::sqrt(2.0) * 1.15;
  for (Id j = 0; j <= core; ++j)
    for (Id i = 0; i <= core; ++i) {
      const double u = 2.0 * i / core - 1, v = 2.0 * j / core - 1;
      plane.points.push_back(
          {u * half * (1 + 0.15 * (1 - v * v)), v * half * (1 + 0.15 * (1 - u * u))});
    }
  for (Id j = 0; j < core; ++j)
    for (Id i = 0; i < core; ++i) {
      const Id corner = i + (core + 1) * j;
      plane.quads.push_back({corner, corner + 1, corner + core + 2, corner + core + 1});
    }
  std::vector<Id> inner;
  for (const auto& [i, j] : core_boundary(core)) inner.push_back(i + (core + 1) * j);
  const std::vector<Id> core_edge = inner;
  const Id around = static_cast<Id>(inner.size());
  for (Id ring = 1; ring <= rings; ++ring) {
    std::vector<Id> outer;
    const double weight = std::pow(double(ring) / rings, 0.8);
    for (Id q = 0; q < around; ++q) {
      const double angle = -0.75 * kPi + 0.5 * kPi * q / core;
      const Point2 from = plane.points[core_edge[q]];
      outer.push_back(static_cast<Id>(plane.points.size()));
      plane.points.push_back({from.x * (1 - weight) + std::cos(angle) * weight,
                              from.y * (1 - weight) + std::sin(angle) * weight});
    }
    for (Id q = 0; q < around; ++q) {
      const Id next = (q + 1) % around;
      plane.quads.push_back({inner[q], outer[q], outer[next], inner[next]});
    }
    inner = std::move(outer);
  }
  return plane;
}

// Numbers things by their (sorted) vertices: the same ones get the same number.
class Numbering {
 public:
  explicit Numbering(Id first) : next_(first) {}
  // The number, and whether it is new.
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

// Drops unused points and renumbers the others by first use.
void number_by_first_use(Mesh& mesh) {
  constexpr Id kUnset = std::numeric_limits<Id>::max();
  std::vector<Id> renumbered(mesh.points.size(), kUnset);
  std::vector<Point3> points;
  for (Hexahedron& cell : mesh.cells)
    for (Id& corner : cell) {
      if (renumbered[corner] == kUnset) {
        renumbered[corner] = static_cast<Id>(points.size());
        points.push_back(mesh.points[corner]);
      }
      corner = renumbered[corner];
    }
  mesh.points = std::move(points);
}

// ---- families

Mesh make_grid(std::uint64_t cells) {
  const Id n = rounded(side_for(cells, 1));
  return lattice(n, n, n, [](double x, double y, double z) { return Point3{x, y, z}; });
}

Mesh make_ogrid(std::uint64_t cells) {
  const double side = side_for(cells, (1 + 4 * 0.92) * 1.94);
  return sweep(disk(rounded(side), rounded(0.92 * side)), rounded(1.94 * side), pipe);
}

// Number and direction of the points on the surface of an n x n x n cube, for a cubed sphere.
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
  // Equal angles instead of equal lengths, so that cells do not crowd at the cube's corners.
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
    const auto corner = [&](Id u, Id v) {  // counterclockwise from outside
      if (!far) std::swap(u, v);
      std::array<Id, 3> at{};
      at[axis] = far ? n : 0;
      at[(axis + 1) % 3] = u;
      at[(axis + 2) % 3] = v;
      return surface.at(at[0], at[1], at[2]);
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

// Cubes of a lattice that lie inside a thick gyroid: many handles, staircase boundary.
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

// Splits counterclockwise triangles into three quads each: points of any valence.
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

// An irregular quad mesh of a plate with two holes, swept along a curve.
Mesh make_swept(std::uint64_t cells) {
  // Two triangles of three quads a square, 86 % of the squares outside the holes, half as many
  // layers as squares on a side.
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

// Six tetrahedra a cube of a jittered lattice, all around the cube's main diagonal.
std::vector<Tetrahedron> cube_tetrahedra(Id n) {
  // Corners of a cube numbered by bits x, y, z; each walks 0 -> 7 along three edges.
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

// Tetrahedra split into four hexahedra each; new points stand behind the old ones: edges, faces,
// centers.
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
  // The other three corners of each corner, counterclockwise from outside that corner.
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
        const auto jittered = [&](Id at) {
          const double shift = 0.3 * (random.uniform() - 0.5);
          return (at == 0 || at == n ? at : at + shift) / n;
        };
        const double x = jittered(i), y = jittered(j), z = jittered(k);
        points.push_back({x, y, z});
      }
  return split_tetrahedra(std::move(points), cube_tetrahedra(n));
}

// A curved lattice cut into blocks, each numbered along its own axes, blocks in any order: what
// block-structured meshers leave.
Mesh make_blocks(std::uint64_t cells) {
  constexpr Id kBlocks = 4;  // on each axis
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
      std::array<Id, 3> at{};
      for (std::size_t d = 0; d < 3; ++d) {
        const bool flip = flips >> d & 1;
        at[axes[d]] = first[axes[d]] + (flip ? width - 1 - steps[d] : steps[d]);
      }
      mesh.cells.push_back(whole.cells[at[0] + n * (at[1] + n * at[2])]);
    }
  }
  number_by_first_use(mesh);
  return mesh;
}

// The O-grid with vertices and cells in random order: what some tools leave.
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

struct Family {
  std::string_view name, meaning;
  Mesh (*make)(std::uint64_t cells);
};
constexpr std::array<Family, 8> kFamilies{{
    {"grid", "a cube of cubes", make_grid},
    {"ogrid", "a bent pipe around an O-grid", make_ogrid},
    {"shell", "a spherical shell of six patches", make_shell},
    {"voxel", "cubes inside a gyroid", make_voxel},
    {"swept", "an irregular quad mesh with holes, swept", make_swept},
    {"tets", "tetrahedra split into four hexahedra each", make_tets},
    {"blocks", "64 blocks, each numbered its own way", make_blocks},
    {"shuffled", "the O-grid in random order", make_shuffled},
}};

// ---- fields

struct Field {
  std::string name;
  std::string_view type;  // VTK's word
  std::size_t components = 1;
  std::vector<double> values;  // written as `type`
};

// Positions in the mesh's bounding cube, each coordinate 0..1.
class Box {
 public:
  explicit Box(const std::vector<Point3>& points) : low_(points.front()) {
    Point3 high = low_;
    for (const Point3& p : points) {
      low_ = {std::min(low_.x, p.x), std::min(low_.y, p.y), std::min(low_.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    const Point3 size = high - low_;
    scale_ = 1 / std::max({size.x, size.y, size.z});
  }
  Point3 at(const Point3& p) const { return (p - low_) * scale_; }

 private:
  Point3 low_;
  double scale_;
};

double smooth(const Point3& p) {
  return 300 + 50 * std::sin(3 * p.x + 1) * std::cos(4 * p.y) * std::exp(-p.z);
}

// Waves over five octaves with a turbulent spectrum, and a little noise.
class Turbulence {
 public:
  Turbulence() {
    for (Wave& wave : waves_) {
      const double number = 2 * kPi * std::exp2(random_.uniform() * 5.5);
      const double height = 2 * random_.uniform() - 1, turn = 2 * kPi * random_.uniform();
      const double flat = std::sqrt(1 - height * height);
      wave = {Point3{flat * std::cos(turn), flat * std::sin(turn), height} * number,
              std::pow(number, -1.0 / 3), 2 * kPi * random_.uniform()};
    }
  }
  double operator()(const Point3& p) {
    double sum = 1e-3 * (random_.uniform() - 0.5);
    for (const Wave& wave : waves_) sum += wave.height * std::cos(dot(wave.vector, p) + wave.phase);
    return sum;
  }

 private:
  struct Wave {
    Point3 vector;
    double height = 0, phase = 0;
  };
  Random random_{11};
  std::array<Wave, 48> waves_;
};

std::vector<Point3> random_sites(std::size_t count) {
  Random random(7);
  std::vector<Point3> sites(count);
  for (Point3& site : sites) site = {random.uniform(), random.uniform(), random.uniform()};
  return sites;
}

std::size_t nearest(const Point3& p, const std::vector<Point3>& sites) {
  std::size_t best = 0;
  double best_distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sites.size(); ++i) {
    const double distance = dot(p - sites[i], p - sites[i]);
    if (distance < best_distance) best_distance = distance, best = i;
  }
  return best;
}

std::vector<Field> cell_fields(const Mesh& mesh, std::string_view fields) {
  const bool full = fields == "full";
  const Box box(mesh.points);
  const std::vector<Point3> sites = random_sites(12);
  Turbulence turbulence;
  Field temperature{"temperature", "float", 1, {}}, material{"material", "int", 1, {}};
  Field velocity{"velocity", "float", 3, {}}, turbulent{"turbulence", "float", 1, {}};
  for (const Hexahedron& cell : mesh.cells) {
    Point3 sum;
    for (const Id corner : cell) sum = sum + mesh.points[corner];
    const Point3 p = box.at(sum * 0.125);
    temperature.values.push_back(smooth(p));
    if (fields == "one") continue;
    material.values.push_back(static_cast<double>(nearest(p, sites) + 1));
    if (!full) continue;
    velocity.values.insert(
        velocity.values.end(),
        {std::sin(5 * p.y) * std::cos(3 * p.z), std::sin(5 * p.z + p.x), std::cos(4 * p.x) * p.y});
    turbulent.values.push_back(turbulence(p));
  }
  if (fields == "one") return {temperature};
  if (!full) return {temperature, material};
  return {temperature, material, velocity, turbulent};
}

std::vector<Field> point_fields(const Mesh& mesh, bool full) {
  if (!full) return {};
  const Box box(mesh.points);
  Field pressure{"pressure", "float", 1, {}};
  for (const Point3& point : mesh.points) {
    const Point3 p = box.at(point);
    const double from_front = std::hypot(p.x - 0.3, p.y - 0.4, p.z - 0.2) - 0.45;
    pressure.values.push_back((from_front < 0 ? 1 + 0.2 * p.x : 0.125 + 0.02 * p.y) +
                              0.3 * std::tanh(from_front / 0.003));
  }
  return {pressure};
}

// ---- output

class VtkFile {
 public:
  explicit VtkFile(const char* path) : file_(std::fopen(path, "wb")) {}
  VtkFile(const VtkFile&) = delete;
  VtkFile& operator=(const VtkFile&) = delete;
  ~VtkFile() {
    if (file_ != nullptr) std::fclose(file_);
  }
  void text(const std::string& line) { bytes(line.data(), line.size()); }
  // Big-endian, as VTK has it.
  template <class T>
  void number(T value) {
    std::array<char, sizeof(T)> raw;
    std::memcpy(raw.data(), &value, sizeof(T));
    if constexpr (std::endian::native == std::endian::little) std::reverse(raw.begin(), raw.end());
    bytes(raw.data(), raw.size());
  }
  // True when every byte has reached the file.
  bool close() {
    if (file_ == nullptr) return false;
    const bool closed = std::fclose(std::exchange(file_, nullptr)) == 0;
    return good_ && closed;
  }

 private:
  void bytes(const char* data, std::size_t size) {
    if (file_ == nullptr || std::fwrite(data, 1, size, file_) != size) good_ = false;
  }
  std::FILE* file_;
  bool good_ = true;
};

void write_fields(VtkFile& file, std::string_view section, std::size_t elements,
                  const std::vector<Field>& fields) {
  if (fields.empty()) return;
  file.text(std::string(section) + " " + std::to_string(elements) + "\nFIELD FieldData " +
            std::to_string(fields.size()) + "\n");
  for (const Field& field : fields) {
    file.text(field.name + " " + std::to_string(field.components) + " " + std::to_string(elements) +
              " " + std::string(field.type) + "\n");
    for (const double value : field.values)
      if (field.type == "int")
        file.number(static_cast<std::int32_t>(value));
      else
        file.number(static_cast<float>(value));
    file.text("\n");
  }
}

struct Request {
  const Family* family = nullptr;
  std::uint64_t cells = 0;
  const char* path = nullptr;
  bool doubles = false;
  std::string_view fields = "basic";
};

bool write_mesh(const Mesh& mesh, const Request& request) {
  VtkFile file(request.path);
  file.text("# vtk DataFile Version 4.2\n" + std::string(request.family->name) +
            "\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS " + std::to_string(mesh.points.size()) +
            (request.doubles ? " double\n" : " float\n"));
  for (const Point3& p : mesh.points)
    for (const double coordinate : {p.x, p.y, p.z})
      if (request.doubles)
        file.number(coordinate);
      else
        file.number(static_cast<float>(coordinate));
  file.text("\nCELLS " + std::to_string(mesh.cells.size()) + " " +
            std::to_string(9 * mesh.cells.size()) + "\n");
  for (const Hexahedron& cell : mesh.cells) {
    file.number(std::int32_t{8});
    for (const Id corner : cell) file.number(static_cast<std::int32_t>(corner));
  }
  file.text("\nCELL_TYPES " + std::to_string(mesh.cells.size()) + "\n");
  for (std::size_t i = 0; i < mesh.cells.size(); ++i) file.number(std::int32_t{12});
  file.text("\n");
  if (request.fields != "none") {
    const bool full = request.fields == "full";
    write_fields(file, "CELL_DATA", mesh.cells.size(), cell_fields(mesh, request.fields));
    write_fields(file, "POINT_DATA", mesh.points.size(), point_fields(mesh, full));
  }
  return file.close();
}

// ---- command line

void print_usage(std::FILE* out) {
  std::fputs(
      "usage: shm_make_mesh FAMILY CELLS OUT.vtk [--double] [--fields none|one|basic|full]\n"
      "Writes a hexahedral mesh of about CELLS cells as binary legacy VTK.\n"
      "Families:\n",
      out);
  for (const Family& family : kFamilies)
    std::fprintf(out, "  %-9.*s %.*s\n", static_cast<int>(family.name.size()), family.name.data(),
                 static_cast<int>(family.meaning.size()), family.meaning.data());
  std::fputs(
      "Fields: one is a smooth temperature on cells; basic (the default) adds a material number, "
      "full\n"
      "velocity and turbulence on cells and a shock front on points.\n",
      out);
}

bool parse_cells(std::string_view text, std::uint64_t& cells) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cells);
  // Families round to whole layers: leave room to round up.
  return error == std::errc() && end == text.data() + text.size() && cells > 0 &&
         cells <= kMaxCells / 10 * 9;
}

bool parse(int count, char** words, Request& request) {
  if (count < 4) return false;
  for (const Family& family : kFamilies)
    if (family.name == words[1]) request.family = &family;
  if (request.family == nullptr || !parse_cells(words[2], request.cells)) return false;
  request.path = words[3];
  for (int i = 4; i < count; ++i) {
    const std::string_view word = words[i];
    if (word == "--double")
      request.doubles = true;
    else if (word == "--fields" && i + 1 < count)
      request.fields = words[++i];
    else
      return false;
  }
  constexpr std::array<std::string_view, 4> kFields = {"none", "one", "basic", "full"};
  return std::find(kFields.begin(), kFields.end(), request.fields) != kFields.end();
}

}  // namespace

int main(int count, char** words) {
  if (count == 2 && std::string_view(words[1]) == "--help") {
    print_usage(stdout);
    return 0;
  }
  Request request;
  if (!parse(count, words, request)) {
    print_usage(stderr);
    return 2;
  }
  const Mesh mesh = request.family->make(request.cells);
  if (!write_mesh(mesh, request)) {
    std::fprintf(stderr, "shm_make_mesh: %s could not be written\n", request.path);
    return 4;
  }
  std::printf("%s: %zu vertices, %zu hexahedra\n", request.path, mesh.points.size(),
              mesh.cells.size());
  return 0;
}
