#include "codecs/shared/neighbourhood.h"

#include <algorithm>

#include "base/lists.h"

namespace shm {
namespace {

// Number of cells in the ring of remembered cells. The ring starts with kFirstCells cells and grows
// to at least kLeastCells before it discards cells. It never exceeds kMostCells.
constexpr std::uint64_t kFirstCells = 64, kLeastCells = std::uint64_t{1} << 14,
                        kMostCells = std::uint64_t{1} << 18;

/// Largest number of faces that are searched at a vertex of a polyhedron. The limit keeps searches
/// short even in hostile files.
constexpr std::ptrdiff_t kMostFacesLooked = 32;

/// The two axes of each diagonal neighbour. Neighbourhood::at[3 + i] is one step away along each of
/// the axes kDiagonalAxes[i].
constexpr std::array<std::array<std::uint32_t, 2>, 3> kDiagonalAxes = {{{0, 1}, {0, 2}, {1, 2}}};
/// For each axis a: the indices of the two diagonal neighbours that lie one step along axis a. The
/// two are sorted by their other axis.
constexpr std::array<std::array<std::uint32_t, 2>, 3> kDiagonalsAlong = {{{0, 1}, {0, 2}, {1, 2}}};

}  // namespace

NeighbourFinder::Vertex& NeighbourFinder::vertex_at(std::uint32_t slot) {
  return at_slot(vertices_, slot);
}

void NeighbourFinder::begin_cell(const CellTopology& cell, bool as_stored, std::uint64_t live) {
  as_stored_ = as_stored;
  if (next_place_ == ring_.size()) {
    if (ring_.empty() || ring_.size() < std::clamp(2 * live, kLeastCells, kMostCells))
      ring_.resize(std::max<std::size_t>(kFirstCells, 2 * ring_.size()));
    else
      next_place_ = 0;
    if (cells_) links_.resize(ring_.size());
  }
  place_ = next_place_++;
  ring_[place_].sequence = kNever;

  known_ = ~std::uint64_t{0};
  known_corners_ = 0xff;
  if (cell.by_faces) begin_faces(cell);
  if (cell.hexahedral)
    for (std::uint32_t i = 0; i < 8; ++i) corner_[corner_bits(cell, i)] = cell.slots[i];
  for (std::uint32_t position : cell.new_positions) {
    const std::uint32_t slot = cell.slots[position];
    if (cell.hexahedral)
      for (std::uint32_t b = 0; b < 8; ++b)
        if (corner_[b] == slot) known_corners_ &= ~(1u << b);
    if (cell.slots.size() > 8 || !cell.hexahedral)
      for (std::size_t i = 0; i < std::min<std::size_t>(cell.slots.size(), 64); ++i)
        if (cell.slots[i] == slot) known_ &= ~(std::uint64_t{1} << i);
  }
}

Neighbourhood NeighbourFinder::vertex(const CellTopology& cell, std::uint32_t position,
                                      Reach reach) {
  Neighbourhood item;
  item.self = cell.slots[position];
  Vertex& self = vertex_at(item.self);
  self = Vertex{};
  self.introduced = sequence_;
  if (cell.hexahedral && position < 8) {
    const std::uint32_t bits = corner_bits(cell, position);
    item.kind = Neighbourhood::lattice;
    item.corner = static_cast<std::uint8_t>(bits);
    std::uint32_t known = 0;
    const auto take = [&](std::uint32_t flipped, std::uint32_t& slot, std::uint32_t bit) {
      if ((known_corners_ >> (bits ^ flipped) & 1) == 0) return;
      slot = corner_[bits ^ flipped];
      known |= bit;
    };
    for (std::uint32_t a = 0; a < 3; ++a) take(1u << a, item.at[a], Neighbourhood::kNear << a);
    for (std::uint32_t i = 0; i < 3; ++i)
      take(1u << kDiagonalAxes[i][0] | 1u << kDiagonalAxes[i][1], item.at[kAtDiagonal + i],
           Neighbourhood::kDiagonal << i);
    take(7, item.at[kAtOpposite], Neighbourhood::kOpposite);
    for (std::uint32_t a = 0; a < 3; ++a)
      if ((known >> a & 1) != 0 && vertices_[item.at[a]].full) known |= Neighbourhood::kThird << a;
    item.known = static_cast<std::uint16_t>(known);
    self.full = item.knows(Neighbourhood::kLattice);
    if (reach != Reach::lattice) look_beyond(item, reach);
    for (std::uint32_t b = 0; b < 8; ++b)
      if (corner_[b] == item.self) known_corners_ |= 1u << b;
  } else if (position < cell.corners) {
    look_around_corner(item, cell, position);
    self.full = item.has_rule();
  } else if (cell.by_faces && !faces_at(item.self).empty()) {
    look_around_faces(item);
    self.full = item.knows(Neighbourhood::kLattice);
    coming_[item.self] = 0;
  } else if (cell.rows != nullptr && position >= cell.layout->corners) {
    look_along_rows(item, cell, position);
    self.full = item.knows(Neighbourhood::kLattice);
  } else if (const MidNode* node = cell.layout == nullptr ? nullptr : cell.layout->at(position);
             node != nullptr && (node->kind == MidNode::edge || node->has_middle)) {
    look_around_mid_node(item, cell, *node);
  } else if (position > 0 && position <= 64 && (known_ >> (position - 1) & 1) != 0) {
    item.at[0] = cell.slots[position - 1];
    item.known = Neighbourhood::kNear;
  }
  if (cell.slots.size() > 8 || !cell.hexahedral)
    for (std::size_t i = 0; i < std::min<std::size_t>(cell.slots.size(), 64); ++i)
      if (cell.slots[i] == item.self) known_ |= std::uint64_t{1} << i;
  return item;
}

/// Finds the known nodes around a mid node. The nodes of a cell are coded in this order: corners,
/// nodes of edges, nodes of faces, node of the body.
void NeighbourFinder::look_around_mid_node(Neighbourhood& item, const CellTopology& cell,
                                           const MidNode& node) const {
  const bool is_edge = node.kind == MidNode::edge;
  item.kind = is_edge ? Neighbourhood::midpoint : Neighbourhood::centre;
  item.corner = node.kind == MidNode::body ? 1 : 0;
  std::uint32_t known = 0;
  for (std::uint32_t i = 0; i < node.parallels; ++i) {
    if ((known_ >> node.parallel[i] & 1) == 0) continue;
    item.at[i] = cell.slots[node.parallel[i]];
    known |= (Neighbourhood::kNear | Neighbourhood::kThird) << i;
  }
  const auto take = [&](std::size_t place, std::uint32_t position) {
    item.at[place] = cell.slots[position];
    known |= 1u << place;
  };
  for (std::size_t i = 0; i < (is_edge ? 2u : 4u); ++i) {
    if (!is_edge) take(kAtDiagonal + i, node.middle[i]);
    const std::uint32_t corner = node.corner[i];
    take(is_edge ? kAtDiagonal + i : kAtBeyond + i,
         corner < cell.layout->corners ? cell.framed[corner] : corner);
  }
  item.known = static_cast<std::uint16_t>(known);
}

void NeighbourFinder::begin_faces(const CellTopology& cell) {
  around_.clear();
  const auto& slots = cell.slots;
  for (std::size_t begin = 0; begin < slots.size();) {
    std::size_t n = 1;
    while (slots[begin + n] != slots[begin]) ++n;
    for (std::size_t i = 0; i < n; ++i)
      around_.push_back({slots[begin + i], slots[begin + (i + n - 1) % n],
                         slots[begin + (i + 1) % n], n == 4 ? slots[begin + (i + 2) % 4] : kNone});
    begin += n + 1;
  }
  std::stable_sort(around_.begin(), around_.end(),
                   [](const FaceCorner& a, const FaceCorner& b) { return a.slot < b.slot; });
  for (const std::uint32_t position : cell.new_positions)
    at_slot(coming_, slots[position]) = sequence_ + 1;
}

std::span<const NeighbourFinder::FaceCorner> NeighbourFinder::faces_at(std::uint32_t slot) const {
  const auto before = [](const FaceCorner& corner, std::uint32_t wanted) {
    return corner.slot < wanted;
  };
  const auto begin = std::lower_bound(around_.begin(), around_.end(), slot, before);
  auto end = begin;
  while (end != around_.end() && end->slot == slot && end - begin < kMostFacesLooked) ++end;
  return std::span(begin, end);
}

bool NeighbourFinder::is_beside(std::uint32_t a, std::uint32_t b) const {
  for (const FaceCorner& corner : faces_at(a))
    if (corner.before == b || corner.after == b) return true;
  return false;
}

/// Finds neighbours of a vertex of a polyhedron: the first three known vertices that are joined to
/// it by edges, and the vertices opposite to it in faces of four vertices.
void NeighbourFinder::look_around_faces(Neighbourhood& item) const {
  item.kind = Neighbourhood::lattice;
  const auto faces = faces_at(item.self);
  std::uint32_t near = 0, known = 0;
  for (const FaceCorner& face : faces)
    for (const std::uint32_t slot : {face.before, face.after}) {
      const auto end = item.at.begin() + near;
      if (near == 3 || !is_known(slot) || std::find(item.at.begin(), end, slot) != end) continue;
      known |= Neighbourhood::kNear << near;
      if (vertices_[slot].full) known |= Neighbourhood::kThird << near;
      item.at[near++] = slot;
    }
  for (std::uint32_t i = 0; i < 3; ++i) {
    const auto [a, b] = kDiagonalAxes[i];
    if (b >= near) continue;
    for (const FaceCorner& face : faces) {
      const bool between = (face.before == item.at[a] && face.after == item.at[b]) ||
                           (face.before == item.at[b] && face.after == item.at[a]);
      if (!between || face.across == kNone || !is_known(face.across)) continue;
      item.at[kAtDiagonal + i] = face.across;
      known |= Neighbourhood::kDiagonal << i;
      break;
    }
  }
  if ((known >> kAtDiagonal & 3) == 3) {
    const std::uint32_t opposite = beside_both(item);
    if (opposite != kNone) {
      item.at[kAtOpposite] = opposite;
      known |= Neighbourhood::kOpposite;
    }
  }
  item.known = static_cast<std::uint16_t>(known);
}

/// Finds neighbours of a polyhedron: the first four remembered cells across its faces.
void NeighbourFinder::look_beside_polyhedron(Neighbourhood& item, const CellTopology& cell) const {
  item.kind = Neighbourhood::beside;
  std::uint32_t known = 0, count = 0;
  for (const std::uint64_t number : cell.behind) {
    const std::uint32_t place = place_of(number);
    if (place == kNone || count == 4) continue;
    const std::uint32_t index = count++ < 3 ? count - 1 : kAtOpposite;
    item.at[index] = place;
    known |= 1u << index;
  }
  item.known = static_cast<std::uint16_t>(known);
}

/// Returns a vertex that is connected by edges to both the first and the second diagonal neighbour.
/// The vertex is neither a near neighbour nor `item` itself. Candidates are tried in the order of
/// the faces at the first diagonal neighbour.
std::uint32_t NeighbourFinder::beside_both(const Neighbourhood& item) const {
  for (const FaceCorner& face : faces_at(item.at[kAtDiagonal]))
    for (const std::uint32_t slot : {face.before, face.after}) {
      if (slot == item.self || !is_known(slot)) continue;
      if (std::find(item.at.begin(), item.at.begin() + 3, slot) != item.at.begin() + 3) continue;
      if (is_beside(slot, item.at[kAtDiagonal + 1])) return slot;
    }
  return kNone;
}

Neighbourhood NeighbourFinder::unused_vertex(std::uint32_t slot) {
  Neighbourhood item;
  item.self = slot;
  Vertex& self = vertex_at(slot);
  self = Vertex{};
  self.introduced = sequence_;
  return item;
}

/// Finds a remembered hexahedron in which edges connect vertex `slot` with vertices `one` and
/// `two`. Skips the cell at position `except` of the ring.
NeighbourFinder::Found NeighbourFinder::behind(std::uint32_t slot, std::uint32_t one,
                                               std::uint32_t two, std::uint32_t except) const {
  for (const Use& use : vertices_[slot].uses) {
    if (use.sequence == kNever || use.place == except) continue;
    const Cell& cell = ring_[use.place];
    if (cell.sequence != use.sequence) continue;
    for (std::uint32_t axis = 0; axis < 3; ++axis) {
      const std::uint32_t a = cell.corner[use.corner ^ 1u << (axis == 0 ? 1 : 0)];
      const std::uint32_t b = cell.corner[use.corner ^ 1u << (axis == 2 ? 1 : 2)];
      if (!((a == one && b == two) || (a == two && b == one))) continue;
      // Skip the cell if slot `one` or `two` has been reused for another vertex since the cell was
      // coded.
      if (vertices_[one].introduced > cell.sequence || vertices_[two].introduced > cell.sequence)
        continue;
      return {use.place, use.corner, axis};
    }
  }
  return {};
}

/// Finds the hexahedron across the face with the vertices `slot`, `one`, `both` and `two` (in this
/// order around the face). Searches from each corner of the face.
NeighbourFinder::Found NeighbourFinder::across(std::uint32_t slot, std::uint32_t one,
                                               std::uint32_t two, std::uint32_t both) const {
  if (const Found found = behind(slot, one, two, kNone)) return found;
  for (std::uint32_t side : {one, two}) {
    Found found = behind(side, slot, both, kNone);
    if (!found) continue;
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      if (axis != found.axis && ring_[found.place].corner[found.corner ^ 1u << axis] == slot)
        return {found.place, found.corner ^ 1u << axis, found.axis};
  }
  const Found found = behind(both, one, two, kNone);
  if (!found) return {};
  const std::uint32_t corner = found.corner ^ 7u ^ 1u << found.axis;
  if (ring_[found.place].corner[corner] != slot) return {};
  return {found.place, corner, found.axis};
}

void NeighbourFinder::look_beyond(Neighbourhood& item, Reach reach) const {
  for (std::uint32_t a = 0; a < 3; ++a) {
    const auto [d, e] = kDiagonalsAlong[a];
    if (!item.knows(Neighbourhood::kNear << a | Neighbourhood::kDiagonal << d |
                    Neighbourhood::kDiagonal << e | Neighbourhood::kOpposite))
      continue;
    const Found found = across(item.at[a], item.at[kAtDiagonal + d], item.at[kAtDiagonal + e],
                               item.at[kAtOpposite]);
    if (!found) continue;
    const Cell& cell = ring_[found.place];
    const std::uint32_t corner = found.corner ^ 1u << found.axis;
    const std::uint32_t slot = cell.corner[corner];
    // Skip a slot that has been reused for another vertex since the cell was coded.
    if (vertices_[slot].introduced > cell.sequence) continue;
    item.at[kAtBeyond + a] = slot;
    item.known |= static_cast<std::uint16_t>(Neighbourhood::kBeyond << a);
    if (reach == Reach::beyond) continue;
    const std::uint32_t one = cell.corner[corner ^ 1u << (found.axis == 0 ? 1 : 0)];
    const std::uint32_t two = cell.corner[corner ^ 1u << (found.axis == 2 ? 1 : 2)];
    if (vertices_[one].introduced > cell.sequence || vertices_[two].introduced > cell.sequence)
      continue;
    const Found next = behind(slot, one, two, found.place);
    if (!next) continue;
    const Cell& second = ring_[next.place];
    const std::uint32_t farther = second.corner[next.corner ^ 1u << next.axis];
    if (vertices_[farther].introduced > second.sequence || farther == item.at[a]) continue;
    item.at[kAtFarther + a] = farther;
    item.known |= static_cast<std::uint16_t>(Neighbourhood::kFarther << a);
  }
}

// --- cells

Neighbourhood NeighbourFinder::cell(const CellTopology& cell, Reach reach) {
  Neighbourhood item;
  item.self = place_;
  full_ = false;
  if (!cell.hexahedral) {
    if (cell.corners > 0) look_beside_cell(item, cell);
    if (cell.by_faces) look_beside_polyhedron(item, cell);
    return item;
  }
  item.kind = Neighbourhood::lattice;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const std::uint32_t u = 1u << (axis == 0 ? 1 : 0), v = 1u << (axis == 2 ? 1 : 2);
    for (std::uint32_t up = 0; up < 2; ++up) {
      const std::uint32_t base = up << axis;
      // Start with the far corner of the face, which is usually the most recent vertex.
      found_[2 * axis + up] =
          across(corner_[base | u | v], corner_[base | u], corner_[base | v], corner_[base]);
    }
  }
  look_around_cell(item, reach);
  full_ = item.knows(Neighbourhood::kLattice);
  return item;
}

std::uint32_t NeighbourFinder::behind_of(std::uint32_t place, std::uint32_t side) const {
  const Cell& cell = ring_[place];
  const std::uint32_t other = links_[place].behind[side];
  // If the place in the ring has been reused, the cell at this place is younger than `cell`.
  return other != kNone && ring_[other].sequence < cell.sequence ? other : kNone;
}

bool NeighbourFinder::is_behind(std::uint32_t place, std::uint32_t other) const {
  for (std::uint32_t side = 0; side < 6; ++side)
    if (behind_of(place, side) == other) return true;
  return false;
}

/// Returns a cell that shares a face with cell `a` and a face with cell `b`, or kNone if no such
/// cell exists.
std::uint32_t NeighbourFinder::common(std::uint32_t a, std::uint32_t b) const {
  for (std::uint32_t side = 0; side < 6; ++side) {
    const std::uint32_t other = behind_of(a, side);
    if (other != kNone && is_behind(b, other)) return other;
  }
  return kNone;
}

void NeighbourFinder::look_around_cell(Neighbourhood& item, Reach reach) const {
  std::uint32_t known = 0;
  for (std::uint32_t a = 0; a < 3; ++a) {
    const std::uint32_t side = found_[2 * a] ? 2 * a : 2 * a + 1;
    const Found& found = found_[side];
    if (!found) continue;
    item.at[a] = found.place;
    known |= Neighbourhood::kNear << a;
    if (links_[found.place].full) known |= Neighbourhood::kThird << a;
    if (reach == Reach::lattice) continue;
    const std::uint32_t onward = found.far_side();
    const std::uint32_t beyond = behind_of(found.place, onward);
    if (beyond == kNone) continue;
    item.at[kAtBeyond + a] = beyond;
    known |= Neighbourhood::kBeyond << a;
    if (reach == Reach::beyond) continue;
    const std::uint32_t farther = behind_of(beyond, links_[found.place].onward[onward]);
    if (farther == kNone || farther == found.place) continue;
    item.at[kAtFarther + a] = farther;
    known |= Neighbourhood::kFarther << a;
  }
  for (std::uint32_t i = 0; i < 3; ++i) {
    const auto [a, b] = kDiagonalAxes[i];
    if ((known >> a & known >> b & 1) == 0) continue;
    const std::uint32_t diagonal = common(item.at[a], item.at[b]);
    if (diagonal == kNone) continue;
    item.at[kAtDiagonal + i] = diagonal;
    known |= Neighbourhood::kDiagonal << i;
  }
  if ((known >> 3 & 7) == 7) {
    const std::uint32_t opposite = common(item.at[kAtDiagonal + 0], item.at[kAtDiagonal + 1]);
    if (opposite != kNone && is_behind(item.at[kAtDiagonal + 2], opposite)) {
      item.at[kAtOpposite] = opposite;
      known |= Neighbourhood::kOpposite;
    }
  }
  item.known = static_cast<std::uint16_t>(known);
}

void NeighbourFinder::end_cell(const CellTopology& cell) {
  Cell& remembered = ring_[place_];
  if (cell.corners > 0) {
    sides_.resize(ring_.size());
    for (std::uint32_t k = 0; k < Sides::kMost; ++k)
      sides_[place_].behind[k] = place_of(cell.behind[k]);
  }
  if (!cell.hexahedral && cell.corners > 0) {
    remembered.sequence = sequence_;
    remembered.shape = flat_shape(cell.shape, cell.corners);
    remembered.corners = static_cast<std::uint8_t>(std::min(cell.corners, 8u));
    std::copy_n(cell.slots.begin(), remembered.corners, remembered.corner.begin());
  }
  if (cell.by_faces) {
    remembered.sequence = sequence_;
    remembered.shape = CellShape::faces;
    remembered.corners = 0;
  }
  if (cell.hexahedral) {
    remembered.sequence = sequence_;
    remembered.corner = corner_;
    remembered.shape = CellShape::hexahedron;
    remembered.corners = 8;
    if (cells_) {
      Links& links = links_[place_];
      links.full = full_;
      for (std::uint32_t side = 0; side < 6; ++side) {
        links.behind[side] = found_[side].place;
        links.onward[side] = static_cast<std::uint8_t>(found_[side].far_side());
      }
    }
    for (std::uint32_t b = 0; b < 8; ++b) {
      Vertex& vertex = vertex_at(corner_[b]);
      const Use here{sequence_, place_, b};
      if (vertex.uses[0].sequence == kNever)
        vertex.uses[0] = here;
      else
        vertex.uses[1] = here;
    }
  }
  ++sequence_;
}

}  // namespace shm
