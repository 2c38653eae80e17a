// Writes surfaces as PLY, STL or OBJ files, using the writers of OpenMesh.
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

// File formats. PLY files are binary (little-endian), faces have up to 255 corners, and the face
// property `block` is the index of the element block. STL files are binary and contain triangles.
// OBJ files are text. All coordinates are float32, because OpenMesh's writers support no other
// type.
enum class SurfaceFormat : std::uint8_t { ply, stl, obj };

// Returns the format with the name `word`: "ply", "stl" or "obj". Returns nothing for any other
// word.
std::optional<SurfaceFormat> surface_format(std::string_view word);

// Returns true if this build has OpenMesh.
bool can_write_surfaces();

struct SurfaceColours {
  bool of_points = false;        // true if `colours` are colours of vertices, not of faces
  std::span<const Rgb> colours;  // borrowed
};

struct SurfaceFileOptions {
  SurfaceFormat format = SurfaceFormat::ply;
  // Target number of triangles, at least 1. If the target is set, all quads and polygons are split
  // into triangles, and the surface is decimated if it has more triangles than the target. Vertices
  // that remain keep their positions. If the target is not set, the surface is not decimated.
  std::optional<std::uint64_t> decimate;
  const SurfaceColours* colours = nullptr;  // borrowed; only PLY supports colours
};

struct WrittenSurface {
  std::uint64_t vertices = 0, faces = 0;  // counts of vertices and faces in the file
  // Number of triangles before decimation; 0 without decimation.
  std::uint64_t triangles_before = 0;
  std::uint64_t rounded = 0;  // number of vertices whose position is rounded to float32

  // Counts with the meanings that Polygons describes.
  std::uint64_t copies = 0, lines_and_points = 0, collapsed = 0, not_finite = 0;
};

// Converts a surface to polygons (see polygons_of()) and writes them to `out` sequentially. The
// caller commits `out`. Needs about 400 bytes per face in addition to the surface. Identical
// surfaces result in identical files. Not thread safe, because OpenMesh's writers are global
// objects.
//
// Returns ErrorCode::unsupported if the program was built without OpenMesh, over_limit if the
// surface is too large for OpenMesh, misuse if colours are requested for a format other than PLY,
// or an error of `out`.
Result<WrittenSurface> write_surface(const Surface& surface, const SurfaceFileOptions& options,
                                     ByteSink& out, const Progress& progress = {});

}  // namespace shm::converters
