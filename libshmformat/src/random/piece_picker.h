// PiecePicker: copies the requested cells and vertices from decoded blocks to the piece (the
// requested part of the mesh), and records which segments contain values of these cells and
// vertices.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <unordered_set>
#include <vector>

#include "format/schema.h"
#include "random/indexed_file.h"
#include "random/number_set.h"
#include "random/piece_request.h"
#include "random/vertex_buffer.h"

namespace shm {

class PiecePicker {
 public:
  /// Vertex of the piece that was imported, i.e. that an earlier segment owns.
  struct Import {
    std::size_t segment = 0;  // index of the segment that imports the vertex
    std::array<double, 3> point{};
  };
  using Imports = std::map<std::uint64_t, Import>;  // imported vertices, by vertex number

  /// Creates a picker. All arguments except `parts` are borrowed.
  PiecePicker(const IndexedFile& file, const PieceRequest& request, const DecodedParts& parts);

  void begin_segment(std::size_t segment) { segment_ = segment; }
  /// Copies the requested part of the next block of the segment to piece(). `group` is the group to
  /// which the block belongs. The call may move the data out of `block`.
  Result<void> pick(MeshBlock& block, std::size_t group);
  void end_segment();
  /// Checks that every requested element has been found exactly once. Call this function after the
  /// last segment.
  Result<void> end_mesh();

  /// Returns the requested part of the most recent block.
  MeshBlock& piece() { return piece_; }
  /// Returns the number of elements found so far that meet all conditions of the request, ignoring
  /// its box.
  std::uint64_t found() const { return found_; }
  /// Returns the number of stored vertices that are in the box and that later cells may use.
  std::size_t waiting_in_box() const { return buffer_.in_box(); }

  // Return the number of vertices picked so far.
  std::uint64_t vertex_count() const { return vertices_.set.size(); }
  /// Return the numbers of the picked vertices and cells, in ascending order. Precondition:
  /// end_mesh() was called.
  const std::vector<std::uint64_t>& vertex_numbers() { return vertices_.all(); }
  const std::vector<std::uint64_t>& cell_numbers() { return cells_.all(); }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Returns the imported vertices whose owning segment has not been read.
  const Imports& imports() const { return imports_; }
  /// Return the segments that own picked vertices, and the segments that contain picked cells.
  const std::set<std::size_t>& point_segments() const { return point_segments_; }
  const std::set<std::size_t>& cell_segments() const { return cell_segments_; }

 private:
  Result<void> take_vertices(const MeshBlock& block, std::size_t& next, std::size_t end);
  Result<void> take_unused(const MeshBlock& block, std::size_t next);
  Result<void> pick_cell(const MeshBlock& block, std::size_t cell);
  void pick_cell_values(const MeshBlock& block, std::size_t cell, bool wanted);
  void give(VertexBuffer::Vertex& vertex);
  /// Set of numbers, with a sorted list of the numbers that is created on first request.
  struct Numbers {
    const std::vector<std::uint64_t>& all() {
      if (list.size() != set.size()) list = set.numbers();
      return list;
    }
    NumberSet set;
    std::vector<std::uint64_t> list;
  };

  const IndexedFile* file_;
  const PieceRequest* request_;
  VertexBuffer buffer_;
  std::vector<std::uint32_t> cell_arrays_;  // requested static cell arrays
  // For each requested cell array, the number of elements of the current block that have been read.
  std::vector<std::size_t> taken_;
  std::size_t segment_ = 0, group_ = 0;
  std::uint64_t found_ = 0;
  MeshBlock piece_;
  // Vertices of the piece that may also occur in other segments.
  std::unordered_set<std::uint64_t> shared_;

  Numbers vertices_, cells_;
  std::vector<std::uint64_t> block_cells_;
  Imports imports_;
  std::set<std::size_t> point_segments_, cell_segments_;
};

}  // namespace shm
