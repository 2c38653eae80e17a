// SegmentDecoder: the groups of one segment in, blocks of vertices and cells out. It needs nothing
// of other segments, so several can work at once. The mirror of segment_encoder.h.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mesh_streams.h"
#include "shm/reader.h"

namespace shm {

/// What came out of one step of decoding.
struct DecodedBlock {
  MeshBlock mesh;
  SegmentStart segment;      ///< that it belongs to
  std::uint64_t offset = 0;  ///< of its group's chunk in the file
  ConnectivityCodec connectivity = ConnectivityCodec::automatic;
  /// Numbers of vertices of earlier segments: those that cells of this block are the first of their
  /// segment to use, and those that they finalize.
  std::vector<std::uint64_t> imported, finalized_imports;

  /// Comes with the last block of a group.
  struct GroupEnd {
    std::uint64_t imported_vertices = 0, max_active_vertices = 0;
    std::map<std::string, std::uint64_t> stream_bytes;  ///< by the names of SizeReport
  };
  std::optional<GroupEnd> group_end;
};

class SegmentDecoder {
 public:
  enum class Imports { left_out, yielded };

  /// `schema` is checked and borrowed.
  SegmentDecoder(const Schema& schema, const ReadLimits& limits, std::uint32_t segment,
                 Imports imports = Imports::left_out);

  /// Takes a group's payload. `offset` of the chunk and `group`, its number, are for complaints.
  Result<void> begin_group(std::vector<std::byte> payload, std::uint64_t offset,
                           std::uint64_t group);
  bool in_group() const { return in_group_; }
  /// Must hold: in_group(). Some thousand cells at most.
  Result<DecodedBlock> next_block();

  /// What the first group says. Must hold: begin_group() succeeded once.
  const SegmentStart& start() const { return start_; }
  /// Numbers of own vertices that are not finalized by now.
  std::vector<std::uint64_t> alive() const;

 private:
  enum class Owner : std::uint8_t { nobody, own, earlier };
  /// Of a vertex on the active surface, by slot.
  struct Vertex {
    std::uint64_t number = 0;
    Owner owner = Owner::nobody;
  };

  Result<void> decode_cell(DecodedBlock& block);
  Result<void> decode_new_vertices(DecodedBlock& block);
  Result<void> decode_vertex(std::uint32_t slot, MeshBlock& block);
  Result<void> decode_import(std::uint32_t position, std::uint32_t slot, DecodedBlock& block);
  Result<void> decode_values(MeshBlock& block);
  Result<void> end_group(DecodedBlock& block);
  Result<void> assign_streams();
  Result<void> take_codec(container::Codec codec);
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  Vertex& vertex_at(std::uint32_t slot);

  const Schema* schema_;
  ReadLimits limits_;
  SegmentStart start_;
  Imports imports_;
  std::unique_ptr<MeshStreams<RangeDecoder>> streams_;  // from the first group on
  std::vector<Vertex> vertices_;
  ConnectivityCodec connectivity_ = ConnectivityCodec::automatic;
  std::optional<container::Codec> codec_;  // of the connectivity
  CellTopology topology_;
  std::vector<char> left_out_;  // of the vertices of the tile at hand
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // static cell data by block

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;
  std::uint32_t cells_done_ = 0;
  std::uint64_t own_done_ = 0, imported_done_ = 0, loose_done_ = 0, bytes_done_ = 0,
                active_seen_ = 0;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

}  // namespace shm
