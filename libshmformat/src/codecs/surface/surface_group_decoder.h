// SurfaceGroupDecoder: decodes the groups of a segment whose codec keeps an active surface (live
// vertices and open faces). Its counterpart is surface_segment_encoder.h.
// spec: "Connectivity stream", "Value columns", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shared/group_decoder.h"
#include "codecs/surface/mesh_streams.h"

namespace shm {

class SurfaceGroupDecoder final : public GroupDecoder {
 public:
  SurfaceGroupDecoder(const Schema& schema, const SegmentStart& start, const DecodedParts& parts,
                      CellBytes cell_bytes);

  Result<void> begin_plain_stream(const container::StreamEntry& entry, Codec codec,
                                  std::span<const std::byte> bytes) override;
  Result<void> end_streams() override;
  void allow_memory(std::uint64_t bytes, std::uint64_t plenty) override {
    memory_.allow(bytes, plenty);
  }
  std::vector<std::uint64_t> alive() const override;
  Items items() const override { return {streams_.values().vertices(), streams_.values().cells()}; }
  std::uint32_t slots() const override { return slots_; }

 private:
  using Streams = MeshStreams<RangeDecoder, ColumnDecoder>;
  enum class Owner : std::uint8_t { nobody, own, earlier };
  /// A vertex on the active surface, stored by slot.
  struct Vertex {
    std::uint64_t number = 0;
    Owner owner = Owner::nobody;
  };

  Result<void> begin_streams(std::optional<ConnectivityCodec> codec) override;
  Result<void> begin_column(const container::StreamEntry& entry, Codec codec, std::size_t column,
                            std::span<const std::byte> bytes);
  bool begin_values(std::size_t column, Codec codec, std::span<const std::byte> bytes);
  Result<void> decode_elements(DecodedBlock& decoded) override;
  bool is_out_of_memory() const override { return memory_.is_refused(); }
  bool decode_column(std::size_t column, const MeshBlock& block,
                     std::vector<std::byte>& out) override;
  Result<void> decode_cell(DecodedBlock& decoded);
  void add_corners(DecodedBlock& decoded);
  Result<void> decode_new_vertices(DecodedBlock& decoded);
  Result<void> decode_vertex(std::uint32_t slot, DecodedBlock& decoded);
  Result<void> decode_import(std::uint32_t position, std::uint32_t slot, DecodedBlock& decoded);
  Result<void> decode_unused(DecodedBlock& decoded);
  Vertex& vertex_at(std::uint32_t slot) { return at_slot(vertices_, slot); }
  std::uint64_t active() { return streams_.connectivity().surface().active_vertices(); }

  ColumnMemory memory_;  // limit on the memory for data that columns store by slot
  Streams streams_;
  std::vector<Streams::Stream> listed_;
  std::vector<Vertex> vertices_;
  CellTopology topology_;
  std::uint32_t slots_ = 0;

  // Data of the current group
  std::size_t next_stream_ = 0;
  std::vector<bool> has_stream_;  // for each column: true if the group has a stream for it
};

}  // namespace shm
