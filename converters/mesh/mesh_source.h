// MeshSource: the interface through which the converters access every mesh, whatever file it comes
// from. A format provides `open_X(path) -> MeshSource` and `write_X(MeshSource&, path)`.
// Compression, verification and conversion use only this interface and are independent of formats.
//
// Vertex and cell numbers are those of the source and start at 0: vertex i is the i-th vertex of
// the file, cell i the i-th cell in file order. Data is read on demand, so memory stays bounded
// even for large files. Errors are thrown as Failure (an Error with file and place); see failure.h.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/spool.h"
#include "shm/schema.h"

namespace shm::converters {

struct MeshInfo {
  Schema schema;  // description of the mesh: blocks, arrays, coordinate_type, source_format
  std::uint64_t vertices = 0;
  std::vector<std::uint64_t> block_cells;  // number of cells of each block
  std::vector<double> step_times;          // time of each time step
  std::vector<Extra> extras;               // all data that the other members cannot represent

  // segment_starts contains the number of the first cell of each segment, in coding order.
  // segment_connectivity contains the codec of the hexahedra of each segment. Both are empty unless
  // the mesh comes from a .shm file.
  std::vector<std::uint64_t> segment_starts;
  std::vector<ConnectivityCodec> segment_connectivity;

  std::uint64_t cells() const {
    std::uint64_t sum = 0;
    for (std::uint64_t n : block_cells) sum += n;
    return sum;
  }
  // Returns the number of elements of an array: the number of vertices, of cells in the blocks that
  // the array covers, or ArrayInfo::elements.
  std::uint64_t array_elements(std::size_t array) const {
    const ArrayInfo& info = schema.arrays[array];
    if (info.location == Location::point) return vertices;
    if (!is_on_mesh(info.location)) return info.elements;
    if (info.blocks.empty()) return cells();
    std::uint64_t sum = 0;
    for (const std::uint32_t b : info.blocks) sum += b < block_cells.size() ? block_cells[b] : 0;
    return sum;
  }
  // Returns the size in bytes of one element of an array.
  std::size_t array_stride(std::size_t array) const {
    const ArrayInfo& info = schema.arrays[array];
    return scalar_bytes(info.type) * info.components;
  }
};

// Consecutive cells in file order. Cells of different blocks may alternate.
struct CellBatch {
  std::vector<std::uint32_t> blocks;  // block index of each cell
  // Offset of the first corner of each cell in `corners`, followed by corners.size().
  std::vector<std::uint64_t> corner_begin;
  std::vector<std::uint64_t> corners;  // vertex numbers, all less than the number of vertices
  std::size_t size() const { return blocks.size(); }
  std::span<const std::uint64_t> cell(std::size_t i) const {
    return std::span(corners).subspan(corner_begin[i], corner_begin[i + 1] - corner_begin[i]);
  }
  void clear() {
    blocks.clear();
    corners.clear();
    corner_begin.assign(1, 0);
  }
};

/// Number of cells per batch in loops over all cells.
inline constexpr std::size_t kCellsAtOnce = 8192;

class MeshSource {
 public:
  virtual ~MeshSource() = default;
  virtual const MeshInfo& info() const = 0;
  // Fills `out` with count * 3 coordinates (x, y, z of each vertex), of type
  // schema.coordinate_type, in host byte order.
  virtual void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) = 0;
  // Reads at most `max_cells` cells into `out`. If no cells are left, leaves `out` empty and
  // returns false.
  virtual bool next_cells(CellBatch& out, std::size_t max_cells) = 0;
  virtual void rewind_cells() = 0;
  // Makes cell `first` the next cell that next_cells() reads. Formats without random access read
  // all cells before cell `first`.
  virtual void seek_cells(std::uint64_t first) {
    rewind_cells();
    CellBatch batch;
    for (std::uint64_t cell = 0; cell < first; cell += batch.size())
      if (!next_cells(batch, std::min<std::uint64_t>(first - cell, kCellsAtOnce))) return;
  }
  // Reads `count` elements of an array, starting at element `first`, in file order. Element i of a
  // cell array belongs to the i-th cell in the blocks that the array covers; element i of an array
  // on sets to the i-th member of the sets that the array covers. `step` is 0 for a static array.
  virtual void read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                          std::uint64_t count, std::byte* out) = 0;
};

// Throws Failure (over_limit) if a mesh exceeds `limits`. `name` is the name of the mesh in the
// error message. Cells in blocks with a varying number of nodes are counted as if they had no
// nodes.
void require_within(const MeshLimits& limits, const MeshInfo& info, const std::string& name);
// Throws Failure (over_limit) if the given sizes exceed `limits`. `bytes` is the total size of all
// coordinates, corners and arrays.
void require_within(const MeshLimits& limits, std::uint64_t vertices, std::uint64_t cells,
                    std::uint64_t bytes, const std::string& name);

// Returns the shape of the cells of a block as text, after their node scheme unless it is lagrange,
// e.g. "bezier hexahedron".
std::string kind_of_cells(const BlockInfo& block);

// Conversions between extras and text or integers.

// Returns the extra with this key, or null if none exists. Searches linearly (see ExtraIndex).
const Extra* find_extra(const MeshInfo& info, std::string_view key);

// Return the text or the integers of an extra. The result is empty if the extra has another type.
std::string text_of_extra(const Extra& extra);
std::vector<std::int64_t> integers_of_extra(const Extra& extra);

Extra text_extra(std::string key, std::string_view text);
Extra integers_extra(std::string key, const std::vector<std::int64_t>& values,
                     Reference refers = Reference::nothing);
Extra integers_extra(std::string key, const std::vector<std::int32_t>& values,
                     Reference refers = Reference::nothing);

}  // namespace shm::converters
