// A picture of a mesh's surface: faces in the colours of their element blocks or of values, lit
// from where one looks, drawn one after the other. The same on every machine and with every
// compiler: of what rounds only sums, products, quotients and square roots are taken.
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

inline constexpr std::uint32_t kLeastPixels = 16;  // of a picture, across and down

struct PictureOptions {
  std::uint32_t width = 1024, height = 768;  // kLeastPixels..kMostPixels
  std::optional<Vector> view;                // from where one looks; nothing: as Camera has it
  std::size_t up = 2;                        // the axis that goes up on the picture, 0..2
  // Edges around all polygons, lighter ones around narrow ones; false: around those alone that are
  // some pixels wide.
  bool edges = false;
  // Samples and rows that may be looked at, as Raster::work() counts them. Nothing: a thousand
  // times all samples of the picture, and 2^30, which is a second or two.
  std::optional<std::uint64_t> most_work;
};

// What faces are coloured by instead of their blocks. What is not finite is grey.
struct Colouring {
  std::string name;
  bool of_points = false;          // a value for each vertex, and not for each face
  std::span<const double> values;  // borrowed
};

struct Picture {
  Image image;
  std::uint64_t drawn = 0;          // faces
  std::uint64_t skipped = 0;        // without an area, or with a vertex that is not finite
  std::uint64_t covered = 0;        // pixels, without those of the legend
  std::optional<ShownRange> range;  // of the finite values
};

// Takes 35 bytes for each pixel beside the surface. Polygons that are concave, or not plane, are
// drawn as a fan around the corner whose x, then y, then z is least, and may so cover what they do
// not. A mesh all of whose faces are too narrow for any sample is drawn by their edges.
// ErrorCode::over_limit: so many faces lie over each other that drawing would not end. May be
// called by several threads at a time.
Result<Picture> draw_picture(const Surface& surface, const PictureOptions& options,
                             const Colouring* colouring = nullptr, const Progress& progress = {});

}  // namespace shm::converters
