// MeshDecoder: chunk groups in, blocks of vertices and cells out, in coding order. Joins the
// segments: numbers go on, and what a segment imports an earlier one must have left. The mirror of
// mesh_encoder.h.
// spec: "Segments", "Decoding a group"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "segment_decoder.h"
#include "shm/reader.h"

namespace shm {

class MeshDecoder {
 public:
  /// `schema` is checked and borrowed.
  MeshDecoder(const Schema& schema, const ReadLimits& limits);

  /// Takes the payload of a group of `segment`. `offset`: of the chunk in the file, for complaints.
  Result<void> begin_group(std::vector<std::byte> payload, std::uint32_t segment,
                           std::uint64_t offset);
  bool in_group() const { return segment_ != nullptr && segment_->in_group(); }
  /// Must hold: in_group(). Some thousand cells at most.
  Result<MeshBlock> next_block();

  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t cells() const { return cells_; }
  std::uint64_t hexahedra() const { return hexahedra_; }
  std::uint64_t max_active_vertices() const { return max_active_vertices_; }
  std::uint64_t imported_vertices() const { return imported_vertices_; }
  /// The first cell of each segment so far.
  const std::vector<std::uint64_t>& segment_starts() const { return segment_starts_; }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }
  /// Bytes of each kind of stream so far, by the names of SizeReport.
  const std::map<std::string, std::uint64_t>& stream_bytes() const { return stream_bytes_; }

 private:
  Result<void> check_imports(const DecodedBlock& block);
  void count(const DecodedBlock& block);
  Error damaged(std::string detail, ErrorCode code = ErrorCode::corrupt) const;

  const Schema* schema_;
  ReadLimits limits_;
  std::unique_ptr<SegmentDecoder> segment_;
  std::uint64_t groups_ = 0, group_offset_ = 0;
  /// Vertices that a later segment may import, and the last segment that did.
  std::unordered_map<std::uint64_t, std::uint32_t> alive_;

  std::uint64_t vertices_ = 0, cells_ = 0, hexahedra_ = 0, max_active_vertices_ = 0,
                imported_vertices_ = 0;
  std::vector<std::uint64_t> segment_starts_;
  std::vector<std::uint64_t> block_cells_;
  std::map<std::string, std::uint64_t> stream_bytes_;
};

}  // namespace shm
