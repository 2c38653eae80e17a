#include "pipeline/mesh_decoder.h"

#include <algorithm>
#include <utility>

namespace shm {

MeshDecoder::MeshDecoder(const Schema& schema, const ReadLimits& limits, const ReadOptions& options)
    : schema_(&schema),
      limits_(limits),
      queue_(schema, limits, options),
      block_cells_(schema.blocks.size()) {}

Error MeshDecoder::damaged(std::string detail, std::uint64_t group, std::uint64_t offset,
                           ErrorCode code) const {
  return Error{code, std::move(detail), "group " + std::to_string(group), offset};
}

Result<void> MeshDecoder::begin_group(container::GroupChunk chunk, std::uint32_t segment) {
  if (segments_begun_ == 0 || segment + 1 != segments_begun_)
    if (auto status = begin_segment(segment, chunk.offset); !status) return status;
  chunk.number = groups_begun_++;
  return queue_.add_group(std::move(chunk));
}

Result<void> MeshDecoder::begin_segment(std::uint32_t segment, std::uint64_t offset) {
  if (segment != segments_begun_)
    return damaged("the segment is neither that of the previous group nor the next", groups_begun_,
                   offset);
  if (segment >= limits_.max_segments)
    return damaged("the file has more than " + std::to_string(limits_.max_segments) +
                       " segments, which is the limit",
                   groups_begun_, offset, ErrorCode::over_limit);
  ++segments_begun_;
  queue_.begin_segment(segment, segment);
  return {};
}

Result<std::optional<MeshBlock>> MeshDecoder::next_block(bool wait) {
  using Wait = DecodingQueue::Wait;
  while (true) {
    auto output = queue_.next(wait ? Wait::for_output : Wait::no);
    if (!output) return output.error();
    if (!*output) return std::optional<MeshBlock>();
    if (!(*output)->block) {
      leave((*output)->left_alive, static_cast<std::uint32_t>((*output)->segment));
      continue;
    }
    DecodedBlock& block = *(*output)->block;
    if (auto status = join(block); !status) return status.error();
    return std::optional<MeshBlock>(std::move(block.mesh));
  }
}

/// Records the end of `segment`. Later segments may import the vertices in `alive`, which the
/// segment has not finalized.
void MeshDecoder::leave(const std::vector<std::uint64_t>& alive, std::uint32_t segment) {
  for (std::uint64_t number : alive) alive_.insert_or_assign(number, segment);
}

/// Checks that the block continues where the last block ended, and counts its vertices and cells.
/// Readers of single parts, even of damaged files, do not check the box: a wrong box is no reason
/// to withhold intact data.
Result<void> MeshDecoder::join(const DecodedBlock& block) {
  if (block.segment.segment == segment_starts_.size()) {
    if (block.segment.first_cell != cells_ || block.segment.first_vertex != vertices_)
      return damaged("the group does not follow the one before it", groups_, block.offset);
    segment_starts_.push_back(cells_);
    segment_connectivity_.push_back(block.connectivity);
  } else if (segment_connectivity_.back() == ConnectivityCodec::automatic) {
    segment_connectivity_.back() = block.connectivity;  // replaces the entry of unused vertices,
                                                        // which came before the first cells
  }
  if (auto status = check_imports(block); !status) return status;
  if (block.group_end && !block.group_end->has_its_box)
    return damaged("its box is not that of its vertices", groups_, block.offset);
  count(block);
  return {};
}

/// Checks that the segment imports each vertex only once, and only vertices that earlier segments
/// have left alive.
Result<void> MeshDecoder::check_imports(const DecodedBlock& block) {
  for (std::uint64_t number : block.imported) {
    const auto found = alive_.find(number);
    if (found == alive_.end() || found->second == block.segment.segment)
      return damaged(
          "imports vertex " + std::to_string(number) + ", which no earlier segment has left alive",
          groups_, block.offset);
    found->second = block.segment.segment;
  }
  for (std::uint64_t number : block.finalized_imports) alive_.erase(number);
  return {};
}

void MeshDecoder::count(const DecodedBlock& block) {
  vertices_ += block.mesh.vertex_count();
  cells_ += block.mesh.cell_count();
  const std::vector<std::uint32_t>& blocks = block.mesh.cell_blocks;
  for (auto run = blocks.begin(); run != blocks.end();) {
    const auto end = std::find_if(run, blocks.end(), [&](std::uint32_t b) { return b != *run; });
    const auto cells = static_cast<std::uint64_t>(end - run);
    block_cells_[*run] += cells;
    if (is_hexahedral(schema_->blocks[*run])) hexahedra_ += cells;
    run = end;
  }
  if (!block.group_end) return;
  ++groups_;
  imported_vertices_ += block.group_end->imported_vertices;
  max_active_vertices_ = std::max(max_active_vertices_, block.group_end->max_active_vertices);
  for (const auto& [name, bytes] : block.group_end->stream_bytes) stream_bytes_[name] += bytes;
}

}  // namespace shm
