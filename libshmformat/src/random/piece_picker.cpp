#include "random/piece_picker.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>

#include "base/errors.h"

namespace shm {
namespace {

void empty(MeshBlock& block, std::size_t arrays) {
  block = MeshBlock();
  block.corner_begin.push_back(0);
  block.arrays.resize(arrays);
}

/// Returns the requested static arrays at `location`.
std::vector<std::uint32_t> static_arrays(const Schema& schema, const DecodedParts& parts,
                                         Location location) {
  std::vector<std::uint32_t> arrays;
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    const ArrayInfo& info = schema.arrays[a];
    if (!info.per_step && info.location == location && parts.includes_array(a)) arrays.push_back(a);
  }
  return arrays;
}

}  // namespace

PiecePicker::PiecePicker(const IndexedFile& file, const PieceRequest& request,
                         const DecodedParts& parts)
    : file_(&file),
      request_(&request),
      buffer_(file.schema(), static_arrays(file.schema(), parts, Location::point), parts.geometry),
      cell_arrays_(static_arrays(file.schema(), parts, Location::cell)),
      block_cells_(file.schema().blocks.size()) {}

/// Copies the requested part of a block to piece_.
Result<void> PiecePicker::pick(MeshBlock& block, std::size_t group) {
  group_ = group;
  if (request_->all()) {
    piece_ = std::move(block);
    piece_.first_vertex = vertices_.set.size();
    piece_.first_cell = cells_.set.size();
    for (const std::uint64_t number : piece_.vertex_numbers) vertices_.set.add(number);
    for (const std::uint64_t number : piece_.cell_numbers) cells_.set.add(number);
    for (const std::uint32_t b : piece_.cell_blocks) ++block_cells_[b];
    return {};
  }
  empty(piece_, file_->schema().arrays.size());
  piece_.first_vertex = vertices_.set.size();
  piece_.first_cell = cells_.set.size();
  taken_.assign(cell_arrays_.size(), 0);
  std::size_t vertex = 0;
  for (std::size_t cell = 0; cell < block.cell_count(); ++cell) {
    if (auto status = take_vertices(block, vertex,
                                    static_cast<std::size_t>(block.vertices_before_cell[cell]));
        !status)
      return status;
    if (auto status = pick_cell(block, cell); !status) return status;
  }
  // No cell uses the remaining vertices of the block.
  if (request_->of_vertices()) return take_vertices(block, vertex, block.vertex_count());
  return request_->wants_unused() ? take_unused(block, vertex) : Result<void>();
}

/// Adds the vertices of a block from index `next` to index `end` - 1 to the buffer, which stores
/// them until cells use them. If vertices are requested, also adds the requested vertices to the
/// piece.
Result<void> PiecePicker::take_vertices(const MeshBlock& block, std::size_t& next,
                                        std::size_t end) {
  const std::size_t xyz_bytes = 3 * scalar_bytes(file_->schema().coordinate_type);
  const auto of_index = request_->widened(file_->groups()[group_].box);
  for (; next < end; ++next) {
    bool in_box = false;
    if (request_->box()) {
      const auto point =
          point_of(block.xyz.data() + next * xyz_bytes, file_->schema().coordinate_type);
      in_box = is_in(*request_->box(), point);
      for (std::size_t c = 0; c < 3; ++c)
        if (std::isfinite(point[c]) && (point[c] < of_index[c] || point[c] > of_index[3 + c]))
          return file_->wrong_index("has a box of group " + std::to_string(group_) +
                                    " that does not contain all of its vertices");
    }
    const std::uint64_t number = block.vertex_numbers[next];
    if (request_->of_vertices()) {
      if (block.imported[next] != 0 || !request_->includes_vertex(number)) continue;
      ++found_;
      if (request_->box() && !in_box) continue;
    }
    if (!buffer_.add(block, next, in_box))
      return corrupt("has vertex " + std::to_string(number) + " twice",
                     "segment " + std::to_string(segment_));
    if (!request_->of_vertices()) continue;
    give(*buffer_.find(number));
    buffer_.remove(number);
  }
  return {};
}

/// Adds to the piece all vertices of a block whose index is `next` or higher. No cell uses these
/// vertices.
Result<void> PiecePicker::take_unused(const MeshBlock& block, std::size_t next) {
  const std::size_t first = next;
  if (auto status = take_vertices(block, next, block.vertex_count()); !status) return status;
  for (std::size_t v = first; v < next; ++v) {
    VertexBuffer::Vertex& vertex = *buffer_.find(block.vertex_numbers[v]);
    if (!request_->box() || vertex.in_box) give(vertex);
    buffer_.remove(vertex.number);
  }
  return {};
}

Result<void> PiecePicker::pick_cell(const MeshBlock& block, std::size_t cell) {
  if (request_->of_vertices()) return {};
  const std::uint64_t number = block.cell_numbers[cell];
  const std::uint32_t in_block = block.cell_blocks[cell];
  const auto begin = static_cast<std::size_t>(block.corner_begin[cell]);
  const auto end = static_cast<std::size_t>(block.corner_begin[cell + 1]);
  const auto corners = std::span(block.corners).subspan(begin, end - begin);
  bool wanted = request_->includes(number, in_block);
  found_ += wanted ? 1 : 0;
  if (wanted && request_->box())
    wanted = std::any_of(corners.begin(), corners.end(), [&](std::uint64_t corner) {
      const VertexBuffer::Vertex* vertex = buffer_.find(corner);
      return vertex != nullptr && vertex->in_box;
    });
  pick_cell_values(block, cell, wanted);
  if (wanted) {
    for (const std::uint64_t corner : corners) {
      VertexBuffer::Vertex* vertex = buffer_.find(corner);
      if (vertex == nullptr)
        return corrupt("uses vertex " + std::to_string(corner) + ", which was finalized",
                       "cell " + std::to_string(number));
      give(*vertex);
      piece_.corners.push_back(corner);
    }
    piece_.corner_begin.push_back(piece_.corners.size());
    piece_.cell_numbers.push_back(number);
    piece_.cell_blocks.push_back(in_block);
    piece_.last_use.push_back(0);
    piece_.vertices_before_cell.push_back(piece_.vertex_count());
    cells_.set.add(number);
    ++block_cells_[in_block];
    cell_segments_.insert(segment_);
  }
  for (std::size_t i = 0; i < corners.size() && i < 64; ++i)
    if ((block.last_use[cell] >> i & 1) != 0) buffer_.remove(corners[i]);
  const auto& other = block.other_last_uses;
  auto at = std::lower_bound(
      other.begin(), other.end(), cell,
      [](const OtherLastUse& use, std::size_t of_cell) { return use.cell < of_cell; });
  for (; at != other.end() && at->cell == cell; ++at) buffer_.remove(at->vertex);
  return {};
}

void PiecePicker::pick_cell_values(const MeshBlock& block, std::size_t cell, bool wanted) {
  for (std::size_t i = 0; i < cell_arrays_.size(); ++i) {
    const std::uint32_t array = cell_arrays_[i];
    if (!file_->schema().array_covers(array, block.cell_blocks[cell])) continue;
    const ArrayInfo& info = file_->schema().arrays[array];
    const std::size_t stride = scalar_bytes(info.type) * info.components;
    const std::byte* from = block.arrays[array].data() + taken_[i]++ * stride;
    if (wanted) piece_.arrays[array].insert(piece_.arrays[array].end(), from, from + stride);
  }
}

/// Adds a vertex to the piece unless the piece already contains the vertex.
void PiecePicker::give(VertexBuffer::Vertex& vertex) {
  if (std::exchange(vertex.given, true)) return;
  if (vertex.imported && !shared_.insert(vertex.number).second) return;
  if (!vertex.imported && shared_.contains(vertex.number)) {
    imports_.erase(vertex.number);
    point_segments_.insert(segment_);
    return;
  }
  buffer_.give(vertex, piece_);
  vertices_.set.add(vertex.number);
  if (vertex.imported)
    imports_.emplace(vertex.number, Import{segment_, buffer_.point(vertex)});
  else
    point_segments_.insert(segment_);
}

void PiecePicker::end_segment() {
  buffer_.for_each([&](const VertexBuffer::Vertex& vertex) {
    if (vertex.given) shared_.insert(vertex.number);
  });
  buffer_.clear();
}

Result<void> PiecePicker::end_mesh() {
  const std::uint64_t expected = request_->expected();
  if (expected != PieceRequest::kUnknown && !request_->box() && found_ != expected)
    return request_->of_vertices()
               ? misuse(std::to_string(expected - found_) + " of the vertices do not exist",
                        "piece")
               : file_->wrong_index("counts cells that do not exist");
  for (Numbers* numbers : {&vertices_, &cells_})
    if (const auto twice = numbers->set.twice())
      return corrupt(std::string(numbers == &cells_ ? "cell " : "vertex ") +
                         std::to_string(*twice) + " occurs twice",
                     "mesh");
  shared_.clear();
  return {};
}

}  // namespace shm
