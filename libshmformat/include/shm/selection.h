// CellSelection and ExtractRequest: describe the cells, vertices and arrays that a caller requests.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace shm {

/// Selects the cells that meet all given conditions. Without conditions, all cells are selected.
struct CellSelection {
  struct Range {
    std::uint64_t first = 0, end = 0;  ///< range of the numbers first, first + 1, ..., end - 1
  };
  /// Selects the cells whose numbers (MeshBlock::cell_numbers) are in this range.
  std::optional<Range> range{};
  /// Selects the cells with these numbers (MeshBlock::cell_numbers, ascending).
  std::optional<std::vector<std::uint64_t>> numbers{};
  /// Selects the cells of these blocks (indices into Schema::blocks, ascending).
  std::optional<std::vector<std::uint32_t>> blocks{};
  /// Selects the cells with at least one vertex inside this box or on its faces. The box is given
  /// as minimum x, y, z, then maximum x, y, z.
  std::optional<std::array<double, 6>> box{};

  bool all() const { return !range && !numbers && !blocks && !box; }
};

struct ExtractRequest {
  CellSelection cells{};
  /// If set: selects these vertices (ascending numbers, as in MeshBlock::vertex_numbers) and no
  /// cells. In that case, the only condition that the CellSelection may contain is a box; only the
  /// vertices inside the box are selected.
  std::optional<std::vector<std::uint64_t>> vertices{};
  /// Indices of the requested static arrays. If not set, all static arrays are requested.
  std::optional<std::vector<std::uint32_t>> arrays{};
  /// Requests coordinates. If false, MeshBlock::xyz is empty unless a condition needs coordinates.
  bool coordinates = true;
  /// Also selects vertices that no cell uses. Such vertices are returned from the segments that are
  /// read for the selected cells, and from all segments without cells. (The Writer codes such
  /// vertices after the last cell, unless its caller adds them earlier.) These vertices are always
  /// included if all cells are selected.
  bool unused_vertices = false;
};

}  // namespace shm
