// RowHexahedra beside cells of other shapes: their open quadrilaterals.
#include <algorithm>

#include "connectivity/row_hexahedra.h"

namespace shm {
namespace {

/// Cells of eight corners are hexahedra: their faces are on the active surface.
bool is_of_other_cell(const OpenFaces& open, const OpenFaces::Face& face) {
  return open.owner(face).size < 8;
}

}  // namespace

/// For an edge from a known corner next to this one to one across a side: a quadrilateral that has
/// them side by side, and what else of the side is known.
template <class Coder>
auto RowHexahedra<Coder>::find_beside(std::uint32_t corner) -> Beside {
  joins_.clear();
  const auto known = [&](std::uint32_t b) { return (work_.known >> b & 1) != 0; };
  const auto add = [&](std::uint32_t slot, std::uint32_t score) {
    for (std::uint32_t b = 0; b < 8; ++b)
      if (known(b) && work_.corner[b] == slot) return;
    for (Join& it : joins_)
      if (it.slot == slot) {
        it.score += score;
        return;
      }
    joins_.push_back({slot, score, 0});
  };
  for (std::uint32_t axis : {1u, 2u, 4u})
    for (std::uint32_t other : {1u, 2u, 4u}) {
      if (other == axis || !known(corner ^ axis) || !known(corner ^ axis ^ other)) continue;
      const std::uint32_t p = work_.corner[corner ^ axis], r = work_.corner[corner ^ axis ^ other];
      const std::uint32_t q = known(corner ^ other) ? work_.corner[corner ^ other] : kNone;
      open_->around(p, [&](const OpenFaces::Face& face, std::uint32_t at) {
        if (face.size != 4 || !is_of_other_cell(*open_, face)) return;
        if (q != kNone && face.node[(at + 2) % 4] != q) return;
        for (std::uint32_t step : {1u, 3u})
          if (face.node[(at + step) % 4] == r)
            add(face.node[(at + 4 - step) % 4], q == kNone ? 2 : 3);
      });
    }
  Beside best;
  for (const Join& it : joins_)
    if (it.score > best.score) best = {it.slot, it.score, 0};
  best.others = joins_.empty() ? 0 : static_cast<std::uint32_t>(joins_.size() - 1);
  return best;
}

/// How many open faces that are no hexahedra's a vertex has, at most 3.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::open_beside(std::uint32_t slot) const {
  if (open_ == nullptr) return 0;
  const std::uint32_t bare = open_->vertex(slot).bare, own = surface_->vertex(slot).face_count;
  return bare > own ? std::min(bare - own, 3u) : 0;
}

template class RowHexahedra<RangeEncoder>;
template class RowHexahedra<RangeDecoder>;
template class RowHexahedra<MixingCoder<RangeEncoder>>;
template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
