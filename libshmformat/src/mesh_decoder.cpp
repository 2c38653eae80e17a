#include "mesh_decoder.h"

#include <algorithm>
#include <utility>

#include "bytes/checksum.h"

namespace shm {
namespace {

// A block stops at the first of these, so that a reader's memory stays small.
constexpr std::size_t kBlockCells = 4096;
constexpr std::uint64_t kBlockBytes = std::uint64_t{1} << 22;

}  // namespace

MeshDecoder::MeshDecoder(const Schema& schema, const ReadLimits& limits)
    : schema_(&schema), limits_(limits), streams_(schema), block_cells_(schema.blocks.size()) {
  vertex_bytes_ = 3 * scalar_bytes(schema.coordinate_type) + streams_.point_data_bytes();
  for (std::uint32_t b = 0; b < schema.blocks.size(); ++b) {
    std::size_t bytes = 0;
    for (std::uint32_t a : streams_.cell_arrays())
      if (schema.array_covers(a, b))
        bytes += scalar_bytes(schema.arrays[a].type) * schema.arrays[a].components;
    cell_bytes_.push_back(bytes);
  }
  pointers_.resize(std::max(streams_.point_arrays().size(), streams_.cell_arrays().size()));
}

Error MeshDecoder::damaged(std::string detail, ErrorCode code) const {
  return Error{code, std::move(detail), "group " + std::to_string(groups_), group_offset_, {}};
}

Result<void> MeshDecoder::begin_group(std::vector<std::byte> payload, std::uint64_t offset) {
  payload_ = std::move(payload);
  group_offset_ = offset;
  ByteReader in(payload_);
  if (!container::get(in, group_)) return damaged("the group header makes no sense");
  header_bytes_ = in.position();
  if (group_.first_cell != cells_ || group_.first_vertex != vertices_)
    return damaged("the group does not follow the one before it");
  if (group_.max_active_vertices > limits_.max_active_vertices)
    return damaged("needs " + std::to_string(group_.max_active_vertices) +
                       " active vertices, the limit is " +
                       std::to_string(limits_.max_active_vertices),
                   ErrorCode::over_limit);
  if (group_.decoded_bytes > limits_.max_group_bytes)
    return damaged("unpacks to " + std::to_string(group_.decoded_bytes) + " bytes, the limit is " +
                       std::to_string(limits_.max_group_bytes),
                   ErrorCode::over_limit);
  if (auto good = assign_streams(); !good) return good;
  cells_done_ = 0;
  vertices_done_ = loose_done_ = bytes_done_ = active_seen_ = 0;
  in_group_ = true;
  return {};
}

Result<void> MeshDecoder::assign_streams() {
  using container::StreamKind;
  const auto known = MeshStreams<RangeDecoder>::list(*schema_);
  for (RangeDecoder& coder : streams_.coders()) coder = RangeDecoder(std::span<const std::byte>());
  ByteReader in(std::span<const std::byte>(payload_).subspan(header_bytes_));
  std::size_t next = 0;
  for (const container::StreamEntry& entry : group_.streams) {
    const auto bytes = in.get_bytes(entry.bytes);
    const std::string name = container::stream_name(entry.kind);
    if (!in.ok()) return damaged(name + ": ends beyond the group");
    if (checksum(bytes) != entry.checksum) return damaged(name + ": checksum does not match");
    while (next < known.size() &&
           (known[next].kind != entry.kind ||
            (entry.kind == StreamKind::array && known[next].array != entry.array)))
      ++next;
    if (next == known.size()) return damaged(name + ": unknown or out of order");
    const bool values = entry.kind >= StreamKind::vertex_numbers;
    if (entry.kind == StreamKind::connectivity) {
      if (auto good = take_codec(entry.codec); !good) return good;
    } else if (entry.codec != (values ? container::Codec::predictive : codec_)) {
      return damaged(
          name + ": codec " + std::to_string(static_cast<int>(entry.codec)) + " is unknown here",
          ErrorCode::unsupported);
    }
    streams_.coders()[next++] = RangeDecoder(bytes);
    const std::string key =
        entry.kind == StreamKind::array ? array_stream_name(*schema_, entry.array) : name;
    stream_bytes_[key] += bytes.size();
  }
  if (in.left() != 0) return damaged("bytes are left over behind the last stream");
  if (group_.cells > 0 &&
      (group_.streams.empty() || group_.streams[0].kind != StreamKind::connectivity))
    return damaged("connectivity: missing");
  return {};
}

Result<void> MeshDecoder::take_codec(container::Codec codec) {
  using container::Codec;
  if (codec_ && *codec_ != codec) return damaged("connectivity: another codec than before");
  if (codec != Codec::paper && codec != Codec::rows)
    return damaged("connectivity: codec " + std::to_string(static_cast<int>(codec)) + " is unknown",
                   ErrorCode::unsupported);
  if (!codec_)
    streams_.connectivity().set_codec(codec == Codec::paper ? HexahedronCodec::paper
                                                            : HexahedronCodec::rows);
  codec_ = codec;
  return {};
}

Result<MeshBlock> MeshDecoder::next_block() {
  MeshBlock block;
  block.first_vertex = vertices_;
  block.first_cell = cells_;
  block.corner_begin.push_back(0);
  block.arrays.resize(schema_->arrays.size());
  const std::uint64_t bytes_before = bytes_done_;
  while (cells_done_ < group_.cells && block.cell_count() < kBlockCells &&
         bytes_done_ - bytes_before < kBlockBytes)
    if (auto good = decode_cell(block); !good) return good.error();
  while (cells_done_ == group_.cells && vertices_done_ < group_.vertices &&
         bytes_done_ - bytes_before < kBlockBytes) {
    if (bytes_done_ + vertex_bytes_ > group_.decoded_bytes)
      return damaged("unpacks to more than stated");
    ++loose_done_;
    const std::uint32_t slot = streams_.connectivity().add_loose_vertex();
    active_seen_ = std::max(active_seen_, streams_.connectivity().surface().active_vertices());
    name_vertex(slot);
    streams_.code_loose_number(slot, numbers_[slot]);
    if (auto good = decode_vertex(Stencil{}, slot, block); !good) return good.error();
    streams_.connectivity().remove_loose_vertex(slot);
  }
  if (cells_done_ == group_.cells && vertices_done_ == group_.vertices)
    if (auto good = end_group(); !good) return good.error();
  return block;
}

Result<void> MeshDecoder::decode_cell(MeshBlock& block) {
  CellTopology& cell = topology_;
  if (!streams_.code_cell(cell))
    return damaged("connectivity: cell " + std::to_string(cells_) + " makes no sense");
  active_seen_ = std::max(active_seen_, streams_.connectivity().surface().active_vertices());
  if (active_seen_ > group_.max_active_vertices) return damaged("more active vertices than stated");
  bytes_done_ += 8 * cell.slots.size() + cell_bytes_[cell.block];
  if (bytes_done_ + cell.new_positions.size() * vertex_bytes_ > group_.decoded_bytes)
    return damaged("unpacks to more than stated");

  for (std::uint32_t position : cell.new_positions) name_vertex(cell.slots[position]);
  streams_.code_vertex_numbers(cell, [&](std::uint32_t position) -> std::uint64_t& {
    return numbers_[cell.slots[position]];
  });
  Result<void> vertices;
  for_each_new_vertex(cell, cell.new_positions,
                      [&](std::uint32_t position, const Stencil& stencil) {
                        if (vertices)
                          vertices = decode_vertex(stencil, cell.slots[position], block);
                      });
  if (!vertices) return vertices;

  block.vertices_before_cell.push_back(block.vertex_count());
  block.cell_numbers.push_back(streams_.code_cell_number(0));
  block.cell_blocks.push_back(cell.block);
  const std::size_t begin = block.corners.size();
  block.corners.resize(begin + cell.slots.size());
  std::uint64_t last_use = 0;
  for (std::uint32_t i = 0; i < cell.slots.size(); ++i) {
    const std::uint32_t stored = cell.stored_position(i);
    block.corners[begin + stored] = numbers_[cell.slots[i]];
    if (cell.last_use[i] != 0) last_use |= std::uint64_t{1} << stored;
  }
  block.last_use.push_back(last_use);
  block.corner_begin.push_back(block.corners.size());

  grow_arrays(block, streams_.cell_arrays(), cell.block);
  streams_.code_cell_values(cell, pointers_);
  streams_.finish_cell(cell);
  hexahedra_ += cell.hexahedral ? 1 : 0;
  ++block_cells_[cell.block];
  ++cells_done_;
  ++cells_;
  return {};
}

Result<void> MeshDecoder::decode_vertex(const Stencil& stencil, std::uint32_t slot,
                                        MeshBlock& block) {
  if (vertices_done_ == group_.vertices) return damaged("more vertices than stated");
  const std::size_t xyz_bytes = 3 * scalar_bytes(schema_->coordinate_type);
  block.xyz.resize(block.xyz.size() + xyz_bytes);
  grow_arrays(block, streams_.point_arrays(), 0);
  MeshStreams<RangeDecoder>::VertexValues values;
  values.xyz = block.xyz.data() + block.xyz.size() - xyz_bytes;
  values.data = pointers_;
  streams_.code_vertex(stencil, slot, values);
  block.vertex_numbers.push_back(numbers_[slot]);
  bytes_done_ += vertex_bytes_;
  ++vertices_done_;
  ++vertices_;
  return {};
}

/// A new vertex's stream number, until its original one is known.
void MeshDecoder::name_vertex(std::uint32_t slot) {
  if (slot >= numbers_.size())
    numbers_.resize(std::max<std::size_t>(slot + 1, numbers_.size() * 2));
  numbers_[slot] = next_name_++;
}

/// Room for one more element of each array in `arrays`; leaves pointers to it in pointers_.
void MeshDecoder::grow_arrays(MeshBlock& block, const std::vector<std::uint32_t>& arrays,
                              std::uint32_t of_block) {
  for (std::size_t i = 0; i < arrays.size(); ++i) {
    const ArrayInfo& info = schema_->arrays[arrays[i]];
    pointers_[i] = nullptr;
    if (info.location == Location::cell && !schema_->array_covers(arrays[i], of_block)) continue;
    auto& bytes = block.arrays[arrays[i]];
    const std::size_t stride = scalar_bytes(info.type) * info.components;
    bytes.resize(bytes.size() + stride);
    pointers_[i] = bytes.data() + bytes.size() - stride;
  }
}

Result<void> MeshDecoder::end_group() {
  if (bytes_done_ != group_.decoded_bytes || active_seen_ != group_.max_active_vertices ||
      loose_done_ != group_.loose_vertices)
    return damaged("does not hold what its header states");
  max_active_vertices_ = std::max(max_active_vertices_, active_seen_);
  in_group_ = false;
  ++groups_;
  return {};
}

}  // namespace shm
