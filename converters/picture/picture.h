// Draws the surface of a mesh: faces in the colours of their element blocks or of values, lit from
// the viewer, one after the other. The result is the same on every machine and with every compiler,
// because floating-point code uses only sums, products, quotients and square roots.
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
  std::optional<Vector> view;  // direction to the viewer; nothing: as chosen by Camera
  std::size_t up = 2;          // the axis that goes up on the picture, 0..2
  // true: outlines around all polygons, lighter around narrow ones. false: outlines only around
  // polygons that are some pixels wide.
  bool edges = false;
  // Maximum of samples and rows visited, as counted by Raster::work(). Default: a thousand times
  // the samples of the picture plus 2^30, which takes a second or two.
  std::optional<std::uint64_t> most_work;
};

// Values that determine the colours of faces, instead of their blocks. Values that are not finite
// are grey.
struct Colouring {
  std::string name;
  bool of_points = false;          // one value per vertex instead of per face
  std::span<const double> values;  // borrowed
};

struct Picture {
  Image image;
  std::uint64_t drawn = 0;          // faces
  std::uint64_t skipped = 0;        // faces without area, or with a vertex that is not finite
  std::uint64_t covered = 0;        // pixels, not counting the legend
  std::optional<ShownRange> range;  // range of the finite values
};

// Needs 35 bytes per pixel in addition to the surface. A polygon that is concave or not plane is
// drawn as a fan around the corner with the least x, then y, then z, so it may cover pixels outside
// of it. If all faces of a mesh are too narrow to cover a sample, their edges are drawn. Returns
// ErrorCode::over_limit if drawing would take too long because too many faces overlap. Thread safe.
Result<Picture> draw_picture(const Surface& surface, const PictureOptions& options,
                             const Colouring* colouring = nullptr, const Progress& progress = {});

}  // namespace shm::converters
