// MeshDecoder: chunk groups in, blocks of vertices and cells out. The mirror of mesh_encoder.h.
// spec: "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mesh_streams.h"
#include "shm/reader.h"

namespace shm {

class MeshDecoder {
 public:
  /// `schema` is checked and borrowed.
  MeshDecoder(const Schema& schema, const ReadLimits& limits);

  /// Takes a group's payload. `offset`: of the chunk in the file, for complaints.
  Result<void> begin_group(std::vector<std::byte> payload, std::uint64_t offset);
  bool in_group() const { return in_group_; }
  /// Must hold: in_group(). Some thousand cells at most.
  Result<MeshBlock> next_block();

  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t cells() const { return cells_; }
  std::uint64_t hexahedra() const { return hexahedra_; }
  std::uint64_t max_active_vertices() const { return max_active_vertices_; }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Bytes of each kind of stream so far, by the names of SizeReport.
  const std::map<std::string, std::uint64_t>& stream_bytes() const { return stream_bytes_; }

 private:
  Result<void> decode_cell(MeshBlock& block);
  Result<void> decode_vertex(const Stencil& stencil, std::uint32_t slot, MeshBlock& block);
  Result<void> end_group();
  Result<void> assign_streams();
  Result<void> take_codec(container::Codec codec);
  void name_vertex(std::uint32_t slot);
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  void grow_arrays(MeshBlock& block, const std::vector<std::uint32_t>& arrays,
                   std::uint32_t of_block);

  const Schema* schema_;
  ReadLimits limits_;
  MeshStreams<RangeDecoder> streams_;
  std::vector<std::uint64_t> numbers_;     // of live vertices, by slot
  std::optional<container::Codec> codec_;  // of the connectivity
  CellTopology topology_;
  std::vector<std::byte*> pointers_;
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // static cell data by block

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  bool in_group_ = false;
  std::uint64_t next_name_ = 0;  // stream number of the next vertex
  std::uint64_t group_offset_ = 0, groups_ = 0;
  std::uint32_t cells_done_ = 0;
  std::uint64_t vertices_done_ = 0, loose_done_ = 0, bytes_done_ = 0, active_seen_ = 0;

  std::uint64_t vertices_ = 0, cells_ = 0, hexahedra_ = 0, max_active_vertices_ = 0;
  std::vector<std::uint64_t> block_cells_;
  std::map<std::string, std::uint64_t> stream_bytes_;
};

}  // namespace shm
