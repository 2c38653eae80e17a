// CellSelection and ExtractRequest: the cells, vertices and arrays that a caller requests.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

namespace shm {

/// Selects the cells that meet every given condition; without conditions, all cells.
struct CellSelection {
  struct Range {
    std::uint64_t first = 0, end = 0;  ///< first, first + 1, ..., end - 1
  };
  /// Range of cell numbers, as in MeshBlock::cell_numbers.
  std::optional<Range> range{};
  /// Single cell numbers, as in MeshBlock::cell_numbers, ascending.
  std::optional<std::vector<std::uint64_t>> numbers{};
  /// Indices into Schema::blocks, ascending.
  std::optional<std::vector<std::uint32_t>> blocks{};
  /// Smallest x y z, largest x y z: selects cells with a vertex inside this box or on its faces.
  std::optional<std::array<double, 6>> box{};

  bool all() const { return !range && !numbers && !blocks && !box; }
};

struct ExtractRequest {
  CellSelection cells{};
  /// If given: selects these vertices (ascending numbers, as in MeshBlock::vertex_numbers) and no
  /// cells. The only condition for cells that may be given as well is a box; it then selects the
  /// vertices inside.
  std::optional<std::vector<std::uint64_t>> vertices{};
  /// Indices of the requested static arrays; not given: all.
  std::optional<std::vector<std::uint32_t>> arrays{};
  /// Requests coordinates. If false, MeshBlock::xyz is empty unless a condition needs coordinates.
  bool coordinates = true;
  /// Also selects vertices that no cell uses, from all segments that are read for the cells and
  /// from all segments without cells. (The Writer codes such vertices after the last cell, unless
  /// the caller adds them earlier.) They are always included if all cells are selected.
  bool unused_vertices = false;
};

}  // namespace shm
