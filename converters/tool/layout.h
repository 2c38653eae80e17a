// Layout diagrams show at a glance how coherently a mesh is stored (Isenburg & Lindstrom 2005).
// Cells run along x in file order, vertices along y. Each vertex is a horizontal segment from its
// first to its last cell. The width is the largest number of segments that a vertical line cuts:
// the number of vertices that a streaming compressor must keep in memory at the same time. Vertex
// compaction only permutes the segments vertically: the width stays the same, and the picture shows
// how narrow the band of active vertices is.
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

// For each bin, the share of the vertices in its row whose segments pass through it, from 0 (none)
// to kLevels (nearly all).
struct LayoutRaster {
  static constexpr std::uint8_t kLevels = 4;
  std::size_t rows = 0, columns = 0;
  std::vector<std::uint8_t> level;  // one level per bin, row by row
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0;
  std::uint64_t width = 0;          // largest number of vertices in use at one cell
  std::uint64_t width_at_cell = 0;  // the first cell at which the width is reached
  LayoutRaster stored;              // vertices as numbered in the file
  LayoutRaster compacted;           // vertices in order of first use
};

Layout measure_layout(MeshSource& mesh, Spool& spool, const Progress& progress = {});

// Describes the diagram in words. `saved`: the share of the file that --order free would save, if
// it was measured.
std::string layout_verdict(const Layout& layout, std::optional<double> saved);
// Returns true if the cells are so scattered that another order may save much.
bool is_scattered(const Layout& layout);

// Draws both diagrams side by side. `title`: name of the mesh.
std::string layout_svg(const Layout& layout, const std::string& title);

// png_of_svg() converts the diagrams from SVG to PNG. has_png() returns whether librsvg is
// available. png_of_svg() throws Failure (misuse) if the tool was built without librsvg.
bool has_png();
std::vector<std::byte> png_of_svg(const std::string& svg);

}  // namespace shm::converters
