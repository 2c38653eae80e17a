// The part of NeighbourFinder for cells that are not hexahedra, and for corners of these cells.
// spec: "Neighbourhoods", of a corner of another cell
#include <algorithm>

#include "codecs/shared/cell_frames.h"
#include "codecs/shared/neighbourhood.h"

namespace shm {
namespace {

/// Slots of the vertices around a side of the current cell.
struct SideSlots {
  std::array<std::uint32_t, 4> slot{};
  std::size_t size = 0;

  SideSlots(const CellTopology& cell, std::uint32_t side) {
    const ShapeFace& face = faces_of(cell.shape, cell.corners)[side];
    size = face.size;
    for (std::size_t i = 0; i < size; ++i) slot[i] = cell.slots[face.at[i]];
  }
  operator std::span<const std::uint32_t>() const { return std::span(slot).first(size); }
};

bool has(std::span<const std::uint32_t> slots, std::uint32_t slot) {
  return std::find(slots.begin(), slots.end(), slot) != slots.end();
}

}  // namespace

/// Returns the position in the ring of the cell with sequence number `number`. Returns kNone if the
/// cell is no longer in the ring.
std::uint32_t NeighbourFinder::place_of(std::uint64_t number) const {
  if (number >= sequence_ || sequence_ - number >= ring_.size()) return kNone;
  const auto age = static_cast<std::size_t>(sequence_ - number);
  const std::size_t place = place_ >= age ? place_ - age : place_ + ring_.size() - age;
  return ring_[place].sequence == number ? static_cast<std::uint32_t>(place) : kNone;
}

/// Returns the vertex of the cell at `place` that is not on `side` and is joined by an edge to
/// `slot`, a corner of `side`. Returns kNone if no such vertex exists, or if its slot now belongs
/// to another vertex.
std::uint32_t NeighbourFinder::far(std::uint32_t place, std::uint32_t slot, Cycle side) const {
  const Cell& cell = ring_[place];
  const auto end = cell.corner.begin() + cell.corners;
  const auto corner = std::find(cell.corner.begin(), end, slot);
  if (corner == end) return kNone;
  for (std::uint8_t next :
       corner_neighbours(cell.shape, static_cast<std::uint32_t>(corner - cell.corner.begin()))) {
    if (next == kNoPlace) break;
    const std::uint32_t found = cell.corner[next];
    if (has(side, found)) continue;
    return vertices_[found].introduced > cell.sequence ? kNone : found;
  }
  return kNone;
}

/// Finds the side opposite to `side` in the cell at `place`, and stores the slots of the opposite
/// side in `far_side`. Returns the position in the ring of the cell across the opposite side, or
/// kNone.
std::uint32_t NeighbourFinder::onward(std::uint32_t place, Cycle side,
                                      std::array<std::uint32_t, 4>& far_side) const {
  const Cell& cell = ring_[place];
  for (std::size_t i = 0; i < side.size(); ++i) {
    far_side[i] = far(place, side[i], side);
    if (far_side[i] == kNone) return kNone;
  }
  const auto sides = faces_of(cell.shape, cell.corners);
  for (std::uint32_t k = 0; k < std::min<std::size_t>(sides.size(), Sides::kMost); ++k) {
    if (sides[k].size != side.size()) continue;
    bool same = true;
    for (std::size_t i = 0; i < side.size() && same; ++i) {
      const std::uint8_t position = sides[k].at[i];
      const std::uint32_t slot =
          cell.corner[cell.shape == CellShape::hexahedron ? kCornerBits[position] : position];
      same = has(Cycle(far_side).first(side.size()), slot);
    }
    if (!same) continue;
    const std::uint32_t behind = sides_[place].behind[k];
    return behind != kNone && ring_[behind].sequence < cell.sequence ? behind : kNone;
  }
  return kNone;
}

void NeighbourFinder::look_around_corner(Neighbourhood& item, const CellTopology& cell,
                                         std::uint32_t position) const {
  const CornerFrame frame = corner_frame(cell.shape, cell.corners, position);
  switch (flat_shape(cell.shape, cell.corners)) {
    case CellShape::wedge: item.kind = Neighbourhood::layered; break;
    case CellShape::quad: item.kind = Neighbourhood::flat; break;
    case CellShape::pyramid:
      item.kind = position < 4 ? Neighbourhood::flat : Neighbourhood::simplex;
      break;
    default: item.kind = Neighbourhood::simplex;
  }
  item.corner = static_cast<std::uint8_t>(std::min(position, 7u));
  std::uint32_t known = 0, count = 0;
  for (std::uint32_t a = 0; a < 3; ++a) {
    const std::uint8_t p = frame.near[a];
    if (p == kNoPlace || (known_ >> p & 1) == 0) continue;
    const std::uint32_t index = item.kind == Neighbourhood::simplex ? count++ : a;
    item.at[index] = cell.slots[p];
    known |= Neighbourhood::kNear << index;
    if (vertices_[item.at[index]].full) known |= Neighbourhood::kThird << index;
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::uint8_t p = frame.diagonal[i];
    if (p == kNoPlace || (known_ >> p & 1) == 0) continue;
    item.at[kAtDiagonal + i] = cell.slots[p];
    known |= Neighbourhood::kDiagonal << i;
  }
  item.known = static_cast<std::uint16_t>(known);
  if (cell.shape == CellShape::line) look_along_line(item);
  for (std::uint32_t a = 0; a < frame.across.size(); ++a) {
    if (frame.across[a] == kNoPlace || !item.knows(Neighbourhood::kNear << a)) continue;
    const std::uint32_t place = place_of(cell.behind[frame.across[a]]);
    if (place != kNone) look_along(item, a, place, SideSlots(cell, frame.across[a]));
  }
  if (frame.around != kNoPlace) look_behind(item, cell, frame.around);
}

/// Finds the neighbours beyond near[axis]. near[axis] is on the side that the current cell shares
/// with the cell at `place`.
void NeighbourFinder::look_along(Neighbourhood& item, std::uint32_t axis, std::uint32_t place,
                                 Cycle side) const {
  const std::uint32_t beyond = far(place, item.at[axis], side);
  if (beyond == kNone) return;
  item.at[kAtBeyond + axis] = beyond;
  item.known |= static_cast<std::uint16_t>(Neighbourhood::kBeyond << axis);
  std::array<std::uint32_t, 4> far_side{};
  const std::uint32_t next = onward(place, side, far_side);
  if (next == kNone) return;
  const std::uint32_t farther = far(next, beyond, Cycle(far_side).first(side.size()));
  if (farther == kNone || farther == item.at[axis]) return;
  item.at[kAtFarther + axis] = farther;
  item.known |= static_cast<std::uint16_t>(Neighbourhood::kFarther << axis);
}

/// Finds neighbours in the cell across the side that is opposite to the corner. From each near
/// vertex, an edge of that cell leads away from the side. If all these edges lead to the same
/// vertex, the cell contributes this vertex; otherwise it contributes the vertices at the ends of
/// the edges.
void NeighbourFinder::look_behind(Neighbourhood& item, const CellTopology& cell,
                                  std::uint32_t side) const {
  const std::uint32_t place = place_of(cell.behind[side]);
  if (place == kNone) return;
  const SideSlots slots(cell, side);
  std::array<std::uint32_t, 3> beyond{};
  std::uint32_t first = kNone;
  const std::uint32_t from = item.kind == Neighbourhood::layered ? 1 : 0;
  for (std::uint32_t a = from; a < 3; ++a) {
    if (!item.knows(Neighbourhood::kNear << a)) continue;
    beyond[a] = far(place, item.at[a], slots);
    if (first == kNone) first = beyond[a];
  }
  if (first == kNone) return;
  bool one = true;
  for (std::uint32_t a = from; a < 3; ++a)
    one = one && (!item.knows(Neighbourhood::kNear << a) || beyond[a] == first);
  const auto take = [&](std::uint32_t index, std::uint32_t slot) {
    if (slot == kNone) return;
    item.at[index] = slot;
    item.known |= static_cast<std::uint16_t>(1u << index);
  };
  if (!one) {
    for (std::uint32_t a = from; a < 3; ++a)
      if (item.knows(Neighbourhood::kNear << a)) take(kAtBeyond + a, beyond[a]);
  } else if (item.kind == Neighbourhood::layered) {
    take(kAtDiagonal + 2, first);
    if (item.knows(Neighbourhood::kDiagonal))
      take(kAtOpposite, far(place, item.at[kAtDiagonal], slots));
  } else {
    take(kAtOpposite, first);
    if (!item.knows(3 * Neighbourhood::kDiagonal))
      for (std::uint32_t i = 0; i < (item.knows(4 * Neighbourhood::kNear) ? 3u : 1u); ++i)
        take(kAtDiagonal + i, first);
  }
}

/// For a line cell that continues the previous line cell: finds the neighbours along the previous
/// line cell.
void NeighbourFinder::look_along_line(Neighbourhood& item) const {
  if (!item.knows(Neighbourhood::kNear) || sequence_ == 0) return;
  const std::uint32_t place = place_of(sequence_ - 1);
  if (place == kNone || ring_[place].shape != CellShape::line) return;
  const std::uint32_t beyond = far(place, item.at[0], Cycle(item.at).first(1));
  if (beyond == kNone) return;
  item.at[kAtBeyond] = beyond;
  item.known |= Neighbourhood::kBeyond;
}

/// Finds the cells across the sides of `cell`. Side 0 of a triangle or quad is the face that the
/// cell itself forms; it is searched last, after the edges.
void NeighbourFinder::look_beside_cell(Neighbourhood& item, const CellTopology& cell) const {
  item.kind = Neighbourhood::beside;
  const auto sides = faces_of(cell.shape, cell.corners);
  const CellShape shape = flat_shape(cell.shape, cell.corners);
  const std::uint32_t count =
      static_cast<std::uint32_t>(std::min<std::size_t>(sides.size(), Sides::kMost));
  const bool itself = shape == CellShape::triangle || shape == CellShape::quad;
  std::uint32_t known = 0, axis = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t k = itself ? (i + 1) % count : i;
    const std::uint32_t place = place_of(cell.behind[k]);
    if (place == kNone) continue;
    if (axis == 3) {
      item.at[kAtOpposite] = place;
      known |= Neighbourhood::kOpposite;
      break;
    }
    item.at[axis] = place;
    known |= Neighbourhood::kNear << axis;
    std::array<std::uint32_t, 4> far_side{};
    const std::uint32_t next = onward(place, SideSlots(cell, k), far_side);
    if (next != kNone) {
      item.at[kAtBeyond + axis] = next;
      known |= Neighbourhood::kBeyond << axis;
    }
    ++axis;
  }
  item.known = static_cast<std::uint16_t>(known);
}

}  // namespace shm
