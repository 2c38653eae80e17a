// Types and building blocks of the meshes of shm_make_mesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>
#include <vector>

namespace make_mesh {

using Id = std::uint32_t;
using Hexahedron = std::array<Id, 8>;
using Quad = std::array<Id, 4>;
using Tetrahedron = std::array<Id, 4>;

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
inline double dot(const Point3& a, const Point3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

struct Mesh {
  std::vector<Point3> points;
  std::vector<Hexahedron> cells;
};
// A mesh of counter-clockwise quads in the plane.
struct Plane {
  std::vector<Point2> points;
  std::vector<Quad> quads;
};

// The random generator splitmix64, which is small, fast, and the same on every machine.
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
  // Returns a number in [0, 1).
  double uniform() { return static_cast<double>(next() >> 11) * 0x1p-53; }
  std::size_t below(std::size_t end) { return static_cast<std::size_t>(next() % end); }

 private:
  std::uint64_t state_;
};

template <class T>
void shuffle(std::vector<T>& values, Random& random) {
  for (std::size_t i = values.size(); i > 1; --i) std::swap(values[i - 1], values[random.below(i)]);
}

// Rounds to an integer. The result is at least 1, so that no mesh is empty.
inline Id rounded(double value) { return std::max<Id>(1, static_cast<Id>(std::lround(value))); }

// Returns the side length n (in cells) for which a shape has `cells` cells, if its number of cells
// is per_cube * n^3.
inline double side_for(std::uint64_t cells, double per_cube) {
  return std::cbrt(static_cast<double>(cells) / per_cube);
}

// Returns a cell of a lattice with ni x nj x nk cells; i changes fastest.
Hexahedron lattice_cell(Id i, Id j, Id k, Id ni, Id nj);
Mesh lattice(Id ni, Id nj, Id nk, const std::function<Point3(double, double, double)>& place);

// Sweeps a planar quad mesh into `layers` layers of hexahedra, layer by layer. place(p, t) returns
// the position of point p when the fraction t (0..1) of the sweep is complete.
Mesh sweep(const Plane& plane, Id layers, const std::function<Point3(Point2, double)>& place);

// Maps a point `p` of the unit disk to a point of a bent, twisted pipe with a neck.
Point3 pipe(Point2 p, double along);

// Returns an O-grid of the unit disk: a square core with bulged sides, and `rings` rings of quads
// around the core.
Plane disk(Id core, Id rings);

// Drops unused points, and renumbers the other points in order of first use.
void number_by_first_use(Mesh& mesh);

}  // namespace make_mesh
