// Camera: where each vertex of a mesh is on a picture. Parallel rays, the mesh as large as the
// picture lets it be.
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
// Twice as long as its area; of one that is not plane, the sum of its fan's.
Vector normal_of(std::span<const Vector> polygon);
// Of length 1; nothing where it has no length or one that is no number.
std::optional<Vector> unit(const Vector& vector);

// From which one looks where nobody says it, by which axis goes up: from the right, from before,
// and from above.
inline constexpr std::array<Vector, 3> kUsualViews = {{{1, -1, 2}, {1, 1, 2}, {1, -2, 1}}};

// The part of a picture that the mesh may fill, in pixels.
struct PictureFrame {
  std::uint32_t left = 0, top = 0, width = 0, height = 0;
};

class Camera {
 public:
  // Looks at the vertices of `surface` that are finite. `view`: from where, of any length but 0;
  // nothing: kUsualViews, or what a surface that lies in a plane has for a normal. `up`: 0 to 2,
  // the axis that goes up on the picture.
  Camera(const Surface& surface, const std::optional<Vector>& view, std::size_t up,
         const PictureFrame& frame);

  // Coordinates as all that is drawn goes by them: from the middle of the mesh, -1..1 along its
  // largest side. Nothing where one is not finite.
  std::optional<Vector> place(std::uint32_t vertex) const;
  // Of all corners; false where one is not finite.
  bool place(std::span<const std::uint32_t> face, std::vector<Vector>& out) const;
  // Must hold: `place` is of a vertex of the surface.
  RasterPoint seen(const Vector& place) const;

  // Of length 1 and at right angles: to the right, up, and to who looks.
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
  double half_ = 1;  // of the largest side
  Vector right_{}, up_{}, view_{};
  double scale_ = 1;  // places on the raster to one of place()
  double left_ = 0, top_ = 0;
};

}  // namespace shm::converters
