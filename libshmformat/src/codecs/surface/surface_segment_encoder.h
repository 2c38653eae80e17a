// SurfaceSegmentEncoder: encodes the cells of a segment with a codec that keeps an active surface:
// the live vertices and open faces. It predicts values from neighbourhoods. Its counterpart is
// surface_group_decoder.h.
// spec: "Connectivity stream", "Value columns"
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "codecs/shared/segment_encoder.h"
#include "codecs/surface/mesh_streams.h"
#include "codecs/surface/plan/column_planner.h"

namespace shm {

class SurfaceSegmentEncoder final : public SegmentEncoder {
 public:
  /// `schema` must have passed check_schema() and must outlive the encoder.
  SurfaceSegmentEncoder(const Schema& schema, const SegmentOptions& options,
                        const SegmentStart& start);

 private:
  using Streams = MeshStreams<RangeEncoder, ColumnPlanner>;
  /// The vertex that a handle refers to.
  struct Handle {
    std::uint64_t number = 0;    // the caller's number of the vertex
    std::uint32_t slot = kNone;  // slot on the active surface (after the vertex has been encoded)
    std::uint32_t vertex =
        0;  // index in the current SegmentPiece (before the vertex has been encoded)
  };

  bool encode_cell(const SegmentPiece& piece, const SegmentPiece::Cell& cell,
                   const Place& place) override;
  void encode_unused(const SegmentPiece& piece, std::size_t vertex) override;
  void encode_streams() override;
  void add_size_at_hand(SegmentSize& size) override;
  std::uint64_t values_at_hand(RatedDomains* rated) override;
  void introduce(const SegmentPiece& piece, std::size_t first, std::size_t count);
  void encode_new_vertices(const SegmentPiece& piece, const Place& place);
  void begin_element(bool is_cell);
  void add_column(std::size_t stream);
  void add_symbols(std::size_t stream);
  std::uint64_t active() { return streams_.connectivity().surface().active_vertices(); }

  Streams streams_;
  std::vector<Streams::Stream> listed_;
  std::vector<Handle> handles_;
  StoredCell stored_;      // the current cell as added
  CellTopology topology_;  // the current cell as coded
};

}  // namespace shm
