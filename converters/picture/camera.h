// Camera: projects the vertices of a mesh onto a picture, with parallel rays. The mesh is as large
// as the frame allows.
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
// Returns a normal vector whose length is twice the area of the polygon. For a polygon that is not
// plane, returns the sum over its fan of triangles.
Vector normal_of(std::span<const Vector> polygon);
// Scales a vector to length 1. Returns nothing if its length is 0 or not finite.
std::optional<Vector> unit(const Vector& vector);

// Default viewing directions, by the axis that points up: from the right, the front and above.
inline constexpr std::array<Vector, 3> kUsualViews = {{{1, -1, 2}, {1, 1, 2}, {1, -2, 1}}};

// The part of a picture that the mesh may fill, in pixels.
struct PictureFrame {
  std::uint32_t left = 0, top = 0, width = 0, height = 0;
};

class Camera {
 public:
  // Looks at the finite vertices of `surface`. `view`: direction to the viewer, of any length
  // except 0. Without it, a plane surface is viewed along its normal, and any other surface along
  // its direction in kUsualViews. `up`: 0 to 2, the axis that points up in the picture.
  Camera(const Surface& surface, const std::optional<Vector>& view, std::size_t up,
         const PictureFrame& frame);

  // Returns the position of a vertex in the coordinates of the drawing: relative to the middle of
  // the mesh, -1..1 along its largest side. Returns nothing if a coordinate is not finite.
  std::optional<Vector> place(std::uint32_t vertex) const;
  // Stores the positions of all corners of a face in `out`. Returns false if a coordinate is not
  // finite.
  bool place(std::span<const std::uint32_t> face, std::vector<Vector>& out) const;
  // Projects a result of place().
  RasterPoint seen(const Vector& place) const;

  // Return perpendicular vectors of length 1: to the right, up, and to the viewer.
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
  double scale_ = 1;  // number of raster units per unit of place()
  double left_ = 0, top_ = 0;
};

}  // namespace shm::converters
