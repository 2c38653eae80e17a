// Functions that encode, decode and check a schema, encode and decode extras, and compute the
// totals of a mesh (element counts and value ranges).
// spec: "Schema", "Extras"
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "format/format.h"
#include "shm/blocks.h"
#include "shm/limits.h"
#include "shm/schema.h"

namespace shm {

void put(ByteWriter& out, const Schema& schema);
/// Returns the checksum of the encoded schema, i.e. of the bytes that put() writes.
std::uint32_t checksum_of(const Schema& schema);
/// Reads a schema. Fails with ErrorCode::corrupt if the bytes do not encode a schema. Fails with
/// ErrorCode::over_limit, before it allocates memory, if the schema has more blocks or arrays than
/// the limits allow, or needs more than max_unpacked_bytes. Does not check the values; call
/// check_schema() afterwards.
Result<void> get(ByteReader& in, Schema& schema, const ReadLimits& limits);
/// Return the memory in bytes that the object needs.
std::uint64_t bytes_of(const Schema& schema);
std::uint64_t bytes_of(const Extra& extra);
/// Checks the values of a schema. Fails with ErrorCode::misuse or over_limit if the schema is
/// invalid; the detail of the error states the reason.
Result<void> check_schema(const Schema& schema, const ReadLimits& limits = {});

/// Returns true if the schema has arrays with time steps.
bool has_steps(const Schema& schema);

// Reading and writing of extras. A chunk of version 0 contains one Extra. A chunk of version 1
// contains any number of extras, which are packed together.
// spec: "Extras"

void put(ByteWriter& out, const Extra& extra);
bool get(ByteReader& in, Extra& extra);

/// Returns the payload of a chunk of version 1. Precondition: there are at most kMostExtras extras.
/// With Packing::bounded, integers are not stored as differences. The memory for an Extra is then
/// never larger than the space that the Extra takes in the unpacked blob.
std::vector<std::byte> extras_payload(std::span<const Extra> extras,
                                      Packing packing = Packing::with_dictionary);
/// Returns the payload of a chunk of version 0.
std::vector<std::byte> extra_payload(const Extra& extra);
inline constexpr std::size_t kMostExtras = 65536;

/// Returns the extras of a chunk. Errors have no section and no offset. Fails with
/// ErrorCode::over_limit if the extras need more than `limit` bytes of memory.
Result<std::vector<Extra>> get_extras(std::span<const std::byte> payload, std::uint8_t version,
                                      std::uint64_t limit);

/// Returns the largest permitted size of the unpacked step times, in bytes.
inline std::uint64_t most_bytes_of_times(const ReadLimits& limits) {
  return std::min(limits.max_extra_bytes / 8, limits.max_steps) * 8;
}

// Totals: the part of the index that describes the whole mesh (container::Index without the
// entries). Readers and writers add up the totals, one group or one part at a time.
// spec: "Index and trailer"

/// Returns the totals of a file without groups.
inline container::Index totals_of_nothing(const Schema& schema) {
  container::Index totals;
  totals.block_cells.resize(schema.blocks.size());
  return totals;
}

/// Returns the number of elements of an array in a mesh with this number of vertices, and these
/// numbers of cells of each block.
inline std::uint64_t elements_of(const Schema& schema, std::size_t array, std::uint64_t vertices,
                                 std::span<const std::uint64_t> block_cells) {
  const ArrayInfo& info = schema.arrays[array];
  if (info.location == Location::point) return vertices;
  if (info.location != Location::cell) return info.elements;
  std::uint64_t cells = 0;
  for (std::uint32_t b = 0; b < block_cells.size(); ++b)
    if (schema.array_covers(array, b)) cells += block_cells[b];
  return cells;
}
inline std::uint64_t elements_of(const Schema& schema, const container::Index& totals,
                                 std::uint32_t array) {
  return elements_of(schema, array, totals.vertices, totals.block_cells);
}

struct ValueRange {
  double minimum,
      maximum;  ///< smallest and largest finite value; +inf and -inf if no value is finite
};
/// Returns the range of `count` scalars, which are `stride` bytes apart. Integers are rounded to
/// double.
ValueRange range_of(ScalarType type, const std::byte* values, std::size_t count,
                    std::size_t stride);

/// Position at which a segment begins.
struct SegmentStart {
  std::uint32_t segment = 0;
  /// Total number of cells and of vertices in all earlier segments.
  std::uint64_t first_cell = 0, first_vertex = 0;
};

/// States which parts of a group are decoded. Cells are always decoded.
struct DecodedParts {
  bool geometry = true;
  /// For each array of the schema: true if its values are decoded. If nullopt, all arrays are
  /// decoded.
  std::optional<std::vector<bool>> arrays{};
  /// True if stored vertex numbers are decoded even if the cells can be decoded without them.
  bool vertex_numbers = true;
  /// True if blocks include the vertices that an earlier segment owns (imported vertices), with
  /// their values.
  bool imported_vertices = false;
  /// True if step values will be decoded that are predicted from the neighbourhoods of vertices (or
  /// of cells). The decoder then determines these neighbourhoods, and includes more distant
  /// neighbours than the static values of the group need.
  bool vertex_neighbourhoods = false, cell_neighbourhoods = false;
  /// True if the decoded contents of each group are compared with its digest. Needs all values and
  /// the vertex numbers.
  bool digest = true;

  static DecodedParts without_values() {
    return {.geometry = false, .arrays = std::vector<bool>()};
  }
  bool has_all_values() const { return geometry && !arrays; }
  bool checks_digest() const { return digest && vertex_numbers && has_all_values(); }
  bool includes_array(std::uint32_t array) const {
    return !arrays || (array < arrays->size() && (*arrays)[array]);
  }
  bool includes(const container::StreamEntry& stream) const {
    if (stream.kind == container::StreamKind::geometry) return geometry;
    return stream.kind != container::StreamKind::array || includes_array(stream.array);
  }
  /// Returns, for each column of values, true if it is decoded. The first column is the geometry;
  /// the static arrays follow in schema order.
  std::vector<bool> columns(const Schema& schema) const;
  /// Returns true if at least one static array at this location (points or cells) is decoded.
  /// Coordinates count as a point array.
  bool includes_values_of(const Schema& schema, Location location) const;
};

// Size at which a tile ends: kTileCells cells, or kTileBytes bytes of unpacked values. A Reader
// returns one tile at a time. Frozen: part of the format.
inline constexpr std::uint64_t kTileCells = 4096;
inline constexpr std::uint64_t kTileBytes = std::uint64_t{1} << 22;

/// Returns an ArrayInfo that describes the coordinates.
ArrayInfo coordinates_info(const Schema& schema);
/// Finds the ends of the tiles while the caller visits the elements of a group one by one.
class TileEnds {
 public:
  /// Returns true if a tile ends before this element. Call this function before each cell and each
  /// unused vertex. `bytes` is the unpacked size in bytes of the group so far.
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
  // Number of cells in the current tile, and unpacked size in bytes of the group before this tile.
  std::uint64_t cells_ = 0, begin_ = 0;
};

/// Returns the size in bytes of the values that one vertex has in all static point arrays.
std::size_t point_data_bytes(const Schema& schema);
/// Returns, for each block, the size in bytes of the values that one cell has in all static cell
/// arrays.
std::vector<std::size_t> cell_data_bytes(const Schema& schema);
/// Returns the smallest and the largest finite coordinate of `count` points, by axis. `stride` is
/// the distance in bytes between consecutive points.
std::array<ValueRange, 3> box_of(ScalarType type, const std::byte* points, std::size_t count,
                                 std::size_t stride);

}  // namespace shm
