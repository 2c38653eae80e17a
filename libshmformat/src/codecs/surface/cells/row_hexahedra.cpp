#include "codecs/surface/cells/row_hexahedra.h"

#include <algorithm>
#include <bit>

namespace shm {
namespace {

constexpr std::size_t kMaxJoins = 24;

/// Sorts candidates by score; the largest comes first. Candidates with equal scores keep the order
/// in which they were found. Drops the candidates after the first kMaxJoins. std::stable_sort is
/// not used, because it would allocate memory. Not a template, so that the sort is compiled once.
void keep_best(std::vector<JoinCandidate>& joins) {
  for (std::uint32_t i = 0; i < joins.size(); ++i) joins[i].met = i;
  std::sort(joins.begin(), joins.end(), [](const JoinCandidate& a, const JoinCandidate& b) {
    return a.score != b.score ? a.score > b.score : a.met < b.met;
  });
  if (joins.size() > kMaxJoins) joins.resize(kMaxJoins);
}

/// The parts of a quadrilateral face other than one of its edges. `a` and `b`: the vertices next to
/// the first and the second end of this edge. `beside_a`, `beside_b` and `top`: the other three
/// edges of the face.
struct Above {
  std::uint32_t a = kNone, b = kNone;
  FaceEdge beside_a = kNone, beside_b = kNone, top = kNone;
};
Above above(const ActiveSurface& surface, FaceEdge edge, std::uint32_t a) {
  const std::uint32_t face = edge / 4 * 4, i = edge % 4;
  const Quad& quad = surface.face(edge / 4).quad;
  const std::uint32_t two = (i + 2) % 4, three = (i + 3) % 4, one = (i + 1) % 4;
  if (quad[i] == a) return {quad[three], quad[two], face + three, face + one, face + two};
  return {quad[two], quad[three], face + one, face + three, face + two};
}

/// Returns true if the face belongs to a cell that is not a hexahedron. Of the cells in OpenFaces,
/// only hexahedra have eight corners.
bool is_of_other_cell(const OpenFaces& open, const OpenFaces::Face& face) {
  return open.owner(face).size < 8;
}

}  // namespace

template <class Coder>
bool RowHexahedra<Coder>::code(Coder& symbols, Coder& corner_order, const StoredCell& stored,
                               CellTopology& cell, bool order_matters) {
  work_ = Work{};
  Fit gate;
  Kind kind = kStart;
  if (!code_gate(symbols, stored, gate, kind)) return false;
  if constexpr (!Coder::kDecodes) {
    const auto& from_bits = kOrientedBits[gate.orientation];
    for (std::uint32_t b = 0; b < 8; ++b) {
      const std::uint32_t from = kCornerBits[from_bits[b]];
      work_.target[b] = stored.slots[from];
      work_.number[b] = stored.numbers[from];
    }
  }
  std::uint8_t orientation = gate.orientation;
  work_.kind = kind;
  gates_ = (gates_ << 3 | kind) & ((1u << 30) - 1);
  if (kind != kStart) {
    take_gate(gate.face);
    code_sides(symbols, gate.face);
  }
  for (std::uint32_t b = 0; b < 8; ++b)
    if ((work_.known >> b & 1) == 0 && !code_corner(symbols, cell, b)) return false;

  find_other_shared();
  if (kind != kStart && !code_orientation(corner_order, symbols, order_matters, orientation))
    return false;

  // Store the corners in the order of the frame (the axes of the hexahedron). In the encoder,
  // stored_corner refers to the order in which its caller stored the corners, even if a decoder
  // returns the corners in a different order.
  const auto& stored_bits = kOrientedBits[Coder::kDecodes ? orientation : gate.orientation];
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t b = kCornerBits[i];
    cell.slots[i] = work_.corner[b];
    cell.stored_corner[i] = kCornerBits[stored_bits[b]];
    if constexpr (!Coder::kDecodes) cell.last_use[i] = stored.last_use[cell.stored_corner[i]];
  }
  attach(cell);
  Record& record = records_[cell.cell_slot];
  record.orientation = orientation;
  record.guessed = kind == kCandidate;
  hits_ = (hits_ << 1 | (kind == kCandidate ? 1u : 0u)) & 7;
  return true;
}

// --- faces

/// Codes whether side `side` of the hexahedron is the active face `face` of an earlier hexahedron.
/// `above_a`, `above_b`: the vertices of `face` next to corners a and b.
template <class Coder>
bool RowHexahedra<Coder>::share(Coder& symbols, Bit& model, std::uint32_t side, std::uint32_t face,
                                std::uint32_t a, std::uint32_t b, std::uint32_t above_a,
                                std::uint32_t above_b) {
  if (!symbols.bit(model, work_.target[a] == above_a && work_.target[b] == above_b)) return false;
  work_.shared[side] = face;
  work_.corner[a] = above_a;
  work_.corner[b] = above_b;
  work_.known |= bit(a) | bit(b);
  return true;
}

template <class Coder>
void RowHexahedra<Coder>::code_sides(Coder& symbols, std::uint32_t gate) {
  const auto& face = surface_->face(gate);
  const std::uint32_t k = face.side;
  std::array<std::uint8_t, 4> order{};  // sides of the gate, largest fans first
  for (std::uint8_t i = 0; i < 4; ++i) {
    std::uint32_t place = i;
    for (; place > 0 && face.fan[order[place - 1]] < face.fan[i]; --place)
      order[place] = order[place - 1];
    order[place] = i;
  }
  std::array<Above, 4> sides{};
  std::uint32_t shared_count = 0;
  std::uint32_t yes = 0;  // bit i is set if the side at edge i of the gate (the face to which this
                          // hexahedron is attached) is shared with an earlier hexahedron
  for (std::uint32_t i : order) {
    const FaceEdge mate = face.mate[i];
    const std::uint32_t side = kAdjacentFace[k][i];
    if (mate == kNone || is_shared(mate / 4)) continue;
    // Corners above the gate
    const std::uint32_t a = kFaceBits[k][i], b = kFaceBits[k][(i + 1) % 4];
    Above& upper = sides[i];
    upper = above(*surface_, mate, face.quad[i]);
    if ((work_.known >> a & 1) != 0 && work_.corner[a] != upper.a) continue;
    if ((work_.known >> b & 1) != 0 && work_.corner[b] != upper.b) continue;
    // Count the evidence from the neighbouring sides.
    std::uint32_t in_favour = 0, against = 0;
    const auto count_evidence = [&](std::uint32_t other, FaceEdge edge) {
      if ((yes >> other & 1) == 0) return;
      const FaceEdge across = edge == kNone ? kNone : surface_->mate(edge);
      ++(across != kNone && across / 4 == mate / 4 ? in_favour : against);
    };
    const std::uint32_t before = (i + 3) % 4, after = (i + 1) % 4;
    count_evidence(before, sides[before].beside_b);
    count_evidence(after, sides[after].beside_a);
    constexpr std::array<std::array<std::uint8_t, 3>, 3> kEvidence = {
        {{0, 3, 5}, {1, 4, 4}, {2, 2, 2}}};
    const std::uint32_t evidence = kEvidence[in_favour][against];
    bool candidate = false;
    for (std::uint32_t n = 0; n < candidate_count_; ++n)
      candidate |= candidates_[n].face == mate / 4;
    auto& model = side_[std::min<std::uint32_t>(face.fan[i], 7)][evidence]
                       [work_.owner->shared >> side & 1][candidate ? 1 : 0][hits_ & 1];
    if constexpr (Coder::kMixes) about_side(symbols, gate * 4 + i, evidence, candidate, yes);
    if (!share(symbols, model, side, mate / 4, a, b, upper.a, upper.b)) continue;
    yes |= bit(i);
    ++shared_count;
  }
  // Code whether the far face (the face opposite to the gate) is shared with an earlier hexahedron.
  // The far face is found across the top edges of the shared sides.
  if (yes == 0 || (work_.known == 0xff)) return;
  const std::uint32_t far_side = kOppositeFace[work_.gate_side];
  for (std::uint32_t i = 0; i < 4; ++i) {
    if ((yes >> i & 1) == 0) continue;
    const FaceEdge mate = surface_->mate(sides[i].top);
    if (mate == kNone || is_shared(mate / 4)) continue;
    // Edge i of the far face runs from corner a to corner b. Corners c and d are opposite to this
    // edge.
    const std::uint32_t a = kFaceBits[k][i];
    const std::uint32_t c = kFaceBits[k][(i + 3) % 4], d = kFaceBits[k][(i + 2) % 4];
    const Above upper = above(*surface_, mate, work_.corner[a]);
    if ((work_.known >> c & 1) != 0 && work_.corner[c] != upper.a) continue;
    if ((work_.known >> d & 1) != 0 && work_.corner[d] != upper.b) continue;
    std::uint32_t support = 0;
    for (std::uint32_t j = 0; j < 4; ++j)
      if ((yes >> j & 1) != 0) {
        const FaceEdge other = surface_->mate(sides[j].top);
        support += other != kNone && other / 4 == mate / 4 ? 1 : 0;
      }
    auto& model = far_[std::min<std::uint32_t>(surface_->fan(sides[i].top), 7)][support]
                      [shared_count][work_.owner->shared >> far_side & 1];
    if constexpr (Coder::kMixes) about_far(symbols, sides[i].top, mate);
    share(symbols, model, far_side, mate / 4, c, d, upper.a, upper.b);
    return;
  }
}

// --- corners

/// Returns a measure of how likely the unknown corner `corner` is already on the surface. Each
/// known neighbour of the corner adds 2 if an edge on the surface leads from the neighbour towards
/// the corner and ends at a vertex that is not a known corner. The result increases by 1 if two
/// known neighbours of the corner are opposite vertices of an unshared face.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::count_leads(std::uint32_t corner) const {
  Corners known{};  // slots of the known corners; kNone if unknown
  for (std::uint32_t b = 0; b < 8; ++b)
    known[b] = (work_.known >> b & 1) != 0 ? work_.corner[b] : kNone;
  const auto inside = [&](std::uint32_t slot) {
    bool found = false;
    for (std::uint32_t b = 0; b < 8; ++b) found |= known[b] == slot;
    return found;
  };
  std::uint32_t leads = 0, around = 0;
  for (std::uint32_t axis : {1u, 2u, 4u}) {
    const std::uint32_t p = known[corner ^ axis];
    if (p == kNone) continue;
    const std::uint32_t direction = kFaceAt[axis][(corner & axis) != 0];
    const std::uint32_t q = known[corner ^ (axis == 1 ? 2 : 1)];
    const std::uint32_t r = known[corner ^ (axis == 4 ? 2 : 4)];
    bool leads_out = false;
    for (FaceCorner face_corner = surface_->vertex(p).first_face; face_corner != kNone;
         face_corner = surface_->next_around(face_corner)) {
      const auto& face = surface_->face(face_corner / 4);
      const auto& towards = kEdgesTowards[face.side][face_corner % 4];
      const Quad& quad = face.quad;
      if (!leads_out && ((towards[0] == direction && !inside(quad[(face_corner + 1) % 4])) ||
                         (towards[1] == direction && !inside(quad[(face_corner + 3) % 4]))))
        leads_out = true;
      const std::uint32_t across = quad[(face_corner + 2) % 4];
      if ((across == q || across == r) && !is_shared(face_corner / 4)) around = 1;
    }
    leads += leads_out ? 2 : 0;
  }
  return leads + around;
}

/// Lists the live vertices that may be this corner. They are connected on the surface to known
/// neighbours of the corner.
template <class Coder>
void RowHexahedra<Coder>::list_joins(std::uint32_t corner) {
  joins_.clear();
  join_place_.resize(surface_->vertex_slots());
  const auto known = [&](std::uint32_t b) { return (work_.known >> b & 1) != 0; };
  const auto add = [&](std::uint32_t slot, std::uint32_t score) {
    const std::uint32_t place = join_place_[slot];
    if (place < joins_.size() && joins_[place].slot == slot) {
      joins_[place].score += score;
      return;
    }
    for (std::uint32_t b = 0; b < 8; ++b)
      if (known(b) && work_.corner[b] == slot) return;
    join_place_[slot] = static_cast<std::uint32_t>(joins_.size());
    joins_.push_back({slot, score, 0});
  };
  for (std::uint32_t axis : {1u, 2u, 4u}) {
    const std::uint32_t p = corner ^ axis;
    if (!known(p)) continue;
    const std::uint32_t vertex = work_.corner[p];
    const std::uint32_t direction = kFaceAt[axis][(corner & axis) != 0];
    for (FaceCorner face_corner = surface_->vertex(vertex).first_face; face_corner != kNone;
         face_corner = surface_->next_around(face_corner)) {
      const auto& face = surface_->face(face_corner / 4);
      // skip shared faces, since all their corners belong to the current hexahedron
      if (is_shared(face_corner / 4)) continue;
      const std::uint32_t i = face_corner % 4;
      for (std::uint32_t step : {1u, 3u}) {
        const std::uint32_t j = (i + step) % 4;
        const std::uint32_t here = kFaceBits[face.side][i], there = kFaceBits[face.side][j];
        const bool same = kFaceAt[here ^ there][(there & ~here) != 0] == direction;
        add(face.quad[j], same ? 3 : 1);
      }
      // Let p be a known neighbour of the corner. Look for a face in which the vertex opposite to p
      // is another known neighbour.
      for (std::uint32_t other : {1u, 2u, 4u}) {
        if (other == axis || !known(corner ^ other)) continue;
        if (face.quad[(i + 2) % 4] == work_.corner[corner ^ other]) {
          add(face.quad[(i + 1) % 4], 2);
          add(face.quad[(i + 3) % 4], 2);
        }
      }
    }
  }
  keep_best(joins_);
}

template <class Coder>
bool RowHexahedra<Coder>::code_corner(Coder& symbols, CellTopology& cell, std::uint32_t corner) {
  std::uint32_t neighbours = 0;
  for (std::uint32_t axis : {1u, 2u, 4u}) neighbours += work_.known >> (corner ^ axis) & 1;
  const std::uint32_t known = work_.known;
  work_.known |= bit(corner);
  const bool owner_repeats = work_.owner != nullptr && (work_.owner->repeats >> corner & 1) != 0;
  const bool owner_introduced =
      work_.owner != nullptr && (work_.owner->introduced >> corner & 1) != 0;

  std::uint32_t again = 8;
  if constexpr (!Coder::kDecodes) {
    for (std::uint32_t b = 0; b < 8 && again == 8; ++b)
      if ((known >> b & 1) != 0 && work_.number[b] == work_.number[corner]) again = b;
  }
  if constexpr (Coder::kMixes) symbols.about(kRepeated);
  if (known != 0 && symbols.bit(repeated_[corner][neighbours][owner_repeats ? 1 : 0], again != 8)) {
    if constexpr (Coder::kMixes) symbols.about(kRepeatedWhich);
    const std::uint32_t b = code_tree(symbols, repeated_which_[corner], again & 7);
    if ((known >> b & 1) == 0) return false;
    work_.corner[corner] = work_.corner[b];
    return true;
  }

  work_.known = known;
  const ClosingVertex closing = open_ == nullptr ? ClosingVertex() : find_closing_vertex(corner);
  if (closing.slot != kNone) {
    if constexpr (Coder::kMixes) about_closing_vertex(symbols, corner, closing);
    if (symbols.bit(closes_[std::min(closing.score, 7u)][std::min(closing.others, 2u)],
                    closing.slot == work_.target[corner])) {
      work_.corner[corner] = closing.slot;
      work_.known |= bit(corner);
      return true;
    }
  }
  const std::uint32_t leads = count_leads(corner);
  if constexpr (Coder::kMixes) about_new(symbols, corner, leads, neighbours);
  work_.known |= bit(corner);
  auto& model =
      is_new_[work_.owner != nullptr ? 1 : 0][leads][neighbours][owner_introduced ? 1 : 0];
  if (symbols.bit(model, work_.target[corner] == kNone)) {
    work_.corner[corner] = surface_->add_vertex();
    work_.introduced |= static_cast<std::uint8_t>(bit(corner));
    cell.new_positions.push_back(kCornerBits[corner]);
    return true;
  }
  work_.known = known;
  list_joins(corner);
  work_.known |= bit(corner);
  for (std::uint32_t rank = 0; rank < joins_.size(); ++rank) {
    auto& yes = join_[std::min(rank, 7u)][std::min(joins_[rank].score, 7u)];
    if constexpr (Coder::kMixes) about_join(symbols, rank);
    if (!symbols.bit(yes, joins_[rank].slot == work_.target[corner])) continue;
    work_.corner[corner] = joins_[rank].slot;
    return true;
  }
  std::uint32_t slot = work_.target[corner];
  if (!code_reference(symbols, slot)) return false;
  work_.corner[corner] = slot;
  return true;
}

template <class Coder>
bool RowHexahedra<Coder>::code_reference(Coder& symbols, std::uint32_t& slot) {
  std::uint64_t id = 0;
  bool near = false;
  const std::uint64_t oldest = surface_->oldest_id(), last = last_reference_;
  if constexpr (!Coder::kDecodes) {
    id = surface_->vertex(slot).id;
    near = (id > last ? id - last : last - id) <= id - oldest;
  }
  if constexpr (Coder::kMixes) about_reference(symbols, kFromLast);
  if (symbols.bit(from_last_, near)) {
    if constexpr (Coder::kMixes) about_reference(symbols, kReferenceStep);
    id = last + static_cast<std::uint64_t>(
                    code_signed(symbols, reference_step_, static_cast<std::int64_t>(id - last)));
  } else {
    if constexpr (Coder::kMixes) about_reference(symbols, kReferenceAge);
    id = oldest + code_number(symbols, reference_age_, id - oldest);
  }
  last_reference_ = id;
  slot = surface_->slot_of(id);
  return slot != kNone;
}

// --- hexahedra next to cells of other shapes: open quadrilaterals of these cells

/// Finds the vertex that, as this corner, would close the largest number of open quadrilaterals.
/// Let p be a known neighbour of the corner, and let r be the known corner next to p in a side of
/// the hexahedron. A quadrilateral counts if it has the edge from p to r. If the fourth corner q of
/// this side is also known, the quadrilateral must contain q in the same place.
template <class Coder>
auto RowHexahedra<Coder>::find_closing_vertex(std::uint32_t corner) -> ClosingVertex {
  joins_.clear();
  const auto known = [&](std::uint32_t b) { return (work_.known >> b & 1) != 0; };
  const auto add = [&](std::uint32_t slot, std::uint32_t score) {
    for (std::uint32_t b = 0; b < 8; ++b)
      if (known(b) && work_.corner[b] == slot) return;
    for (JoinCandidate& join : joins_)
      if (join.slot == slot) {
        join.score += score;
        return;
      }
    joins_.push_back({slot, score, 0});
  };
  for (std::uint32_t axis : {1u, 2u, 4u})
    for (std::uint32_t other : {1u, 2u, 4u}) {
      if (other == axis || !known(corner ^ axis) || !known(corner ^ axis ^ other)) continue;
      const std::uint32_t p = work_.corner[corner ^ axis], r = work_.corner[corner ^ axis ^ other];
      const std::uint32_t q = known(corner ^ other) ? work_.corner[corner ^ other] : kNone;
      open_->around(p, [&](const OpenFaces::Face& face, std::uint32_t place) {
        if (face.size != 4 || !is_of_other_cell(*open_, face)) return;
        if (q != kNone && face.node[(place + 2) % 4] != q) return;
        for (std::uint32_t step : {1u, 3u})
          if (face.node[(place + step) % 4] == r)
            add(face.node[(place + 4 - step) % 4], q == kNone ? 2 : 3);
      });
    }
  ClosingVertex best;
  for (const JoinCandidate& join : joins_)
    if (join.score > best.score) best = {join.slot, join.score, 0};
  best.others = joins_.empty() ? 0 : static_cast<std::uint32_t>(joins_.size() - 1);
  return best;
}

/// Returns the number of open faces at a vertex that belong to cells other than hexahedra, at most
/// 3.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::open_faces_of_others(std::uint32_t slot) const {
  if (open_ == nullptr) return 0;
  const std::uint32_t bare = open_->vertex(slot).bare, own = surface_->vertex(slot).face_count;
  return bare > own ? std::min(bare - own, 3u) : 0;
}

// --- last use

template <class Coder>
void RowHexahedra<Coder>::code_last_use(Coder& symbols, CellTopology& cell) {
  Record& record = records_[cell.cell_slot];
  // Find the candidates for the gate of the next hexahedron: active faces to which it may be
  // attached. It will probably use their vertices, so this hexahedron is probably not the last that
  // uses them
  list_candidates();
  std::array<std::uint32_t, 8> slots{}, wanted{};  // wanted: number of candidates with this vertex
  std::copy_n(cell.slots.begin(), 8, slots.begin());
  for (std::uint32_t n = 0; n < candidate_count_; ++n) {
    const Quad quad = surface_->face(candidates_[n].face).quad;
    for (std::size_t i = 0; i < 8; ++i)
      wanted[i] += static_cast<std::uint32_t>(slots[i] == quad[0]) | (slots[i] == quad[1]) |
                   (slots[i] == quad[2]) | (slots[i] == quad[3]);
  }
  const std::uint32_t owner_finals = work_.owner != nullptr ? owner_.finals : 0;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint32_t b = kCornerBits[i];
    bool first = true;
    if (record.repeats != 0)
      for (std::uint32_t j = 0; j < i; ++j) first = first && cell.slots[j] != cell.slots[i];
    if (!first) {
      cell.last_use[i] = 0;
      continue;
    }
    const auto& vertex = surface_->vertex(slots[i]);
    auto& model =
        final_[open_faces_of_others(slots[i])][std::min(vertex.face_count, 7u)]
              [std::min(vertex.uses, 8u)][(owner_finals >> b & 1) * 2 + (last_finals_ >> b & 1)]
              [std::min(wanted[i], 2u)];
    if constexpr (Coder::kMixes) about_last_use(symbols, record, b, slots[i], wanted[i]);
    const bool last = symbols.bit(model, cell.last_use[i] != 0);
    cell.last_use[i] = last ? 1 : 0;
    if (last) record.finals |= static_cast<std::uint8_t>(bit(b));
  }
  last_finals_ = record.finals;
}

template class RowHexahedra<RangeEncoder>;
template class RowHexahedra<RangeDecoder>;
template class RowHexahedra<MixingCoder<RangeEncoder>>;
template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
