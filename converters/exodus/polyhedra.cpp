#include "exodus/polyhedra.h"

#include <algorithm>
#include <string>

#include "base/failure.h"

namespace shm::converters::exodus {

std::vector<FaceBlock> face_blocks(const Skeleton& skeleton, const Place& place) {
  const VariableIndex variables(skeleton);
  const std::uint64_t count = skeleton.length_of("num_fa_blk");
  std::vector<FaceBlock> blocks;
  for (std::uint64_t b = 1; b <= count; ++b) {
    FaceBlock block;
    block.nodes = variables.find("fbconn" + std::to_string(b));
    if (block.nodes < 0) break;
    const Variable& nodes = skeleton.variables[static_cast<std::size_t>(block.nodes)];
    const auto shape = skeleton.shape(nodes);
    if (shape.size() == 2) {
      block.faces = shape[0];
      block.size = shape[1];
    } else {
      block.counts = variables.find("fbepecnt" + std::to_string(b));
      const auto* counts =
          block.counts < 0 ? nullptr : &skeleton.variables[static_cast<std::size_t>(block.counts)];
      if (shape.size() != 1 || counts == nullptr || counts->dimensions.size() != 1)
        place.fail(ErrorCode::corrupt, "variable '" + nodes.name + "'",
                   "does not have the shape of a connectivity");
      block.faces = skeleton.size(*counts);
    }
    blocks.push_back(block);
  }
  return blocks;
}

void derive_faces(const Skeleton& skeleton, Layout& layout, const Place& place) {
  const auto follows = [&](int variable) {
    if (variable >= 0) layout.uses[static_cast<std::size_t>(variable)] = Use::faces;
  };
  for (BlockLayout& block : layout.blocks) {
    if (block.faces < 0) continue;
    block.shape = CellShape::faces;
    follows(block.faces);
    follows(block.counts);
    std::erase_if(layout.arrays, [&](const ArrayLayout& array) {
      return array.parts.front().variable == block.counts;
    });
  }
  for (const FaceBlock& block : face_blocks(skeleton, place)) {
    follows(block.nodes);
    follows(block.counts);
  }
}

std::vector<std::uint64_t> face_places(const std::vector<std::uint32_t>& uses, bool shared_first) {
  std::vector<std::uint64_t> places(uses.size());
  std::uint64_t next = 0;
  for (std::size_t f = 0; f < uses.size(); ++f)
    if (!shared_first || uses[f] > 1) places[f] = next++;
  for (std::size_t f = 0; shared_first && f < uses.size(); ++f)
    if (uses[f] <= 1) places[f] = next++;
  return places;
}

std::uint64_t FaceTable::number_of(std::span<const std::uint64_t> nodes) {
  std::uint64_t hash = nodes.size();
  for (const std::uint64_t node : nodes) {
    hash = (hash ^ node) * 0x9e3779b97f4a7c15;
    hash ^= hash >> 29;
  }
  const auto [begin, end] = by_hash_.equal_range(hash);
  for (auto it = begin; it != end; ++it)
    if (std::ranges::equal(this->nodes(it->second), nodes)) return it->second;
  nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
  begins_.push_back(nodes_.size());
  by_hash_.emplace(hash, size() - 1);
  return size() - 1;
}

}  // namespace shm::converters::exodus
