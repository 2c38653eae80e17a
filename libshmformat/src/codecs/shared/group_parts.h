// Definitions that all cell codecs share: where a segment begins, which parts of a group are
// decoded, where tiles end, and how many bytes an element has.
// spec: "Segments", "Group", "Tiles"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "format/format.h"
#include "format/schema.h"
#include "shm/schema.h"

namespace shm {

/// Where a segment begins.
struct SegmentStart {
  std::uint32_t segment = 0;
  /// Numbers of cells and vertices in all earlier segments
  std::uint64_t first_cell = 0, first_vertex = 0;
};

/// The parts of a group to decode. Cells are always decoded.
struct DecodedParts {
  bool geometry = true;
  /// Whether each array of the schema is included; without a value, all arrays are included
  std::optional<std::vector<bool>> arrays{};
  /// Whether to decode stored vertex numbers that are not needed to decode the cells
  bool vertex_numbers = true;
  /// True if blocks include the imported vertices, which an earlier segment owns, with their
  /// values.
  bool imported_vertices = false;
  /// True if neighbourhoods of vertices or cells are found with the reach that step values need, in
  /// addition to the neighbourhoods that the values of this group need.
  bool vertex_neighbourhoods = false, cell_neighbourhoods = false;

  static DecodedParts without_values() {
    return {.geometry = false, .arrays = std::vector<bool>()};
  }
  bool has_all_values() const { return geometry && !arrays; }
  bool includes_array(std::uint32_t array) const {
    return !arrays || (array < arrays->size() && (*arrays)[array]);
  }
  bool includes(const container::StreamEntry& stream) const {
    if (stream.kind == container::StreamKind::geometry) return geometry;
    return stream.kind != container::StreamKind::array || includes_array(stream.array);
  }
  /// Returns for each column of values whether it is included: first geometry, then the static
  /// arrays in schema order.
  std::vector<bool> columns(const Schema& schema) const;
  /// Returns true if values of static arrays at this location are included. Coordinates count as
  /// point values.
  bool includes_values_of(const Schema& schema, Location location) const;
};

// A tile ends when it has this many cells or this many bytes of unpacked values. A Reader returns
// one tile at a time. Frozen: part of the format.
inline constexpr std::uint64_t kTileCells = 4096;
inline constexpr std::uint64_t kTileBytes = std::uint64_t{1} << 22;

/// Returns the description of the coordinates as an array.
ArrayInfo coordinates_info(const Schema& schema);
/// Finds the ends of the tiles while the caller visits the elements of a group one by one.
class TileEnds {
 public:
  /// Returns true if a tile ends before this element. Call it before each cell and each unused
  /// vertex. `bytes`: unpacked size in bytes of the group so far.
  bool before(bool is_cell, std::uint64_t bytes) {
    const bool ends = (is_cell && cells_ == kTileCells) || bytes - begin_ >= kTileBytes;
    if (ends) {
      cells_ = 0;
      begin_ = bytes;
    }
    cells_ += is_cell ? 1 : 0;
    return ends;
  }

 private:
  std::uint64_t cells_ = 0,
                begin_ = 0;  // cells of the tile so far; bytes of the group before the tile
};

/// Returns the size in bytes of the static point arrays in one vertex.
std::size_t point_data_bytes(const Schema& schema);
/// Returns the size in bytes of the static arrays in one cell, by block.
std::vector<std::size_t> cell_data_bytes(const Schema& schema);
/// Returns the smallest and the largest finite coordinate of `count` points, by axis. `stride`:
/// distance in bytes between consecutive points.
std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride);

}  // namespace shm
