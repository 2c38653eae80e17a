// ValueStreams: coordinates and static arrays of one segment, each in its own bitstream. It follows
// the mesh cell by cell, collects the neighbourhoods of what comes, and codes the values of a tile
// (decoding) or of a whole group (encoding) at once.
// spec: "Tiles", "Value columns"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "bytes/lists.h"
#include "shm/schema.h"
#include "values/value_column.h"

namespace shm {

// A tile ends before the element that comes after so many cells, or so many unpacked bytes. It is
// what a Reader gives out at once. Frozen: part of the format.
inline constexpr std::uint64_t kTileCells = 4096;
inline constexpr std::uint64_t kTileBytes = std::uint64_t{1} << 22;

/// Coordinates, as if they were an array.
ArrayInfo coordinates_info(const Schema& schema);
/// Calls visit(info, blocks, repeats, tables) with what makes each ValueColumn of static values:
/// geometry, then the static arrays in schema order.
template <class Visit>
void for_each_static_column(const Schema& schema, Visit&& visit) {
  visit(coordinates_info(schema), std::vector<std::uint32_t>(), false, true);
  std::uint32_t room = kMostTableComponentsInAll - 3;  // for tables
  for (const ArrayInfo& info : schema.arrays) {
    if (info.per_step) continue;
    const bool tables = info.components <= std::min(kMostTableComponents, room);
    if (tables) room -= info.components;
    visit(info, info.blocks, true, tables);
  }
}

/// Finds where the tiles of a group end, element by element.
class TileEnds {
 public:
  /// Before each cell and each loose vertex; `bytes`: unpacked ones of the group until here.
  /// Whether the tile ends here.
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
  std::uint64_t cells_ = 0, begin_ = 0;  // of the tile: cells so far, bytes before it
};

template <class Coder>
class ValueStreams {
 public:
  /// `schema` is borrowed.
  explicit ValueStreams(const Schema& schema);

  // In step with the mesh: each cell, then its new vertices in order of birth, then its end.
  void begin_cell(const CellTopology& cell, std::uint64_t live);
  void add_vertex(const CellTopology& cell, std::uint32_t position) {
    push_tightly(vertices_.items, finder_.vertex(cell, position, vertex_reach_));
  }
  void end_cell(const CellTopology& cell);
  void add_loose_vertex(std::uint32_t slot) {
    push_tightly(vertices_.items, finder_.isolated(slot));
  }

  /// Column 0 is geometry, the others the static arrays in schema order.
  std::size_t columns() const { return columns_.size(); }
  /// The schema's index of the array in a column from 1 on.
  std::uint32_t array_of(std::size_t column) const { return arrays_[column - 1]; }

  /// Encoding, before the first cell: values will be said at this level.
  void expect_level(Level level) { vertex_reach_ = cell_reach_ = farthest_reach(level); }

  // Encoding: tiles, then each column, then the next group.
  void begin_tile();
  EncodedColumn encode(std::size_t column, const std::byte* values, std::size_t stride,
                       Level level);

  // Decoding: the group, all its columns, then tile by tile. `bytes` are borrowed for the group,
  // and may unpack to `limit` bytes; false for damaged data.
  void begin_group();
  bool takes(std::size_t column, ColumnCodec codec) const { return columns_[column].takes(codec); }
  bool begin_column(std::size_t column, ColumnCodec codec, std::span<const std::byte> bytes,
                    std::uint64_t limit);
  /// Values of what came since the last tile, appended to `out`; false for damaged data.
  bool decode_tile(std::size_t column, std::vector<std::byte>& out);
  /// Forgets what came: after the last column of a group (encoding) or tile (decoding).
  void clear();

 private:
  bool of_cells(std::size_t column) const;

  const Schema* schema_;
  std::vector<std::uint32_t> arrays_;
  bool has_cell_arrays_ = false;
  NeighbourFinder finder_;
  Reach vertex_reach_ = Reach::farther, cell_reach_ = Reach::farther;
  TiledItems vertices_, cells_;
  std::vector<ValueColumn<Coder>> columns_;
};

extern template class ValueStreams<SplitEncoder>;
extern template class ValueStreams<SplitDecoder>;

}  // namespace shm
