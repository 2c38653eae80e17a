// Draws layout diagrams, which show how coherently a mesh is stored (Isenburg & Lindstrom 2005).
// The x axis is the index of a cell in the file, the y axis the vertex number. For each vertex, a
// horizontal line segment extends from the first to the last cell that uses it. The width of a
// diagram is the largest number of segments that a vertical line crosses. It equals the number of
// vertices that a streaming compressor must keep in memory at the same time. A second diagram shows
// the vertices sorted by first use (compacted). Sorting only permutes the segments vertically: the
// width stays the same, and the diagram shows how narrow the band of active vertices is. A vertex
// is active at a cell if its segment passes through the column of this cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

inline constexpr std::size_t kLayoutBins = 500;  // rows and columns of one diagram

// A diagram divided into bins. The level of a bin shows how many vertices of its row have a segment
// that passes through the bin, from 0 (none) to kLevels (nearly all).
struct LayoutRaster {
  static constexpr std::uint8_t kLevels = 4;
  std::size_t rows = 0, columns = 0;
  std::vector<std::uint8_t> level;  // one level per bin, row by row
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0;
  std::uint64_t width = 0;          // maximum number of active vertices at one cell
  std::uint64_t width_at_cell = 0;  // index of the first cell with `width` active vertices
  LayoutRaster stored;              // vertices as numbered in the file
  LayoutRaster compacted;           // vertices in order of first use
};

Layout measure_layout(MeshSource& mesh, Spool& spool, const Progress& progress = {});

// Describes in words whether the mesh is stored coherently. `saved` is the fraction of the file
// size that --order free would save, if it was measured.
std::string layout_verdict(const Layout& layout, std::optional<double> saved);
// Returns true if cells that share vertices are so far apart that another order may save many
// bytes.
bool is_scattered(const Layout& layout);

// Draws both diagrams side by side as SVG. `title` is the name of the mesh.
std::string layout_svg(const Layout& layout, const std::string& title);

// png_of_svg() converts the diagrams from SVG to PNG. It needs librsvg. has_png() returns true if
// librsvg is available. If the tool was built without librsvg, png_of_svg() throws Failure
// (misuse).
bool has_png();
std::vector<std::byte> png_of_svg(const std::string& svg);

}  // namespace shm::converters
