// Draws the surface of a mesh, shaded, with colours that represent element blocks or values. The
// picture is the same on every machine and with every compiler, because the floating-point code
// uses only sums, products, quotients and square roots, which IEEE 754 defines exactly.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "base/progress.h"
#include "picture/camera.h"
#include "picture/image.h"
#include "picture/legend.h"
#include "picture/shown_range.h"
#include "picture/surface.h"
#include "shm/result.h"

namespace shm::converters {

inline constexpr std::uint32_t kLeastPixels = 16;  // minimum width and height of a picture

struct PictureOptions {
  std::uint32_t width = 1024, height = 768;  // kLeastPixels..kMostPixels
  std::optional<Vector> view;                // direction to the viewer; if empty, Camera chooses it
  std::size_t up = 2;                        // axis that points up in the picture, 0..2

  // If true, outlines are drawn around all polygons, with lighter outlines around narrow polygons.
  // If false, outlines are drawn only around polygons that are several pixels wide.
  bool edges = false;
  // Limit for Raster::work(), the number of samples and rows visited. If it is empty, the limit is
  // 2^30 plus 1000 times the number of samples of the picture. Drawing then takes at most a second
  // or two.
  std::optional<std::uint64_t> most_work;
};

// Values that determine the colours of faces. Faces whose value is not finite are grey.
struct Colouring {
  std::string name;
  bool of_points = false;          // true if `values` are values of vertices, not of faces
  std::span<const double> values;  // borrowed
};

struct Picture {
  Image image;
  std::uint64_t drawn = 0;  // number of faces drawn
  // Number of faces that are not drawn, because they have no area or a vertex that is not finite.
  std::uint64_t skipped = 0;
  std::uint64_t covered = 0;        // number of pixels that faces cover; does not count the legend
  std::optional<ShownRange> range;  // range of the finite values
};

// Draws a picture. Needs 35 bytes per pixel in addition to the surface. Polygons are drawn as a fan
// of triangles around the corner with the lowest x (if equal, the lowest y, then z). If a polygon
// is concave or not planar, its drawing may therefore extend beyond the polygon. If all faces of a
// mesh are too narrow to cover a sample, their edges are drawn. Returns ErrorCode::over_limit if
// drawing would take too long because too many faces overlap. Thread safe.
Result<Picture> draw_picture(const Surface& surface, const PictureOptions& options,
                             const Colouring* colouring = nullptr, const Progress& progress = {});

}  // namespace shm::converters
