// Draws the surface of a mesh: one face after the other, in the colours of element blocks or of
// values, with light from the viewer. The result is the same on every machine and with every
// compiler, because floating-point code uses only sums, products, quotients and square roots.
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
  std::optional<Vector> view;                // direction to the viewer; nothing: Camera chooses it
  std::size_t up = 2;                        // axis that points up in the picture, 0..2

  // True: outlines are drawn around all polygons, lighter around narrow polygons. False: outlines
  // are drawn only around polygons that are several pixels wide.
  bool edges = false;
  // Maximum number of samples and rows visited, as counted by Raster::work(). Default: a thousand
  // times the samples of the picture plus 2^30; this takes a second or two.
  std::optional<std::uint64_t> most_work;
};

// Values that determine the colours of faces, instead of their blocks. Values that are not finite
// are grey.
struct Colouring {
  std::string name;
  bool of_points = false;          // true: one value per vertex; false: one value per face
  std::span<const double> values;  // borrowed
};

struct Picture {
  Image image;
  std::uint64_t drawn = 0;    // number of faces drawn
  std::uint64_t skipped = 0;  // number of faces without area, or with a vertex that is not finite
  std::uint64_t covered = 0;  // number of pixels that faces cover, not counting the legend
  std::optional<ShownRange> range;  // range of the finite values
};

// Draws a picture. Needs 35 bytes per pixel in addition to the surface. A polygon that is concave
// or not plane is drawn as a fan around the corner with the least x, then y, then z, so the drawing
// may extend beyond the polygon. If all faces of a mesh are too narrow to cover a sample, their
// edges are drawn. Returns ErrorCode::over_limit if drawing would take too long because too many
// faces overlap. Thread safe.
Result<Picture> draw_picture(const Surface& surface, const PictureOptions& options,
                             const Colouring* colouring = nullptr, const Progress& progress = {});

}  // namespace shm::converters
