// What RowHexahedra does once all corners are known: shared faces that nobody spoke of, the order
// in which corners are stored, and the surface.
#include <algorithm>
#include <utility>

#include "connectivity/row_hexahedra.h"
#include "surface/hexahedron.h"

namespace shm {

template <class Coder>
void RowHexahedra<Coder>::find_unspoken() {
  const auto& v = work_.corner;
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] != kNone) continue;
    const auto& q = kFaceBits[k];
    bool old = true;
    for (std::uint32_t b : q) old = old && (work_.fresh >> b & 1) == 0;
    if (!old) continue;
    const std::uint32_t face = surface_->find_face(v[q[0]], v[q[1]], v[q[2]], v[q[3]]);
    if (face != kNone && !taken(face)) work_.shared[k] = face;
  }
}

/// The orientation of the hexahedron behind a shared face, moved across it.
template <class Coder>
std::uint8_t RowHexahedra<Coder>::expected_orientation(std::uint32_t side) const {
  const auto& face = surface_->face(work_.shared[side]);
  const auto& stored = kOrientedBits[records_[face.cell].orientation];
  std::array<std::uint32_t, 4> here{}, there{};  // corner bits in this frame; stored in that cell
  for (std::uint32_t i : {0u, 1u, 3u}) {
    here[i] = 8;
    for (std::uint32_t b : kFaceBits[side])
      if (here[i] == 8 && work_.corner[b] == face.quad[i]) here[i] = b;
    there[i] = stored[kFaceBits[face.side][i] ^ kFaceAxis[face.side]];
  }
  const std::uint32_t u = here[0] ^ here[1], v = here[0] ^ here[3];
  if ((here[0] | here[1] | here[3]) > 7 || std::popcount(u) != 1 || std::popcount(v) != 1 || u == v)
    return kOrientationCount;
  std::array<std::uint32_t, 5> image{};
  image[u] = there[0] ^ there[1];
  image[v] = there[0] ^ there[3];
  image[7 ^ u ^ v] = 7 ^ image[u] ^ image[v];
  std::uint32_t base = there[0];
  for (std::uint32_t a : {1u, 2u, 4u})
    if ((here[0] & a) != 0) base ^= image[a];
  return orientation_of(base, image[1], image[2]);
}

template <class Coder>
bool RowHexahedra<Coder>::code_orientation(Coder& corner_order, Coder& symbols, bool order_matters,
                                           std::uint8_t& orientation) {
  if (!order_matters) {
    if constexpr (Coder::kMixes) symbols.about(kMirrored);
    const bool flip =
        symbols.bit(mirrored_[is_mirrored(owner_.orientation) ? 1 : 0], is_mirrored(orientation));
    orientation = flip ? kMirrorX : 0;
    return true;
  }
  // What the hexahedra behind shared faces expect, most votes first, the gate's owner on a tie.
  struct Vote {
    std::uint8_t orientation = 0, count = 0;
  };
  std::array<Vote, 6> votes{{{owner_.orientation, 1}}};
  std::uint32_t count = 1, voters = 1;
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] == kNone || k == work_.gate_side) continue;
    const std::uint8_t it = expected_orientation(k);
    if (it == kOrientationCount) continue;
    ++voters;
    std::uint32_t i = 0;
    while (i < count && votes[i].orientation != it) ++i;
    if (i == count) votes[count++] = {it, 0};
    ++votes[i].count;
  }
  for (std::uint32_t i = 1; i < count; ++i)
    for (std::uint32_t at = i; at > 0 && votes[at - 1].count < votes[at].count; --at)
      std::swap(votes[at - 1], votes[at]);
  for (std::uint32_t i = 0; i < std::min(count, 3u); ++i) {
    auto& model = orientation_hit_[i][std::min<std::uint32_t>(votes[i].count, 4)]
                                  [std::min(voters, 4u)][orientation_hits_];
    if constexpr (Coder::kMixes)
      about_orientation(corner_order, i, votes[i].orientation, votes[i].count, voters);
    const bool hit = corner_order.bit(model, orientation == votes[i].orientation);
    if (i == 0) orientation_hits_ = (orientation_hits_ << 1 | (hit ? 1u : 0u)) & 7;
    if (!hit) continue;
    orientation = votes[i].orientation;
    return true;
  }
  return code_turn(corner_order, orientation);
}

/// The orientation by how the stored faces meet at the gate: which of this hexahedron's, and
/// where the other's lowest corner stands in it.
template <class Coder>
bool RowHexahedra<Coder>::code_turn(Coder& corner_order, std::uint8_t& orientation) {
  const auto face_of = [](std::uint32_t o, std::uint32_t side) {
    const auto& s = kOrientedBits[o];
    const auto& q = kFaceBits[side];
    const std::uint32_t axis = 7u & ~((s[q[0]] ^ s[q[1]]) | (s[q[0]] ^ s[q[3]]));
    return face_at(axis, (s[q[0]] & axis) != 0);
  };
  const std::uint32_t side = kOppositeFace[work_.gate_side];  // of the owner
  const std::uint32_t theirs = face_of(owner_.orientation, side);
  std::uint32_t lowest = 0;
  for (std::uint32_t i = 1; i < 4; ++i)
    if (kOrientedBits[owner_.orientation][kFaceBits[side][i]] <
        kOrientedBits[owner_.orientation][kFaceBits[side][lowest]])
      lowest = i;
  const std::uint32_t at = kFaceBits[side][lowest] ^ kFaceAxis[side];
  std::uint32_t mine = 0, corner = 0;
  bool turned = false;
  if constexpr (!Coder::kDecodes) {
    mine = face_of(orientation, work_.gate_side);
    while (kFaceBits[mine][corner] != kOrientedBits[orientation][at]) ++corner;
    turned = is_mirrored(orientation) != is_mirrored(owner_.orientation);
  }
  if constexpr (Coder::kMixes) about_stored_face(corner_order, theirs);
  mine = code_tree(corner_order, stored_face_[theirs][last_stored_face_], mine);
  if (mine >= 6) return false;
  last_stored_face_ = mine;
  if constexpr (Coder::kMixes) about_stored_corner(corner_order, mine);
  corner = code_tree(corner_order, stored_corner_[theirs][mine], corner);
  if constexpr (Coder::kMixes) corner_order.about(kTurned);
  turned = corner_order.bit(turned_[0], turned);
  for (std::uint8_t o = 0; o < kOrientationCount; ++o)
    if (kOrientedBits[o][at] == kFaceBits[mine][corner] && face_of(o, work_.gate_side) == mine &&
        (is_mirrored(o) != is_mirrored(owner_.orientation)) == turned) {
      orientation = o;
      return true;
    }
  return false;
}

template <class Coder>
void RowHexahedra<Coder>::glue(CellTopology& cell) {
  const auto& v = work_.corner;
  // Those behind shared faces are where the next hexahedron is looked for: oldest first.
  owner_count_ = 0;
  std::uint8_t shared_mask = 0;
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] == kNone) continue;
    shared_mask |= static_cast<std::uint8_t>(bit(k));
    const auto& face = surface_->face(work_.shared[k]);
    cell.face_mask |= static_cast<std::uint8_t>(bit(k));
    Owner owner{face.cell, records_[face.cell].sequence, face.side};
    std::uint32_t at = owner_count_++;
    for (; at > 0 && owners_[at - 1].sequence > owner.sequence; --at) owners_[at] = owners_[at - 1];
    owners_[at] = owner;
  }
  const std::uint32_t previous = last_cell_;
  cell.cell_slot = surface_->begin_cell();
  if (records_.size() <= cell.cell_slot) records_.resize(cell.cell_slot + 1);
  if (previous != kNone && records_[previous].sequence + 1 == sequence_)
    records_[previous].successor = cell.cell_slot;
  Record& record = records_[cell.cell_slot];
  record = Record{};
  record.sequence = sequence_++;
  if (births_.size() > 2 * records_.size() + 64)
    std::erase_if(births_, [&](const Birth& birth) {
      return records_[birth.cell].sequence != birth.sequence;
    });
  births_.push_back({record.sequence, cell.cell_slot});
  record.shared = shared_mask;
  record.fresh = work_.fresh;
  for (std::uint32_t i = 1; i < 8; ++i)
    for (std::uint32_t j = 0; j < i; ++j)
      if (v[i] == v[j]) record.repeats |= static_cast<std::uint8_t>(bit(i));
  last_cell_ = cell.cell_slot;

  std::array<std::uint32_t, 6> face{};
  for (std::uint32_t k = 0; k < 6; ++k) {
    face[k] = work_.shared[k];
    if (face[k] != kNone) continue;
    const auto& q = kFaceBits[k];
    const Quad quad = {v[q[0]], v[q[1]], v[q[2]], v[q[3]]};
    std::uint32_t same = 0;
    bool room = true;
    for (std::uint32_t i = 0; i < 4; ++i) {
      for (std::uint32_t j = 0; j < i; ++j) same += quad[i] == quad[j] ? 1 : 0;
      room = room && surface_->vertex(quad[i]).face_count < kMaxFacesAtVertex;
    }
    if (same > 1 || !room) continue;
    face[k] = surface_->add_face(quad, {}, static_cast<std::uint8_t>(k));
    record.face[k] = face[k];
  }
  link_edges(face);
  for (std::uint32_t k = 0; k < 6; ++k)
    if (work_.shared[k] != kNone) surface_->remove_face(work_.shared[k]);
}

/// Around each of the 12 edges the faces at both ends of the fan become mates.
template <class Coder>
void RowHexahedra<Coder>::link_edges(const std::array<std::uint32_t, 6>& face) {
  const auto& v = work_.corner;
  // Edge i of the hexahedron's face k is edge first[k] + i * step[k] of a shared face.
  std::array<std::uint32_t, 6> first{}, step{};
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] == kNone) continue;
    const Quad& quad = surface_->face(face[k]).quad;
    const std::uint32_t a = v[kFaceBits[k][0]], b = v[kFaceBits[k][1]], c = v[kFaceBits[k][2]];
    for (std::uint32_t j = 0; j < 4 && step[k] == 0; ++j) {
      if (quad[j] != a || quad[(j + 2) % 4] != c) continue;
      const bool same_way = quad[(j + 1) % 4] == b;
      first[k] = same_way ? j : j + 3;
      step[k] = same_way ? 1 : 3;
    }
  }
  for (const EdgeFaces& edge : kEdgeFaces) {
    std::array<FaceEdge, 2> mine{}, end{};
    std::uint32_t fan = 1;
    for (std::uint32_t n = 0; n < 2; ++n) {
      const std::uint32_t k = edge.face[n], i = edge.edge[n];
      mine[n] = end[n] = kNone;
      if (face[k] == kNone) continue;
      if (work_.shared[k] == kNone) {
        end[n] = face[k] * 4 + i;
        continue;
      }
      // The same edge on the shared face, and what lies across it there.
      mine[n] = face[k] * 4 + (first[k] + i * step[k]) % 4;
      end[n] = surface_->mate(mine[n]);
      fan += surface_->fan(mine[n]);
    }
    // Two shared faces that are mates here close around the edge: both are about to go.
    const bool closed = mine[0] != kNone && mine[1] != kNone && end[0] == mine[1];
    if (!closed) surface_->join(end[0], end[1], fan);
  }
}

template class RowHexahedra<RangeEncoder>;
template class RowHexahedra<RangeDecoder>;
template class RowHexahedra<MixingCoder<RangeEncoder>>;
template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
