// Camera: projects the vertices of a mesh onto a picture, using a parallel projection. The mesh is
// scaled so that it fills the part of the picture that is available for it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "picture/raster.h"
#include "picture/surface.h"

namespace shm::converters {

using Vector = std::array<double, 3>;

inline double dot(const Vector& a, const Vector& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
inline Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vector minus(const Vector& a, const Vector& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
// Returns a normal vector whose length is twice the area of the polygon. If the polygon is not
// planar, it is split into a fan of triangles, and the sum of their normal vectors is returned.
Vector normal_of(std::span<const Vector> polygon);
// Scales a vector to length 1. Returns nothing if its length is 0 or not finite.
std::optional<Vector> unit(const Vector& vector);

// Default directions from the mesh to the viewer, indexed by the axis that points up. The mesh is
// seen from the right, the front and above.
inline constexpr std::array<Vector, 3> kUsualViews = {{{1, -1, 2}, {1, 1, 2}, {1, -2, 1}}};

// The part of a picture that the mesh may fill, in pixels.
struct PictureFrame {
  std::uint32_t left = 0, top = 0, width = 0, height = 0;
};

class Camera {
 public:
  // Chooses direction and scale so that all finite vertices of `surface` are visible in `frame`.
  // `view` is the direction from the mesh to the viewer; its length is ignored but must not be 0.
  // If `view` is empty, a planar surface is viewed along its normal, and any other surface along
  // kUsualViews[up]. `up` is the axis that points up in the picture (0 to 2).
  Camera(const Surface& surface, const std::optional<Vector>& view, std::size_t up,
         const PictureFrame& frame);

  // Returns the position of a vertex in normalized coordinates: the centre of the mesh's bounding
  // box is at the origin, and the longest side of the box extends from -1 to 1. Returns nothing if
  // a coordinate is not finite.
  std::optional<Vector> place(std::uint32_t vertex) const;
  // Stores the normalized positions of all corners of a face in `out`. Returns false if a
  // coordinate is not finite.
  bool place(std::span<const std::uint32_t> face, std::vector<Vector>& out) const;
  // Projects a result of place().
  RasterPoint seen(const Vector& place) const;

  // right(), up() and view() return vectors of length 1, which are perpendicular to each other.
  // view() points to the viewer.
  const Vector& right() const { return right_; }
  const Vector& up() const { return up_; }
  const Vector& view() const { return view_; }

 private:
  void measure();
  std::optional<Vector> normal_of_plane() const;
  void turn(const Vector& view, std::size_t up);
  void fit(const PictureFrame& frame);

  const Surface& surface_;
  Vector middle_{};
  double half_ = 1;  // half the length of the largest side
  Vector right_{}, up_{}, view_{};
  double scale_ = 1;  // raster position units per unit of normalized coordinates
  double left_ = 0, top_ = 0;
};

}  // namespace shm::converters
