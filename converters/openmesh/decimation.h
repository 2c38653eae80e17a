// A module for the decimater of OpenMesh. Include this header only in sources that are compiled
// with OpenMesh.
#pragma once

#include <OpenMesh/Core/Geometry/QuadricT.hh>
#include <OpenMesh/Core/Mesh/Handles.hh>
#include <OpenMesh/Core/Utils/Property.hh>
#include <OpenMesh/Tools/Decimater/ModBaseT.hh>
#include <algorithm>

namespace shm::converters {

// Quadric error module. Like OpenMesh's ModQuadricT, it measures the distance between a collapsed
// vertex and the planes of the original faces. It differs from ModQuadricT in three ways:
// - If rounding makes an error slightly negative, it is treated as 0. ModQuadricT forbids collapses
//   with a negative error, so it would not decimate flat regions.
// - Boundary edges add a plane perpendicular to their face. Without this plane, the boundary of a
//   sheet would not keep its outline.
// - Collapses that would flip or flatten a triangle are not allowed.
//
// Scale the coordinates to about -1..1 before decimation.
template <class MeshType>
class OutlineQuadrics final : public OpenMesh::Decimater::ModBaseT<MeshType> {
 public:
  DECIMATING_MODULE(OutlineQuadrics, MeshType, OutlineQuadrics);

  // Borrows the mesh.
  explicit OutlineQuadrics(MeshType& decimated) : Base(decimated, false) {
    this->mesh().add_property(quadrics_);
  }
  ~OutlineQuadrics() override { this->mesh().remove_property(quadrics_); }

  void initialize() override {
    MeshType& mesh = this->mesh();
    for (const auto vertex : mesh.vertices()) mesh.property(quadrics_, vertex).clear();
    for (const auto face : mesh.faces()) {
      const auto first = mesh.halfedge_handle(face);
      const auto second = mesh.next_halfedge_handle(first);
      const auto third = mesh.next_halfedge_handle(second);
      const Place normal = normal_of(start(first), start(second), start(third));
      const double twice_area = normal.norm();
      if (!(twice_area > 0)) continue;
      for (const auto side : {first, second, third}) {
        add_plane(mesh.from_vertex_handle(side), normal / twice_area, start(first), twice_area / 2);
        if (!mesh.is_boundary(mesh.opposite_halfedge_handle(side))) continue;
        const Place along = start(mesh.next_halfedge_handle(side)) - start(side);
        const Place upright = along % normal;
        if (!(upright.norm() > 0)) continue;
        for (const auto end : {mesh.from_vertex_handle(side), mesh.to_vertex_handle(side)})
          add_plane(end, upright / upright.norm(), start(side), along.sqrnorm());
      }
    }
  }

  float collapse_priority(const CollapseInfo& collapse) override {
    if (turns_any(collapse)) return static_cast<float>(Base::ILLEGAL_COLLAPSE);
    Quadric sum = this->mesh().property(quadrics_, collapse.v0);
    sum += this->mesh().property(quadrics_, collapse.v1);
    const double length = (collapse.p1 - collapse.p0).sqrnorm();
    return static_cast<float>(std::max(0.0, sum(collapse.p1)) + kShortFirst * length);
  }

  void postprocess_collapse(const CollapseInfo& collapse) override {
    this->mesh().property(quadrics_, collapse.v1) += this->mesh().property(quadrics_, collapse.v0);
  }

 private:
  using Place = typename MeshType::Point;
  using Quadric = OpenMesh::Geometry::QuadricT<double>;

  // Small weight of the edge length in the error. In a flat region all other errors are 0, so this
  // weight makes short edges collapse first. Without it, one vertex could absorb all others one by
  // one, and each collapse would check all faces around this vertex.
  static constexpr double kShortFirst = 1e-9;

  static Place normal_of(const Place& a, const Place& b, const Place& c) {
    return (b - a) % (c - a);
  }
  Place start(OpenMesh::HalfedgeHandle side) {
    return this->mesh().point(this->mesh().from_vertex_handle(side));
  }
  void add_plane(OpenMesh::VertexHandle vertex, const Place& normal, const Place& on,
                 double weight) {
    Quadric quadric(normal[0], normal[1], normal[2], -(on | normal));
    quadric *= weight;
    this->mesh().property(quadrics_, vertex) += quadric;
  }

  // Returns true if the collapse flips or flattens a triangle around the removed vertex. Ignores
  // the triangles that the collapse removes.
  bool turns_any(const CollapseInfo& collapse) {
    MeshType& mesh = this->mesh();
    for (auto side = mesh.cvoh_iter(collapse.v0); side.is_valid(); ++side) {
      const auto face = mesh.face_handle(*side);
      if (!face.is_valid() || face == collapse.fl || face == collapse.fr) continue;
      const Place b = mesh.point(mesh.to_vertex_handle(*side));
      const Place c = mesh.point(mesh.to_vertex_handle(mesh.next_halfedge_handle(*side)));
      const Place before = normal_of(collapse.p0, b, c), after = normal_of(collapse.p1, b, c);
      if (before.sqrnorm() > 0 && !((before | after) > 0)) return true;
    }
    return false;
  }

  OpenMesh::VPropHandleT<Quadric> quadrics_;
};

}  // namespace shm::converters
