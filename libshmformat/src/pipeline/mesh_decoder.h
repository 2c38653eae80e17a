// MeshDecoder: converts chunk groups to blocks of vertices and cells in coding order. It joins the
// segments: numbers continue from segment to segment, and a vertex that a segment imports must be
// left alive by an earlier segment. Segments are decoded one after the other, or in advance by
// threads. mesh_encoder.h is the counterpart.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "pipeline/segment_decoder.h"
#include "shm/blocks.h"
#include "shm/limits.h"

namespace shm {

class MeshDecoder {
 public:
  /// `schema` has passed check_schema() and must outlive the decoder.
  MeshDecoder(const Schema& schema, const ReadLimits& limits, const ReadOptions& options);

  /// Adds the next group, which belongs to `segment`. The group number in `chunk` is ignored. Must
  /// hold: wants_group().
  Result<void> begin_group(container::GroupChunk chunk, std::uint32_t segment);
  /// Returns true if another group may begin before all blocks have been taken.
  bool wants_group() const { return queue_.wants_group(); }
  /// Returns true if blocks are available, or will be without further groups.
  bool is_busy() const { return queue_.is_busy(); }
  /// Returns the next block, of some thousand cells at most. Returns nullopt if `wait` is not set
  /// and no block is available yet, or if there are no more blocks.
  Result<std::optional<MeshBlock>> next_block(bool wait);
  /// Reuses the memory of a block that the caller has finished with.
  void reuse(MeshBlock&& block) { queue_.reuse(std::move(block)); }

  // Return the numbers of vertices and cells in the blocks returned so far.
  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t cells() const { return cells_; }
  std::uint64_t hexahedra() const { return hexahedra_; }
  std::uint64_t max_active_vertices() const { return max_active_vertices_; }
  std::uint64_t imported_vertices() const { return imported_vertices_; }
  /// Returns the number of the first cell of each segment.
  const std::vector<std::uint64_t>& segment_starts() const { return segment_starts_; }
  /// Returns the codec of the cells of each segment.
  const std::vector<ConnectivityCodec>& segment_connectivity() const {
    return segment_connectivity_;
  }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Returns the coded bytes of each kind of stream, by the names that SizeReport uses.
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

  /// Vertices that a later segment may import. The value is the last segment that owned or imported
  /// the vertex.
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
