// Layout diagrams: how coherently a mesh is stored, at a glance (Isenburg & Lindstrom 2005).
// Cells run along x in file order, vertices along y; each vertex draws a horizontal segment
// from its first to its last cell. The most segments that a vertical line cuts are the width:
// what a streaming compressor must remember at once. Vertex compaction only permutes the
// segments vertically: the width stays, and the picture shows how narrow the mesh can flow.
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

// For each bin the share of its vertices whose segments pass, 0 (none) to kLevels (nearly all).
struct LayoutRaster {
  static constexpr std::uint8_t kLevels = 4;
  std::size_t rows = 0, columns = 0;
  std::vector<std::uint8_t> level;  // row-major
};

struct Layout {
  std::uint64_t vertices = 0, cells = 0;
  std::uint64_t width = 0;          // most vertices in use at one cell
  std::uint64_t width_at_cell = 0;  // the first cell where that many are in use
  LayoutRaster stored;              // vertices as numbered in the file
  LayoutRaster compacted;           // vertices in order of first use
};

Layout measure_layout(MeshSource& mesh, Spool& spool, const Progress& progress = {});

// What the diagram shows, in words. `saved`: the share of the file that --order free would save,
// where that was measured.
std::string layout_verdict(const Layout& layout, std::optional<double> saved);
// Whether the cells are scattered so that another order may save much.
bool is_scattered(const Layout& layout);

// A picture of both diagrams side by side. `title`: name of the mesh.
std::string layout_svg(const Layout& layout, const std::string& title);

// The same picture as PNG. Throws Failure (misuse) where the tool was built without librsvg.
bool has_png();
std::vector<std::byte> png_of_svg(const std::string& svg);

}  // namespace shm::converters
