#include "picture/camera.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace shm::converters {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Reverses the normal of a plane if necessary, so that the plane is viewed from above, from the
// front or from the right, depending on the largest component of the normal.
Vector facing(Vector normal) {
  std::size_t along = 0;
  for (std::size_t i = 1; i < 3; ++i)
    if (std::fabs(normal[i]) > std::fabs(normal[along])) along = i;
  const bool turned = along == 1 ? normal[1] > 0 : normal[along] < 0;
  if (turned)
    for (double& part : normal) part = -part;
  return normal;
}

}  // namespace

std::optional<Vector> unit(const Vector& vector) {
  const double most = std::max({std::fabs(vector[0]), std::fabs(vector[1]), std::fabs(vector[2])});
  for (const double part : vector)
    if (!std::isfinite(part)) return std::nullopt;
  if (most == 0) return std::nullopt;
  // Scale the vector first, because squares of very large or very small numbers would overflow or
  // underflow.
  Vector scaled = {vector[0] / most, vector[1] / most, vector[2] / most};
  const double length = std::sqrt(dot(scaled, scaled));
  for (double& part : scaled) part /= length;
  return scaled;
}

Vector normal_of(std::span<const Vector> polygon) {
  Vector sum{};
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vector part = cross(minus(polygon[i - 1], polygon[0]), minus(polygon[i], polygon[0]));
    for (std::size_t c = 0; c < 3; ++c) sum[c] += part[c];
  }
  return sum;
}

Camera::Camera(const Surface& surface, const std::optional<Vector>& view, std::size_t up,
               const PictureFrame& frame)
    : surface_(surface) {
  measure();
  std::optional<Vector> from = view;
  if (!from) from = normal_of_plane();
  turn(unit(from.value_or(kUsualViews[up])).value_or(*unit(kUsualViews[up])), up);
  fit(frame);
}

void Camera::measure() {
  Vector least = {kInfinity, kInfinity, kInfinity}, most = {-kInfinity, -kInfinity, -kInfinity};
  for (std::size_t v = 0; v < surface_.vertices(); ++v) {
    const Vector point = {surface_.coordinate(v, 0), surface_.coordinate(v, 1),
                          surface_.coordinate(v, 2)};
    if (!std::isfinite(point[0]) || !std::isfinite(point[1]) || !std::isfinite(point[2])) continue;
    for (std::size_t i = 0; i < 3; ++i) {
      least[i] = std::min(least[i], point[i]);
      most[i] = std::max(most[i], point[i]);
    }
  }
  half_ = 0;
  for (std::size_t i = 0; i < 3 && least[0] <= most[0]; ++i) {
    // Divide by 2 before adding or subtracting, because sums and differences of very large numbers
    // may overflow.
    middle_[i] = least[i] / 2 + most[i] / 2;
    half_ = std::max(half_, most[i] / 2 - least[i] / 2);
  }
  if (!(half_ > 0)) half_ = 1;
}

bool Camera::place(std::span<const std::uint32_t> face, std::vector<Vector>& out) const {
  out.clear();
  for (const std::uint32_t corner : face) {
    const auto point = place(corner);
    if (!point) return false;
    out.push_back(*point);
  }
  return true;
}

std::optional<Vector> Camera::place(std::uint32_t vertex) const {
  Vector point;
  for (std::size_t i = 0; i < 3; ++i) {
    point[i] = surface_.coordinate(vertex, i);
    if (!std::isfinite(point[i])) return std::nullopt;
    // Clamp the result, because the rounding error of middle_ may be as large as the mesh if the
    // coordinates are denormal numbers.
    point[i] = std::clamp((point[i] - middle_[i]) / half_, -2.0, 2.0);
  }
  return point;
}

// Returns the normal of the plane that contains all vertices of the surface, or nothing if there is
// no such plane.
std::optional<Vector> Camera::normal_of_plane() const {
  constexpr double kThick = 1e-6;
  Vector normal{};
  std::vector<Vector> polygon;
  for (std::size_t f = 0; f < surface_.faces(); ++f) {
    if (surface_.face(f).size() < 3 || !place(surface_.face(f), polygon)) continue;
    const Vector of_face = normal_of(polygon);
    if (dot(of_face, of_face) > dot(normal, normal)) normal = of_face;
  }
  // Try the normal of the largest polygon first. Then try the three axes, because a mesh without
  // polygons may be flat along one of them.
  std::array<std::optional<Vector>, 4> tried = {unit(normal), Vector{0, 0, 1}, Vector{0, 1, 0},
                                                Vector{1, 0, 0}};
  std::array<double, 4> least, most;
  least.fill(kInfinity);
  most.fill(-kInfinity);
  for (std::size_t v = 0; v < surface_.vertices(); ++v) {
    const auto point = place(static_cast<std::uint32_t>(v));
    if (!point) continue;
    for (std::size_t t = 0; t < tried.size(); ++t) {
      if (!tried[t]) continue;
      const double along = dot(*tried[t], *point);
      least[t] = std::min(least[t], along);
      most[t] = std::max(most[t], along);
    }
  }
  for (std::size_t t = 0; t < tried.size(); ++t)
    if (tried[t] && most[t] - least[t] <= kThick) return facing(*tried[t]);
  return std::nullopt;
}

void Camera::turn(const Vector& view, std::size_t up) {
  view_ = view;
  constexpr double kAlong = .999;
  // If the viewing direction is parallel to the axis `up`, another axis must point up in the
  // picture: y, or z if `up` is y.
  if (std::fabs(view[up]) > kAlong) up = up == 1 ? 2 : 1;
  Vector above{};
  above[up] = 1;
  right_ = unit(cross(above, view_)).value_or(Vector{1, 0, 0});
  up_ = cross(view_, right_);
}

void Camera::fit(const PictureFrame& frame) {
  // Minimum width and height for which the scale is computed, in normalized coordinates (see
  // place()). This limits the scale if a mesh is seen edge-on and has almost no width or height.
  constexpr double kNarrow = 1e-9;
  std::array<double, 2> least = {kInfinity, kInfinity}, most = {-kInfinity, -kInfinity};
  for (std::size_t v = 0; v < surface_.vertices(); ++v) {
    const auto point = place(static_cast<std::uint32_t>(v));
    if (!point) continue;
    const std::array<double, 2> on = {dot(*point, right_), dot(*point, up_)};
    for (std::size_t i = 0; i < 2; ++i) {
      least[i] = std::min(least[i], on[i]);
      most[i] = std::max(most[i], on[i]);
    }
  }
  if (!(least[0] <= most[0])) least = most = {0, 0};
  constexpr auto kPlaces = static_cast<double>(kSubSamples * kSamples);  // position units per pixel
  const double width = frame.width * kPlaces, height = frame.height * kPlaces;
  scale_ = std::min(width / std::max(most[0] - least[0], kNarrow),
                    height / std::max(most[1] - least[1], kNarrow));
  left_ = frame.left * kPlaces + width / 2 - scale_ * (least[0] / 2 + most[0] / 2);
  top_ = frame.top * kPlaces + height / 2 + scale_ * (least[1] / 2 + most[1] / 2);
}

RasterPoint Camera::seen(const Vector& place) const {
  // Positions are clamped to -kFar..kFar.
  static constexpr double kFar = 1 << 24;
  const auto whole = [](double number) {
    return static_cast<std::int64_t>(std::clamp(number, -kFar, kFar) + kFar + .5) -
           static_cast<std::int64_t>(kFar);
  };
  return {whole(left_ + scale_ * dot(place, right_)), whole(top_ - scale_ * dot(place, up_)),
          dot(place, view_), 0};
}

}  // namespace shm::converters
