// MeshDecoder: chunk groups in, blocks of vertices and cells out, in coding order. Joins the
// segments: numbers go on, and what a segment imports an earlier one must have left. Segments are
// decoded one after the other, or by threads ahead of what is taken. The mirror of mesh_encoder.h.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "segment/segment_decoder.h"
#include "shm/reader.h"

namespace shm {

class MeshDecoder {
 public:
  /// `schema` is checked and borrowed.
  MeshDecoder(const Schema& schema, const ReadLimits& limits, const ReadOptions& options);

  /// The next group, of `segment`; its number is not looked at. Must hold: wants_group().
  Result<void> begin_group(container::GroupChunk chunk, std::uint32_t segment);
  /// Whether another group may begin before all blocks have been taken.
  bool wants_group() const { return queue_.wants_group(); }
  /// Whether blocks are there or coming.
  bool is_busy() const { return queue_.is_busy(); }
  /// The next block, some thousand cells at most. Null when nothing is there yet and `wait` is not
  /// set, or nothing is coming.
  Result<std::optional<MeshBlock>> next_block(bool wait);
  /// Takes the room of a block that was taken, for one to come.
  void reuse(MeshBlock&& block) { queue_.reuse(std::move(block)); }

  // What the blocks taken so far hold.
  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t cells() const { return cells_; }
  std::uint64_t hexahedra() const { return hexahedra_; }
  std::uint64_t max_active_vertices() const { return max_active_vertices_; }
  std::uint64_t imported_vertices() const { return imported_vertices_; }
  /// The first cell of each segment.
  const std::vector<std::uint64_t>& segment_starts() const { return segment_starts_; }
  /// How the cells of each segment are encoded.
  const std::vector<ConnectivityCodec>& segment_connectivity() const {
    return segment_connectivity_;
  }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Bytes of each kind of stream, by the names of SizeReport.
  const std::map<std::string, std::uint64_t>& stream_bytes() const { return stream_bytes_; }

 private:
  Result<void> begin_segment(std::uint32_t segment, std::uint64_t offset);
  void leave(const std::vector<std::uint64_t>& alive, std::uint32_t segment);
  Result<void> join(const DecodedBlock& block);
  Result<void> check_imports(const DecodedBlock& block);
  void count(const DecodedBlock& block);
  Error damaged(std::string detail, std::uint64_t group, std::uint64_t offset,
                ErrorCode code = ErrorCode::corrupt) const;

  const Schema* schema_;
  ReadLimits limits_;
  std::uint64_t groups_begun_ = 0;
  std::uint32_t segments_begun_ = 0;
  DecodingQueue queue_;

  /// Vertices that a later segment may import, and the last segment that did.
  std::unordered_map<std::uint64_t, std::uint32_t> alive_;
  std::uint64_t groups_ = 0;
  std::uint64_t vertices_ = 0, cells_ = 0, hexahedra_ = 0, max_active_vertices_ = 0,
                imported_vertices_ = 0;
  std::vector<std::uint64_t> segment_starts_;
  std::vector<ConnectivityCodec> segment_connectivity_;
  std::vector<std::uint64_t> block_cells_;
  std::map<std::string, std::uint64_t> stream_bytes_;
};

}  // namespace shm
