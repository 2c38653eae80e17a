#include "mesh_decoder.h"

#include <algorithm>
#include <utility>

namespace shm {

MeshDecoder::MeshDecoder(const Schema& schema, const ReadLimits& limits)
    : schema_(&schema), limits_(limits), block_cells_(schema.blocks.size()) {}

Error MeshDecoder::damaged(std::string detail, ErrorCode code) const {
  return Error{code, std::move(detail), "group " + std::to_string(groups_), group_offset_, {}};
}

Result<void> MeshDecoder::begin_group(std::vector<std::byte> payload, std::uint32_t segment,
                                      std::uint64_t offset) {
  group_offset_ = offset;
  const bool begins = segment_starts_.empty() || segment + 1 != segment_starts_.size();
  if (begins) {
    if (segment != segment_starts_.size())
      return damaged("its segment is neither the one before it nor the next");
    if (segment >= limits_.max_segments)
      return damaged("the file has more than " + std::to_string(limits_.max_segments) +
                         " segments, which is the limit",
                     ErrorCode::over_limit);
    if (segment_)
      for (std::uint64_t number : segment_->alive()) alive_.insert_or_assign(number, segment - 1);
    segment_ = std::make_unique<SegmentDecoder>(*schema_, limits_, segment);
    segment_starts_.push_back(cells_);
  }
  if (auto good = segment_->begin_group(std::move(payload), offset, groups_); !good) return good;
  if (begins &&
      (segment_->start().first_cell != cells_ || segment_->start().first_vertex != vertices_))
    return damaged("the group does not follow the one before it");
  return {};
}

Result<MeshBlock> MeshDecoder::next_block() {
  auto block = segment_->next_block();
  if (!block) return block.error();
  if (auto good = check_imports(*block); !good) return good.error();
  count(*block);
  return std::move(block->mesh);
}

/// A segment imports what earlier ones have left alive, each vertex once.
Result<void> MeshDecoder::check_imports(const DecodedBlock& block) {
  const auto segment = static_cast<std::uint32_t>(segment_starts_.size() - 1);
  for (std::uint64_t number : block.imported) {
    const auto found = alive_.find(number);
    if (found == alive_.end() || found->second == segment)
      return damaged("imports vertex " + std::to_string(number) +
                     ", which no earlier segment has left to it");
    found->second = segment;
  }
  for (std::uint64_t number : block.finalized_imports) alive_.erase(number);
  return {};
}

void MeshDecoder::count(const DecodedBlock& block) {
  vertices_ += block.mesh.vertex_count();
  cells_ += block.mesh.cell_count();
  for (std::uint32_t b : block.mesh.cell_blocks) {
    const BlockInfo& info = schema_->blocks[b];
    ++block_cells_[b];
    hexahedra_ += info.shape == CellShape::hexahedron && info.nodes_per_cell >= 8 ? 1 : 0;
  }
  if (!block.group_end) return;
  ++groups_;
  imported_vertices_ += block.group_end->imported_vertices;
  max_active_vertices_ = std::max(max_active_vertices_, block.group_end->max_active_vertices);
  for (const auto& [name, bytes] : block.group_end->stream_bytes) stream_bytes_[name] += bytes;
}

}  // namespace shm
