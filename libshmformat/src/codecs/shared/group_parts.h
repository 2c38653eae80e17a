// What all codecs of cells agree on: where a segment begins, which parts of a group are decoded,
// where tiles end, and how many bytes elements have.
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
  std::uint64_t first_cell = 0, first_vertex = 0;  ///< totals of all earlier segments
};

/// The parts of a group to decode. Cells are always decoded.
struct DecodedParts {
  bool geometry = true;
  std::optional<std::vector<bool>>
      arrays{};                ///< by array of the schema, true if included; nothing: all
  bool vertex_numbers = true;  ///< includes numbers that are stored and that no cell needs
  /// True if blocks include vertices that an earlier segment owns, with their values.
  bool imported_vertices = false;
  /// Neighbourhoods to find with the reach of step values, in addition to those that the values
  /// here need.
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
  /// By column of values, geometry first, then the static arrays in schema order: whether it is
  /// included.
  std::vector<bool> columns(const Schema& schema) const;
  /// Returns true if values of static arrays at this location are included; coordinates count as
  /// point values.
  bool includes_values_of(const Schema& schema, Location location) const;
};

// A tile ends before the element that follows this many cells or this many unpacked bytes. A Reader
// gives out one tile at a time. Frozen: part of the format.
inline constexpr std::uint64_t kTileCells = 4096;
inline constexpr std::uint64_t kTileBytes = std::uint64_t{1} << 22;

/// Returns the description of the coordinates as an array.
ArrayInfo coordinates_info(const Schema& schema);
/// Finds the ends of the tiles in a group, element by element.
class TileEnds {
 public:
  /// Returns true if a tile ends here. Call it before each cell and each unused vertex. `bytes`:
  /// unpacked bytes of the group so far.
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

/// Returns the bytes of the static point arrays in one vertex.
std::size_t point_data_bytes(const Schema& schema);
/// Returns the bytes of the static arrays in one cell, by block.
std::vector<std::size_t> cell_data_bytes(const Schema& schema);
/// Returns the smallest and the largest finite coordinate of `count` points, by axis. The points
/// are `stride` bytes apart.
std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride);

}  // namespace shm
