// Surfaces in file formats of other programs, written by OpenMesh: PLY, STL, OBJ.
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

// File formats. PLY: binary, little-endian; a face has up to 255 corners, and the index of its
// element block as the property `block`. STL: binary, triangles. OBJ: text. All coordinates are
// float32, because OpenMesh's writers support no other type.
enum class SurfaceFormat : std::uint8_t { ply, stl, obj };

// Returns the format that "ply", "stl" or "obj" means, and nothing for other words.
std::optional<SurfaceFormat> surface_format(std::string_view word);

// Returns true if this build has OpenMesh.
bool can_write_surfaces();

struct SurfaceColours {
  bool of_points = false;        // true: one colour per vertex; false: one per face of the surface
  std::span<const Rgb> colours;  // borrowed
};

struct SurfaceFileOptions {
  SurfaceFormat format = SurfaceFormat::ply;
  // Number of triangles after decimation, at least 1. A surface with fewer triangles is not
  // decimated, but its quads and polygons are split. Vertices that remain keep their positions.
  std::optional<std::uint64_t> decimate;
  const SurfaceColours* colours = nullptr;  // borrowed; only PLY supports colours
};

struct WrittenSurface {
  std::uint64_t vertices = 0, faces = 0;  // numbers of vertices and faces in the file
  std::uint64_t triangles_before = 0;     // number of triangles before decimation; 0: no decimation
  std::uint64_t rounded = 0;              // number of vertices whose position is rounded to float32

  // Counts with the same meaning as in Polygons.
  std::uint64_t copies = 0, lines_and_points = 0, collapsed = 0, not_finite = 0;
};

// Writes the polygons of a surface (see polygons_of()) to `out`, front to back. The caller commits
// `out`. Needs about 400 bytes per face in addition to the surface. Equal surfaces give equal
// bytes. Not thread safe, because OpenMesh's writers are global.
//
// Returns ErrorCode::unsupported if this build has no OpenMesh; over_limit if the surface is too
// large for OpenMesh; misuse for colours with a format other than PLY; and the errors of `out`.
Result<WrittenSurface> write_surface(const Surface& surface, const SurfaceFileOptions& options,
                                     ByteSink& out, const Progress& progress = {});

}  // namespace shm::converters
