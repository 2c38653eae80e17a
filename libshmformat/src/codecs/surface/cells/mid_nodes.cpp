#include "codecs/surface/cells/mid_nodes.h"

#include <algorithm>
#include <utility>

#include "base/lists.h"

namespace shm {

// --- table

auto MiddleTable::edge(std::uint32_t a, std::uint32_t b, std::uint32_t step,
                       std::uint32_t order) const -> Place {
  if (surface_->vertex(b).id < surface_->vertex(a).id) {
    std::swap(a, b);
    step = order - step;
  }
  return {a, b, edge_place, static_cast<std::uint8_t>(step - 1)};
}

auto MiddleTable::face(const std::array<std::uint32_t, 4>& corners,
                       const std::array<std::uint8_t, 2>& steps, std::uint32_t order) const
    -> Place {
  const auto id = [&](std::uint32_t i) { return surface_->vertex(corners[i & 3]).id; };
  std::uint32_t oldest = 0;
  for (std::uint32_t i = 1; i < 4; ++i)
    if (id(i) < id(oldest)) oldest = i;
  // Steps from the oldest corner towards its two neighbours, the older one first. Corners 1 and 2
  // are at the far end of the first axis of the face, corners 2 and 3 at that of the second one.
  std::uint32_t first = oldest == 1 || oldest == 2 ? order - steps[0] : steps[0];
  std::uint32_t second = oldest >= 2 ? order - steps[1] : steps[1];
  const bool first_is_next = oldest % 2 == 0;
  if ((id(oldest + 1) <= id(oldest + 3)) != first_is_next) std::swap(first, second);
  return {corners[oldest], corners[oldest ^ 2], face_place,
          static_cast<std::uint8_t>(first - 1 + (order - 1) * (second - 1))};
}

auto MiddleTable::triangle(const std::array<std::uint32_t, 3>& corners,
                           const std::array<std::uint8_t, 2>& steps, std::uint32_t order) const
    -> Place {
  // A corner, and the steps towards it from the opposite edge. Sorted by age; corners that are the
  // same vertex keep their order.
  struct Corner {
    std::uint32_t slot, steps;
  };
  std::array<Corner, 3> sorted{
      {{corners[0], order - steps[0] - steps[1]}, {corners[1], steps[0]}, {corners[2], steps[1]}}};
  const auto put_older_first = [&](Corner& one, Corner& other) {
    if (surface_->vertex(other.slot).id < surface_->vertex(one.slot).id) std::swap(one, other);
  };
  put_older_first(sorted[0], sorted[1]);
  put_older_first(sorted[1], sorted[2]);
  put_older_first(sorted[0], sorted[1]);
  return {sorted[0].slot, sorted[2].slot, triangle_place,
          static_cast<std::uint8_t>(sorted[1].steps - 1 + (order - 1) * (sorted[2].steps - 1)),
          sorted[1].slot};
}

std::uint32_t MiddleTable::find(const Place& place) const {
  if (!has_key(place)) return kNone;
  const std::uint8_t map = map_of(place);
  const std::uint32_t slot = map < by_place_.size() ? by_place_[map].find(key_of(place)) : kNone;
  if (slot == kNone) return kNone;
  // Check that the two slots that identify the edge or face still belong to the same vertices.
  const Entry& entry = entries_[slot];
  return entry.low == surface_->vertex(place.low).id &&
                 entry.high == surface_->vertex(place.high).id && entry.middle == middle_id(place)
             ? slot
             : kNone;
}

void MiddleTable::put(const Place& place, std::uint32_t slot) {
  if (!has_key(place)) return;
  Entry& entry = at_slot(entries_, slot);
  const std::uint64_t low = surface_->vertex(place.low).id, high = surface_->vertex(place.high).id;
  const std::uint64_t middle = middle_id(place);
  const std::uint8_t number = map_of(place);
  if (entry.is_set && entry.map == number && entry.low == low && entry.high == high &&
      entry.middle == middle)
    return;
  if (entry.is_set) erase(slot);
  IdMap& map = at_slot(by_place_, number);
  const std::uint64_t key = key_of(place);
  if (const std::uint32_t other = map.find(key); other != kNone) erase(other);
  map.insert(key, slot);
  entry = {key, low, high, middle, 0, true, number};
}

void MiddleTable::erase(std::uint32_t slot) {
  Entry& entry = entries_[slot];
  by_place_[entry.map].erase(entry.key);
  entry.is_set = false;
  entry.open = 0;
}

// --- nodes

template <class Coder>
void MidNodes<Coder>::begin_cell(const CellTopology& cell) {
  const NodeLayout& layout = *cell.layout;
  std::array<std::uint64_t, 8> mixed{};  // hash of each corner's id, in the order of the stored
                                         // corners
  for (std::uint32_t c = 0; c < layout.corners; ++c) {
    const std::uint64_t x =
        (surface_->vertex(cell.slots[cell.framed[c]]).id + 1) * 0x9e3779b97f4a7c15u;
    mixed[c] = x ^ x >> 29;
  }
  for (std::size_t s = 0; s < layout.side_count; ++s) {
    const auto& side = layout.sides[s];
    signatures_[s] = mixed[side[0]] + mixed[side[1]] + mixed[side[2]] +
                     (side[3] == side[0] ? 0 : mixed[side[3]]);
  }
}

template <class Coder>
auto MidNodes<Coder>::place_of(const CellTopology& cell, const MidNode& node) const
    -> MiddleTable::Place {
  const auto slot = [&](std::size_t i) { return cell.slots[cell.framed[node.corner[i]]]; };
  if (node.kind == MidNode::edge) return middles_.edge(slot(0), slot(1), node.step[0], node.order);
  if (node.is_on_triangle)
    return middles_.triangle({slot(0), slot(1), slot(2)}, node.step, node.order);
  return middles_.face({slot(0), slot(1), slot(2), slot(3)}, node.step, node.order);
}

template <class Coder>
std::uint32_t MidNodes<Coder>::expected(const CellTopology& cell, const MidNode& node) const {
  if (node.kind == MidNode::body) return kNone;
  const MiddleTable::Place place = place_of(cell, node);
  const std::uint32_t found = middles_.find(place);
  // If both ends of an edge are the same vertex, this vertex usually is also at its mid nodes.
  return found == kNone && place.low == place.high ? place.low : found;
}

template <class Coder>
bool MidNodes<Coder>::code(Coder& symbols, CellTopology& cell, const MidNode& node,
                           std::uint32_t position) {
  const std::uint32_t slot = expected(cell, node);
  std::uint8_t& missed = missed_[node.kind];
  const bool hit = symbols.bit(as_expected_[node.kind][slot != kNone ? 1 : 0][missed],
                               cell.slots[position] == slot);
  missed = hit ? 0 : 1;
  if (hit) cell.slots[position] = slot;
  return hit;
}

template <class Coder>
void MidNodes<Coder>::note(const CellTopology& cell, const MidNode& node, std::uint32_t position) {
  if (node.kind == MidNode::body) return;
  const MiddleTable::Place place = place_of(cell, node);
  const std::uint32_t slot = cell.slots[position];
  if (place.low == place.high && place.low == slot) return;
  middles_.put(place, slot);
  if (node.has_sides)
    for (std::uint32_t side : node.side) middles_.open(slot) ^= signatures_[side];
}

template <class Coder>
AdaptiveBit& MidNodes<Coder>::last_use_model(const CellTopology& cell, const MidNode& node,
                                             std::uint32_t position) {
  if (node.kind == MidNode::body) return body_ends_;
  const bool is_face = node.kind == MidNode::face;
  for (std::size_t i = 0; i < (is_face ? 4u : 2u); ++i)
    if (cell.last_use[cell.framed[node.corner[i]]] != 0) return ends_with_corner_[is_face ? 1 : 0];
  const std::uint32_t slot = cell.slots[position];
  const std::uint32_t uses = surface_->vertex(slot).uses;
  const std::uint8_t before = at_slot(ended_, position);
  if (is_face) return face_ends_[std::min(uses, 2u)][before];
  const bool closed = middles_.open(slot) == 0;
  return edge_ends_[closed ? 1 : 0][std::min(uses, 7u)][before];
}

template <class Coder>
bool MidNodes<Coder>::code_last_use(Coder& symbols, const CellTopology& cell, const MidNode& node,
                                    std::uint32_t position, bool is_last) {
  is_last = symbols.bit(last_use_model(cell, node, position), is_last);
  at_slot(ended_, position) = is_last ? 1 : 0;
  return is_last;
}

template class MidNodes<RangeEncoder>;
template class MidNodes<RangeDecoder>;

}  // namespace shm
