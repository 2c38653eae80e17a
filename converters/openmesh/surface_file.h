// Surfaces as files of other programs, written by OpenMesh: PLY, STL, OBJ.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "base/progress.h"
#include "picture/image.h"
#include "picture/surface.h"
#include "shm/io.h"
#include "shm/result.h"

namespace shm::converters {

// PLY: binary, little-endian; a face has up to 255 corners, and the index of its element block as
// the property `block`. STL: binary, triangles. OBJ: text. Coordinates are float32 in all of them:
// OpenMesh's writers have no others.
enum class SurfaceFormat : std::uint8_t { ply, stl, obj };

// "ply", "stl", "obj"; nothing for other words.
std::optional<SurfaceFormat> surface_format(std::string_view word);

// Whether this build has OpenMesh.
bool can_write_surfaces();

struct SurfaceColours {
  bool of_points = false;        // one for each vertex, and not for each face, of the surface
  std::span<const Rgb> colours;  // borrowed
};

struct SurfaceFileOptions {
  SurfaceFormat format = SurfaceFormat::ply;
  // As many triangles as are to be left; what has fewer stays as it is, but for quads and polygons,
  // which are split. Vertices that are left stay where they were. 1 or more.
  std::optional<std::uint64_t> decimate;
  const SurfaceColours* colours = nullptr;  // borrowed; PLY alone has a place for them
};

struct WrittenSurface {
  std::uint64_t vertices = 0, faces = 0;  // of the file
  std::uint64_t triangles_before = 0;     // decimation; 0: there was none
  std::uint64_t rounded = 0;              // vertices that are not where they were: float32
  // As Polygons has them.
  std::uint64_t copies = 0, lines_and_points = 0, collapsed = 0, not_finite = 0;
};

// Polygons as polygons_of() makes them of the surface, front to back into `out`, which is left to
// the caller to commit. Some 400 bytes a face beside the surface. The same bytes for the same
// surface. Not thread safe: OpenMesh's writers are one for all.
//   ErrorCode::unsupported: this build has no OpenMesh; over_limit: the surface is too large for
//   it;
// misuse: colours, and another format than PLY; and what `out` says.
Result<WrittenSurface> write_surface(const Surface& surface, const SurfaceFileOptions& options,
                                     ByteSink& out, const Progress& progress = {});

}  // namespace shm::converters
