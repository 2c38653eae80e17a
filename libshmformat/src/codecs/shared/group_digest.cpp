#include "codecs/shared/group_digest.h"

#include <algorithm>
#include <utility>

#include "codecs/shared/value_domain.h"
#include "format/schema.h"

namespace shm {

void GroupDigest::add_vertex(const SegmentPiece::Vertex& vertex, std::uint64_t position) {
  Vertex added;
  if (keeps())
    added.number = vertex.number;
  else if (vertex.imported)
    added.ticket = vertex.ticket;
  else
    added.number = position;
  vertices_.push_back(vertex.imported ? kNoNumber : added.number);
  if (vertex.handle >= by_handle_.size())
    by_handle_.resize(std::max<std::size_t>(vertex.handle + std::size_t{1}, 2 * by_handle_.size()));
  by_handle_[vertex.handle] = added;
}

void GroupDigest::add_cell(const SegmentPiece::Cell& cell, std::span<const std::uint32_t> nodes,
                           std::uint64_t position, std::vector<EncodedGroup::LateNode>& late) {
  const std::uint64_t number = keeps() ? cell.number : position;
  sum_ += cells_.of(number, cell.block, nodes.size(), [&](std::size_t i, std::uint64_t key) {
    const Vertex& vertex = by_handle_[nodes[i]];
    if (vertex.number != kNoNumber) return digest_of_word(key, vertex.number);
    late.push_back({key, vertex.ticket});
    return std::uint64_t{0};
  });
  cell_numbers_.push_back(number);
  cell_blocks_.push_back(cell.block);
}

std::uint64_t GroupDigest::finish(const GroupValues& values) {
  std::vector<std::uint64_t> covered;
  for (std::size_t c = 0; c < values.columns(); ++c) {
    const ArrayInfo info = c == 0 ? coordinates_info(*schema_) : schema_->arrays[values.array(c)];
    std::span<const std::uint64_t> numbers = vertices_;
    if (values.of_cells(c)) {
      covered.clear();
      add_covered(*schema_, values.array(c), cell_numbers_, cell_blocks_, covered);
      numbers = covered;
    }
    const DigestKeys keys =
        c == 0 ? DigestKeys::of_coordinates() : DigestKeys::of_array(values.array(c));
    const std::byte* from = values.values(c);
    std::size_t stride = values.stride(c);
    std::vector<std::byte> restored;
    if (info.quantization.lossy()) {
      restored = restored_values(info, from, stride, values.count(c));
      from = restored.data();
      stride = scalar_bytes(info.type) * info.components;
    }
    sum_ += digest_of_values(keys, numbers, from, stride, info.type, info.components);
  }
  vertices_.clear();
  cell_numbers_.clear();
  cell_blocks_.clear();
  return std::exchange(sum_, 0);
}

}  // namespace shm
