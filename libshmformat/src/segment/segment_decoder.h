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

#include "segment/decoded_block.h"
#include "segment/mesh_streams.h"
#include "segment/shift_segment_decoder.h"
#include "segment/wanted_values.h"

namespace shm {

class SegmentDecoder {
 public:
  enum class Imports { left_out, yielded };

  /// `schema` is checked and borrowed.
  SegmentDecoder(const Schema& schema, const ReadLimits& limits, std::uint32_t segment,
                 Imports imports = Imports::left_out);
  SegmentDecoder(const SegmentDecoder&) = delete;  // its shifts borrow the group's header
  SegmentDecoder& operator=(const SegmentDecoder&) = delete;

  /// Values that are not wanted stay undecoded, and their streams unseen. Before the first group.
  void want(WantedValues wanted) { wanted_ = std::move(wanted); }

  /// Takes a group's payload. `offset` of the chunk and `group`, its number, are for complaints.
  Result<void> begin_group(std::vector<std::byte> payload, std::uint64_t offset,
                           std::uint64_t group);
  bool in_group() const { return in_group_; }
  /// Must hold: in_group(). Some thousand cells at most.
  Result<DecodedBlock> next_block();

  /// What the group says that began last.
  const container::GroupHeader& group() const { return group_; }
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
  Result<void> next_cells(DecodedBlock& block);
  template <class Take>
  Result<void> for_each_stream(Take&& take);
  Result<void> assign_streams();
  Result<void> assign_shift_streams();
  Result<void> take_codec(container::Codec codec);
  bool has_shifts() const { return connectivity_ == ConnectivityCodec::shifts; }
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;
  Vertex& vertex_at(std::uint32_t slot);

  const Schema* schema_;
  ReadLimits limits_;
  SegmentStart start_;
  Imports imports_;
  WantedValues wanted_;
  bool begun_ = false;
  std::unique_ptr<ShiftSegmentDecoder> shifts_;         // from the first group on, if it has shifts
  std::unique_ptr<MeshStreams<RangeDecoder>> streams_;  // from the first group on, if it has not
  std::vector<Vertex> vertices_;
  ConnectivityCodec connectivity_ = ConnectivityCodec::automatic;
  std::optional<container::Codec> codec_;  // of the connectivity
  CellTopology topology_;
  std::vector<std::uint8_t> left_out_;  // of the vertices of the tile at hand
  std::size_t vertex_bytes_ = 0;
  std::vector<std::size_t> cell_bytes_;  // static cell data by block

  std::vector<std::byte> payload_;
  container::GroupHeader group_;
  std::size_t header_bytes_ = 0;
  bool in_group_ = false;
  std::uint64_t group_offset_ = 0, group_number_ = 0;
  std::map<std::string, std::uint64_t> stream_bytes_;
  GroupProgress done_;

  std::uint64_t next_cell_ = 0, next_vertex_ = 0;
};

}  // namespace shm
