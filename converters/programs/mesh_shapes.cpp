#include "programs/mesh_shapes.h"

namespace make_mesh {

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

Point3 pipe(Point2 p, double along) {
  const double bend = along * kPi * 0.6, twist = 0.5 * along;
  const double neck = 1 - 0.3 * std::pow(std::sin(kPi * along), 2);
  const double x = (p.x * std::cos(twist) - p.y * std::sin(twist)) * neck;
  const double y = (p.x * std::sin(twist) + p.y * std::cos(twist)) * neck;
  return {(3 + x) * std::cos(bend), y, (3 + x) * std::sin(bend)};
}

namespace {

// Returns the 4 n points on the boundary of an O-grid's core, which has n x n quads. The points are
// counter-clockwise, from the lower left corner on.
std::vector<std::pair<Id, Id>> core_boundary(Id n) {
  std::vector<std::pair<Id, Id>> walk;
  for (Id i = 0; i < n; ++i) walk.emplace_back(i, 0);
  for (Id j = 0; j < n; ++j) walk.emplace_back(n, j);
  for (Id i = n; i > 0; --i) walk.emplace_back(i, n);
  for (Id j = n; j > 0; --j) walk.emplace_back(0, j);
  return walk;
}

}  // namespace

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

}  // namespace make_mesh
