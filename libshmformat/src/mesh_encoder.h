// MeshEncoder: vertices and cells in, chunk groups out. Holds what the active surface and the
// delay buffer need and nothing else. The mirror of mesh_decoder.h.
// spec: "Group"
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "coders/spiral_reorderer.h"
#include "front/id_map.h"
#include "mesh_streams.h"
#include "shm/writer.h"

namespace shm {

/// A group is closed early when it holds this much, so that readers can promise small memory.
inline constexpr std::uint64_t kFullGroupBytes = std::uint64_t{1} << 26;
inline constexpr std::uint64_t kFullGroupVertices = std::uint64_t{1} << 16;  // loose vertices alone

class MeshEncoder {
 public:
  /// Receives a finished group: header, and the bitstreams that it lists, in order.
  using GroupSink = std::function<Result<void>(const container::GroupHeader&,
                                               const std::vector<std::vector<std::byte>>&)>;

  /// `schema` is checked and borrowed.
  MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink);

  Result<void> add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                          std::span<const std::byte> data);
  Result<void> add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                 std::span<const std::byte> data);
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                        std::uint64_t last_use, std::span<const std::byte> data);
  Result<void> end();

  struct Totals {
    std::uint64_t vertices = 0, cells = 0, hexahedra = 0, max_active_vertices = 0;
    std::vector<std::uint64_t> block_cells;
    std::vector<container::ArrayRange> ranges;
  };
  const Totals& totals() const { return totals_; }

 private:
  /// A vertex that the caller may still name.
  struct Entry {
    std::uint64_t number = 0;
    std::uint32_t slot = kNone;  // on the active surface, once coded
    std::uint32_t waiting = 0;   // uses by cells in the delay buffer
    bool ends = false;           // no cell will use it but those waiting
  };
  struct WaitingCell {
    std::uint64_t number = 0;
    std::uint32_t block = 0;
    std::vector<std::uint32_t> entries;
    std::vector<std::byte> data;
  };

  Result<void> code(std::uint32_t handle);
  void take_vertices(const WaitingCell& cell, const CellTopology& topology);
  void code_vertex(const Stencil& stencil, std::uint32_t slot, std::uint32_t entry);
  std::uint32_t entry_at(const WaitingCell& cell, const CellTopology& topology,
                         std::uint32_t position) const {
    return cell.entries[topology.stored_position(position)];
  }
  void code_cell_data(WaitingCell& cell, const CellTopology& topology);
  Result<void> code_loose(std::uint32_t entry);
  void free_entry(std::uint32_t entry);
  Result<void> flush_group();
  void widen_range(std::size_t range, const ArrayInfo& info, const std::byte* element);

  const Schema* schema_;
  WriteOptions options_;
  GroupSink sink_;
  MeshStreams<RangeEncoder> streams_;
  SpiralReorderer reorderer_;

  std::vector<Entry> entries_;
  std::vector<std::byte> values_;  // xyz and point data of each entry
  std::vector<std::uint32_t> free_entries_;
  IdMap by_number_;
  std::size_t xyz_bytes_, values_bytes_;
  std::vector<std::size_t> cell_data_bytes_;  // by block
  bool has_edge_nodes_ = false;               // hexahedra whose edge nodes are predicted

  std::vector<WaitingCell> cells_;
  std::vector<std::uint32_t> free_cells_;
  CellTopology topology_;
  std::vector<std::byte*> pointers_;

  container::GroupHeader group_;
  Totals totals_;
  std::vector<std::size_t> range_of_array_;
};

}  // namespace shm
