// SegmentEncoder: the cells of one segment in, bitstreams of groups out. It needs nothing of other
// segments, so several can work at once. The mirror of segment_decoder.h.
// spec: "Segments", "Group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "segment/group_values.h"
#include "segment/mesh_streams.h"
#include "shm/result.h"

namespace shm {

/// A group is closed early when it, or a stepped array in it at one step, holds this much, so that
/// readers can promise small memory.
inline constexpr std::uint64_t kFullGroupBytes = std::uint64_t{1} << 26;
inline constexpr std::uint64_t kFullGroupVertices = std::uint64_t{1} << 16;  // loose vertices alone

/// Some cells of a segment in coding order, each with the vertices that it is the first of its
/// segment to use. Flat arrays: a piece holds thousands of cells and is used again.
struct SegmentPiece {
  static constexpr std::uint32_t kLoose = kNone;
  struct Cell {
    std::uint64_t number = 0;
    std::uint64_t last_use = 0;
    std::uint32_t block = 0;  ///< kLoose: no cell, but a vertex that none uses
    std::uint32_t nodes = 0;
    std::uint32_t new_vertices = 0;
  };
  struct Vertex {
    std::uint64_t number = 0;  ///< the caller's
    std::uint32_t handle = 0;  ///< its name in `nodes`; free again when the vertex is finalized
    std::uint32_t ticket = kNone;
    bool imported = false;
  };
  std::vector<Cell> cells;
  std::vector<Vertex> vertices;
  std::vector<std::uint32_t> nodes;
  std::vector<std::byte> vertex_values;  ///< coordinates, then static point data
  std::vector<std::byte> cell_data;

  bool empty() const { return cells.empty(); }
  std::size_t bytes() const {
    return cells.size() * sizeof(Cell) + vertices.size() * sizeof(Vertex) + nodes.size() * 4 +
           vertex_values.size() + cell_data.size();
  }
  void clear() {
    cells.clear();
    vertices.clear();
    nodes.clear();
    vertex_values.clear();
    cell_data.clear();
  }
};

/// A group but for the numbers of its imported vertices, which another segment gives.
struct EncodedGroup {
  std::uint32_t segment = 0;
  container::GroupHeader header;
  std::vector<std::vector<std::byte>> streams;  ///< those that the header lists
  std::uint64_t hexahedra = 0;
  std::vector<container::ArrayRange> ranges;  ///< of the static arrays
  std::vector<std::uint64_t> cell_numbers;    ///< in coding order, if wanted

  struct Born {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
  };
  std::vector<Born> born;  ///< own vertices in order of birth, if wanted
  struct Import {
    std::uint32_t ticket = kNone, slot = 0;
    Stencil stencil;
  };
  std::vector<Import> imports;  ///< in order of birth; not in Order::keep

  std::size_t bytes() const {
    std::size_t sum =
        cell_numbers.size() * 8 + born.size() * sizeof(Born) + imports.size() * sizeof(Import);
    for (const auto& stream : streams) sum += stream.size();
    return sum;
  }
};

/// An empty group with room for as much as another one told.
inline EncodedGroup group_like(const EncodedGroup& before) {
  EncodedGroup group;
  group.cell_numbers.reserve(before.cell_numbers.size());
  group.born.reserve(before.born.size());
  return group;
}

/// How a segment is coded.
struct SegmentOptions {
  std::uint32_t group_cells = 65536;
  ConnectivityCodec codec = ConnectivityCodec::rows;
  Level level = Level::standard;  ///< of values
  bool values = true;             ///< false, to measure: coordinates and arrays are left out
  bool tells_order = true;        ///< whether groups tell `born` and `cell_numbers`
};

/// Codes a segment.
class SegmentEncoder {
 public:
  virtual ~SegmentEncoder() = default;
  /// Codes the cells of `piece`, and adds the groups that they complete to `done`.
  virtual Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) = 0;
  /// Adds the last group, if anything is left for it.
  virtual void end(std::vector<EncodedGroup>& done) = 0;
};
/// As the codec wants it. `schema` is checked and borrowed.
std::unique_ptr<SegmentEncoder> make_segment_encoder(const Schema& schema,
                                                     const SegmentOptions& options,
                                                     const SegmentStart& start);

/// Over the mesh: with an active surface, and neighbourhoods for the values.
class SurfaceSegmentEncoder final : public SegmentEncoder {
 public:
  SurfaceSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                        const SegmentStart& start);

  Result<void> take(const SegmentPiece& piece, std::vector<EncodedGroup>& done) override;
  void end(std::vector<EncodedGroup>& done) override;

 private:
  /// What a handle stands for.
  struct Handle {
    std::uint64_t number = 0;    // the caller's
    std::uint32_t slot = kNone;  // on the active surface, once coded
    std::uint32_t vertex = 0;    // in the piece at hand, until it is coded
  };
  /// A cell or loose vertex, and where its parts begin in the piece.
  struct Place {
    std::size_t node = 0, vertex = 0, data = 0;
  };

  void introduce(const SegmentPiece& piece, std::size_t first, std::size_t count);
  bool code_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell, const Place& at);
  void code_loose(const SegmentPiece& piece, std::size_t vertex);
  void code_new_vertices(const SegmentPiece& piece, const Place& at);
  void take_vertex(const SegmentPiece& piece, std::size_t vertex);
  bool holds_full_bytes() const;
  void note_active();
  void start_group();
  void flush_group(std::vector<EncodedGroup>& done);

  const Schema* schema_;
  std::uint32_t group_cells_;
  ConnectivityCodec codec_;
  Level level_;
  bool has_values_, tells_order_;
  SegmentStart start_;
  MeshStreams<RangeEncoder> streams_;
  // of the widest stepped array: what an element has at one step
  std::uint64_t vertex_step_bytes_ = 0, cell_step_bytes_ = 0;

  std::vector<Handle> handles_;
  CellTopology topology_;

  // of the group at hand
  GroupValues values_;
  TileEnds tile_ends_;

  EncodedGroup group_;
  std::uint64_t next_cell_, next_vertex_;
};

}  // namespace shm
