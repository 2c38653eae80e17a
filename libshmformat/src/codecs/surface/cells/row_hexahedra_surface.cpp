// RowHexahedra: the functions that work on the active surface. The first part codes the gate, which
// is the active face to which a hexahedron is attached. The second part is called when all corners
// are known. It finds the other shared faces, codes the stored order of the corners, and updates
// the surface.
#include <algorithm>
#include <bit>
#include <utility>

#include "codecs/surface/cells/row_hexahedra.h"

namespace shm {
namespace {

constexpr std::uint32_t kChainLength = 32;

/// Returns true if two of the eight numbers are equal.
bool has_repeats(const std::array<std::uint32_t, 8>& numbers) {
  std::array<std::uint32_t, 12> cyclic{};  // so that each number is followed by the next four
  for (std::size_t i = 0; i < 12; ++i) cyclic[i] = numbers[i % 8];
  std::uint32_t found = 0;
  for (std::size_t distance = 1; distance <= 4; ++distance)
    for (std::size_t i = 0; i < 8; ++i)
      found |= static_cast<std::uint32_t>(cyclic[i] == cyclic[i + distance]);
  return found != 0;
}

/// Returns true if exactly one bit is set. (std::has_single_bit() calls a function on processors
/// without an instruction that counts bits.)
bool is_one_axis(std::uint32_t bits) { return bits != 0 && (bits & (bits - 1)) == 0; }

}  // namespace

// --- the gate

template <class Coder>
std::uint32_t RowHexahedra<Coder>::live_face(std::uint32_t cell, std::uint32_t side) const {
  const std::uint32_t face = records_[cell].face[side];
  if (face == kNone) return kNone;
  const auto& entry = surface_->face(face);
  return entry.alive && entry.cell == cell && entry.side == side ? face : kNone;
}

/// Lists the candidates for the gate of the next hexahedron. The list is still valid if no face has
/// been removed since it was made for the same hexahedra.
template <class Coder>
void RowHexahedra<Coder>::list_candidates() {
  if (candidates_at_ == surface_->removed_faces()) return;
  candidates_at_ = surface_->removed_faces();
  candidate_count_ = 0;
  for (std::uint32_t n = 0; n < owner_count_; ++n) {
    const Owner& owner = owners_[n];
    const Record& record = records_[owner.cell];
    if (record.sequence != owner.sequence || record.successor == kNone) continue;
    if (records_[record.successor].sequence != owner.sequence + 1) continue;
    const std::uint32_t face = live_face(record.successor, owner.side);
    if (face == kNone) continue;
    bool twice = false;
    for (std::uint32_t i = 0; i < candidate_count_; ++i) twice |= candidates_[i].face == face;
    if (twice) continue;
    candidates_[candidate_count_++] = {face, 0, records_[record.successor].guessed};
  }
  for (std::uint32_t i = 1; i < candidate_count_; ++i)
    for (std::uint32_t j = 0; j < i; ++j)
      for (FaceEdge mate : surface_->face(candidates_[i].face).mate)
        if (mate != kNone && mate / 4 == candidates_[j].face) {
          ++candidates_[i].support;
          ++candidates_[j].support;
          break;
        }
}

template <class Coder>
auto RowHexahedra<Coder>::fit(const StoredCell& stored, std::uint32_t face) const -> Fit {
  const auto& entry = surface_->face(face);
  const std::uint32_t axis = kFaceAxis[entry.side];
  std::array<std::uint32_t, 4> g{};
  for (std::uint32_t i = 0; i < 4; ++i) g[i] = kFaceBits[entry.side][i] ^ axis;
  const auto slot = [&](std::uint32_t bits) { return stored.slots[kCornerBits[bits]]; };
  for (std::uint32_t s0 = 0; s0 < 8; ++s0) {
    if (slot(s0) != entry.quad[0]) continue;
    for (std::uint32_t x = 1; x < 8; x <<= 1) {
      if (slot(s0 ^ x) != entry.quad[1]) continue;
      for (std::uint32_t y = 1; y < 8; y <<= 1) {
        if (y == x || slot(s0 ^ y) != entry.quad[3] || slot(s0 ^ x ^ y) != entry.quad[2]) continue;
        std::array<std::uint32_t, 5> image{};
        image[g[0] ^ g[1]] = x;
        image[g[0] ^ g[3]] = y;
        image[axis] = 7 ^ x ^ y;
        std::uint32_t base = s0;
        for (std::uint32_t a : {1u, 2u, 4u})
          if ((g[0] & a) != 0) base ^= image[a];
        return {face, kOrientationOf[base][image[1]][image[2]]};
      }
    }
  }
  return {};
}

template <class Coder>
void RowHexahedra<Coder>::find_shared(const StoredCell& stored, std::vector<Fit>& out) const {
  out.clear();
  for (std::uint32_t k = 0; k < 6; ++k) {
    const auto& c = kFaceCorners[k];
    bool old = true;
    for (std::uint32_t i : c) old = old && stored.slots[i] != kNone;
    if (!old) continue;
    const auto& v = stored.slots;
    const std::uint32_t face = surface_->find_face(v[c[0]], v[c[1]], v[c[2]], v[c[3]]);
    if (face == kNone) continue;
    const Fit found = fit(stored, face);
    if (found.face != kNone) out.push_back(found);
  }
}

template <class Coder>
void RowHexahedra<Coder>::list_chain(std::vector<std::uint32_t>& out) const {
  out.clear();
  for (std::uint32_t n = 0; n < std::min(owner_count_, 2u); ++n) {
    std::uint32_t cell = owners_[n].cell;
    std::uint64_t sequence = owners_[n].sequence;
    if (records_[cell].sequence != sequence) continue;
    for (std::uint32_t steps = 0; steps < kChainLength; ++steps) {
      const std::uint32_t next = records_[cell].successor;
      if (next == kNone || records_[next].sequence != sequence + 1) break;
      cell = next;
      ++sequence;
      const std::uint32_t face = live_face(cell, owners_[n].side);
      if (face == kNone || std::find(out.begin(), out.end(), face) != out.end()) continue;
      bool is_candidate = false;
      for (std::uint32_t i = 0; i < candidate_count_; ++i)
        is_candidate |= candidates_[i].face == face;
      if (!is_candidate) out.push_back(face);
    }
  }
}

template <class Coder>
void RowHexahedra<Coder>::list_at_edges(std::vector<std::uint32_t>& out) const {
  out.clear();
  if (last_cell_ == kNone) return;
  for (std::uint32_t side : {5u, 4u, 3u, 2u, 1u, 0u}) {
    const std::uint32_t face = live_face(last_cell_, side);
    if (face == kNone) continue;
    for (FaceEdge mate : surface_->face(face).mate) {
      if (mate == kNone || surface_->face(mate / 4).cell == last_cell_) continue;
      if (std::find(out.begin(), out.end(), mate / 4) == out.end()) out.push_back(mate / 4);
    }
  }
}

template <class Coder>
void RowHexahedra<Coder>::list_faces(Kind kind, std::vector<std::uint32_t>& out) const {
  out.clear();
  if (kind == kPrevious && last_cell_ != kNone)
    for (std::uint32_t side = 0; side < 6; ++side)
      if (live_face(last_cell_, side) != kNone) out.push_back(live_face(last_cell_, side));
  if (kind == kChain) list_chain(out);
  if (kind == kAtEdge) list_at_edges(out);
}

template <class Coder>
bool RowHexahedra<Coder>::code_gate(Coder& symbols, const StoredCell& stored, Fit& gate,
                                    Kind& kind) {
  list_candidates();
  if (code_candidate(symbols, stored, gate)) {
    kind = kCandidate;
    return true;
  }
  std::uint32_t index = 0;  // index in the list of its kind
  kind = kStart;
  if constexpr (!Coder::kDecodes) kind = choose_elsewhere(stored, gate, index);
  if constexpr (Coder::kMixes) about_kind(symbols);
  const std::uint32_t coded = code_tree(symbols, kind_[kinds_], static_cast<std::uint32_t>(kind));
  if (coded >= kKinds || coded == kCandidate) return false;
  kind = static_cast<Kind>(coded);
  kinds_ = (kinds_ << 3 | coded) & 63;
  switch (kind) {
    case kPrevious:
      return last_cell_ != kNone && code_side(symbols, kPreviousSide, last_cell_, gate.face);
    case kChain: return code_listed(symbols, kind, chain_, index, gate.face);
    case kAtEdge: return code_listed(symbols, kind, at_edge_, index, gate.face);
    case kRecent: return code_recent(symbols, gate.face);
    case kStart: return true;
    default: return false;
  }
}

/// Codes whether the gate (the face to which the hexahedron is attached) is a candidate. If it is,
/// codes which candidate it is. Encoding: sets `gate` if a candidate is the gate.
template <class Coder>
bool RowHexahedra<Coder>::code_candidate(Coder& symbols, const StoredCell& stored, Fit& gate) {
  if (candidate_count_ == 0) return false;
  const std::uint32_t none = candidate_count_;
  std::uint32_t hit = none;
  if constexpr (!Coder::kDecodes)
    for (std::uint32_t i = 0; i < candidate_count_ && hit == none; ++i) {
      gate = fit(stored, candidates_[i].face);
      if (gate.face != kNone) hit = i;
    }
  const Candidate& first = candidates_[0];
  auto& model = hit_[candidate_count_][std::min(first.support, 3u)][hits_][first.guessed ? 1 : 0];
  if constexpr (Coder::kMixes) about_candidates(symbols);
  if (!symbols.bit(model, hit != none)) return false;
  std::uint32_t i = 0;
  for (; i + 1 < candidate_count_; ++i) {
    const Candidate& candidate = candidates_[i];
    const std::uint32_t side = surface_->face(candidate.face).side;
    const std::uint32_t again =
        (side == last_gate_side_ ? 1u : 0u) + (side == gate_side_before_ ? 2u : 0u);
    auto& yes = which_[std::min(candidate_count_ - i, 3u)][std::min(i, 3u)]
                      [std::min(candidate.support, 3u)][again][candidate.guessed ? 1 : 0];
    if constexpr (Coder::kMixes) about_candidate(symbols, i);
    if (symbols.bit(yes, hit == i)) break;
  }
  gate.face = candidates_[i].face;
  return true;
}

/// Encoder: chooses the gate of a hexahedron that shares no face with the candidates. The gate must
/// be an active face that the hexahedron shares. Returns the kind of rule by which the gate can be
/// found: kPrevious, kChain and kAtEdge are tried in this order. If all three fail, returns
/// kRecent. With this rule, the distance to the owner of the gate is coded, so a gate with a
/// recently used distance is preferred, otherwise the gate with the smallest distance. Returns
/// kStart if no face is shared.
template <class Coder>
auto RowHexahedra<Coder>::choose_elsewhere(const StoredCell& stored, Fit& gate,
                                           std::uint32_t& index) -> Kind {
  gate = {};
  find_shared(stored, fits_);
  if (fits_.empty()) return kStart;
  for (Kind kind : {kPrevious, kChain, kAtEdge}) {
    list_faces(kind, faces_);
    for (index = 0; index < faces_.size(); ++index)
      for (const Fit& found : fits_)
        if (found.face == faces_[index]) {
          gate = found;
          return kind;
        }
  }
  std::uint64_t youngest = ~std::uint64_t{0};
  for (const Fit& found : fits_) {
    const std::uint64_t distance = sequence_ - records_[surface_->face(found.face).cell].sequence;
    const bool again =
        std::find(distances_.begin(), distances_.end(), distance) != distances_.end();
    if (again || distance < youngest) gate = found;
    youngest = std::min(youngest, distance);
    if (again) break;
  }
  return kRecent;
}

template <class Coder>
bool RowHexahedra<Coder>::code_listed(Coder& symbols, Kind kind, Choice<32>& model,
                                      std::uint32_t index, std::uint32_t& face) {
  list_faces(kind, faces_);
  if (faces_.empty()) return false;
  if constexpr (Coder::kMixes) about_listed(symbols, kind);
  face = faces_[code_choice(symbols, model, static_cast<std::uint32_t>(faces_.size()), index)];
  return true;
}

/// Codes which active face of a hexahedron is the gate, as the index of a side of this hexahedron.
template <class Coder>
bool RowHexahedra<Coder>::code_side(Coder& symbols, Question question, std::uint32_t cell,
                                    std::uint32_t& face) {
  auto& models = question == kPreviousSide ? previous_side_ : recent_side_;
  std::uint32_t left = 0;
  for (std::uint32_t side = 0; side < 6; ++side) left += live_face(cell, side) != kNone ? 1 : 0;
  for (std::uint32_t side = 0; side < 6; ++side) {
    const std::uint32_t live = live_face(cell, side);
    if (live == kNone) continue;
    if constexpr (Coder::kMixes)
      if (left > 1) about_cell_side(symbols, question, cell, side, left);
    if (--left > 0 && !symbols.bit(models[last_side_].yes[side], live == face)) continue;
    face = live;
    last_side_ = side;
    return true;
  }
  return false;
}

/// Codes any active face: the number of hexahedra since the owner of the face was coded, and the
/// index of the face in its owner.
template <class Coder>
bool RowHexahedra<Coder>::code_recent(Coder& symbols, std::uint32_t& face) {
  std::uint64_t distance = 0;
  if constexpr (!Coder::kDecodes)
    distance = sequence_ - records_[surface_->face(face).cell].sequence;
  const auto begin = distances_.begin();
  auto place = std::find(begin, distances_.end(), distance);
  if constexpr (Coder::kMixes) about_distance(symbols, kDistanceAgain);
  if (symbols.bit(distance_again_, place != distances_.end())) {
    if constexpr (Coder::kMixes) about_distance(symbols, kDistanceWhich);
    place =
        begin + code_tree(symbols, distance_which_, static_cast<std::uint32_t>(place - begin) & 7);
    distance = *place;
    std::rotate(begin, place, place + 1);
  } else {
    if constexpr (Coder::kMixes) about_distance(symbols, kDistance);
    distance = code_number(symbols, distance_, distance);
    std::rotate(begin, distances_.end() - 1, distances_.end());
    distances_[0] = distance;
  }
  if (distance == 0 || distance > sequence_) return false;
  const std::uint32_t cell =
      Coder::kDecodes ? cell_of(sequence_ - distance) : surface_->face(face).cell;
  return cell != kNone && code_side(symbols, kRecentSide, cell, face);
}

/// Returns the cell slot of the hexahedron with sequence number `sequence`, or kNone if its record
/// has been removed.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::cell_of(std::uint64_t sequence) const {
  const auto found = std::lower_bound(
      coded_.begin(), coded_.end(), sequence,
      [](const Coded& coded, std::uint64_t wanted) { return coded.sequence < wanted; });
  const bool here = found != coded_.end() && found->sequence == sequence &&
                    records_[found->cell].sequence == sequence;
  return here ? found->cell : kNone;
}

template <class Coder>
void RowHexahedra<Coder>::take_gate(std::uint32_t face) {
  const auto& entry = surface_->face(face);
  owner_ = records_[entry.cell];
  work_.owner = &owner_;
  gate_side_before_ = std::exchange(last_gate_side_, entry.side);
  work_.gate_side = kOppositeFace[entry.side];
  work_.shared[work_.gate_side] = face;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t b = kFaceBits[entry.side][i] ^ kFaceAxis[entry.side];
    work_.corner[b] = entry.quad[i];
    work_.known |= bit(b);
  }
}

// --- once all corners are known

template <class Coder>
void RowHexahedra<Coder>::find_other_shared() {
  const auto& v = work_.corner;
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] != kNone) continue;
    const auto& q = kFaceBits[k];
    bool old = true;
    for (std::uint32_t b : q) old = old && (work_.introduced >> b & 1) == 0;
    if (!old) continue;
    const std::uint32_t face = surface_->find_face(v[q[0]], v[q[1]], v[q[2]], v[q[3]]);
    if (face != kNone && !is_shared(face)) work_.shared[k] = face;
  }
}

/// Returns the orientation that the hexahedron across a shared face suggests for the current
/// hexahedron.
template <class Coder>
std::uint8_t RowHexahedra<Coder>::orientation_across(std::uint32_t side) const {
  const auto& face = surface_->face(work_.shared[side]);
  const auto& stored = kOrientedBits[records_[face.cell].orientation];
  std::array<std::uint32_t, 4> here{},
      // For each shared vertex: its corner bits in the frame of this hexahedron (here), and its
      // corner bits in the stored order of the neighbouring hexahedron (there)
      there{};
  for (std::uint32_t i : {0u, 1u, 3u}) {
    here[i] = 8;
    for (std::uint32_t b : kFaceBits[side])
      if (here[i] == 8 && work_.corner[b] == face.quad[i]) here[i] = b;
    there[i] = stored[kFaceBits[face.side][i] ^ kFaceAxis[face.side]];
  }
  const std::uint32_t u = here[0] ^ here[1], v = here[0] ^ here[3];
  if ((here[0] | here[1] | here[3]) > 7 || !is_one_axis(u) || !is_one_axis(v) || u == v)
    return kOrientationCount;
  std::array<std::uint32_t, 5> image{};
  image[u] = there[0] ^ there[1];
  image[v] = there[0] ^ there[3];
  image[7 ^ u ^ v] = 7 ^ image[u] ^ image[v];
  std::uint32_t base = there[0];
  for (std::uint32_t a : {1u, 2u, 4u})
    if ((here[0] & a) != 0) base ^= image[a];
  return kOrientationOf[base][image[1]][image[2]];
}

template <class Coder>
bool RowHexahedra<Coder>::code_orientation(Coder& corner_order, Coder& symbols, bool order_matters,
                                           std::uint8_t& orientation) {
  if (!order_matters) {
    if constexpr (Coder::kMixes) symbols.about(kMirrored);
    const bool flip =
        symbols.bit(mirrored_[kIsMirrored[owner_.orientation] ? 1 : 0], kIsMirrored[orientation]);
    orientation = flip ? kMirrorX : 0;
    return true;
  }
  // The orientations that the hexahedra across shared faces suggest, sorted by votes: the
  // orientation with the most votes comes first. If votes are equal, the orientation suggested by
  // the owner of the gate comes first.
  struct Vote {
    std::uint8_t orientation = 0, count = 0;
  };
  std::array<Vote, 6> votes{{{owner_.orientation, 1}}};
  std::uint32_t count = 1, voters = 1;
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] == kNone || k == work_.gate_side) continue;
    const std::uint8_t expected = orientation_across(k);
    if (expected == kOrientationCount) continue;
    ++voters;
    std::uint32_t i = 0;
    while (i < count && votes[i].orientation != expected) ++i;
    if (i == count) votes[count++] = {expected, 0};
    ++votes[i].count;
  }
  for (std::uint32_t i = 1; i < count; ++i)
    for (std::uint32_t place = i; place > 0 && votes[place - 1].count < votes[place].count; --place)
      std::swap(votes[place - 1], votes[place]);
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
  return code_orientation_at_gate(corner_order, orientation);
}

/// Codes the orientation at the gate. It codes which stored face of this hexahedron is at the gate,
/// and which corner of this face coincides with the lowest corner of the owner's face.
template <class Coder>
bool RowHexahedra<Coder>::code_orientation_at_gate(Coder& corner_order, std::uint8_t& orientation) {
  const auto face_of = [](std::uint32_t o, std::uint32_t side) {
    const auto& s = kOrientedBits[o];
    const auto& q = kFaceBits[side];
    const std::uint32_t axis = 7u & ~((s[q[0]] ^ s[q[1]]) | (s[q[0]] ^ s[q[3]]));
    return kFaceAt[axis][(s[q[0]] & axis) != 0];
  };
  const std::uint32_t side = kOppositeFace[work_.gate_side];  // index of the owner's side at the
                                                              // gate
  const std::uint32_t theirs = face_of(owner_.orientation, side);
  std::uint32_t lowest = 0;
  for (std::uint32_t i = 1; i < 4; ++i)
    if (kOrientedBits[owner_.orientation][kFaceBits[side][i]] <
        kOrientedBits[owner_.orientation][kFaceBits[side][lowest]])
      lowest = i;
  const std::uint32_t shared_corner = kFaceBits[side][lowest] ^ kFaceAxis[side];
  std::uint32_t mine = 0, corner = 0;
  bool turned = false;
  if constexpr (!Coder::kDecodes) {
    mine = face_of(orientation, work_.gate_side);
    while (kFaceBits[mine][corner] != kOrientedBits[orientation][shared_corner]) ++corner;
    turned = kIsMirrored[orientation] != kIsMirrored[owner_.orientation];
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
    if (kOrientedBits[o][shared_corner] == kFaceBits[mine][corner] &&
        face_of(o, work_.gate_side) == mine &&
        (kIsMirrored[o] != kIsMirrored[owner_.orientation]) == turned) {
      orientation = o;
      return true;
    }
  return false;
}

template <class Coder>
void RowHexahedra<Coder>::attach(CellTopology& cell) {
  const auto& v = work_.corner;
  // Store the hexahedra across shared faces, the oldest first. The next hexahedron is probably
  // adjacent to them.
  owner_count_ = 0;
  candidates_at_ = ~std::uint64_t{0};
  std::uint8_t shared_mask = 0;
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] == kNone) continue;
    shared_mask |= static_cast<std::uint8_t>(bit(k));
    const auto& face = surface_->face(work_.shared[k]);
    cell.face_mask |= static_cast<std::uint8_t>(bit(k));
    Owner owner{face.cell, records_[face.cell].sequence, face.side};
    std::uint32_t place = owner_count_++;
    for (; place > 0 && owners_[place - 1].sequence > owner.sequence; --place)
      owners_[place] = owners_[place - 1];
    owners_[place] = owner;
  }
  const std::uint32_t previous = last_cell_;
  cell.cell_slot = surface_->begin_cell();
  if (records_.size() <= cell.cell_slot) records_.resize(cell.cell_slot + 1);
  if (previous != kNone && records_[previous].sequence + 1 == sequence_)
    records_[previous].successor = cell.cell_slot;
  Record& record = records_[cell.cell_slot];
  record = Record{};
  record.sequence = sequence_++;
  if (coded_.size() > 2 * records_.size() + 64)
    std::erase_if(coded_, [&](const Coded& coded) {
      return records_[coded.cell].sequence != coded.sequence;
    });
  coded_.push_back({record.sequence, cell.cell_slot});
  record.shared = shared_mask;
  record.introduced = work_.introduced;
  if (has_repeats(v))
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
      if (record.repeats != 0)
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

/// At each of the 12 edges, links the two faces that bound the fan of hexahedra around the edge,
/// which makes them mates.
template <class Coder>
void RowHexahedra<Coder>::link_edges(const std::array<std::uint32_t, 6>& face) {
  const auto& v = work_.corner;
  // Edge i of face k of the hexahedron is edge first[k] + i * step[k] of the corresponding shared
  // face.
  std::array<std::uint32_t, 6> first{}, step{};
  for (std::uint32_t k = 0; k < 6; ++k) {
    if (work_.shared[k] == kNone) continue;
    const Quad& quad = surface_->face(face[k]).quad;
    const std::uint32_t a = v[kFaceBits[k][0]], b = v[kFaceBits[k][1]], c = v[kFaceBits[k][2]];
    for (std::uint32_t j = 0; j < 4 && step[k] == 0; ++j) {
      if (quad[j] != a || quad[(j + 2) % 4] != c) continue;
      const bool same_direction = quad[(j + 1) % 4] == b;
      first[k] = same_direction ? j : j + 3;
      step[k] = same_direction ? 1 : 3;
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
      // Find the same edge on the shared face, and the mate of that edge.
      mine[n] = face[k] * 4 + (first[k] + i * step[k]) % 4;
      end[n] = surface_->mate(mine[n]);
      fan += surface_->fan(mine[n]);
    }
    // If two shared faces are mates at this edge, the fan around the edge is closed. Both faces are
    // removed soon, so they are not linked.
    const bool closed = mine[0] != kNone && mine[1] != kNone && end[0] == mine[1];
    if (!closed) surface_->join(end[0], end[1], fan);
  }
}

template class RowHexahedra<RangeEncoder>;
template class RowHexahedra<RangeDecoder>;
template class RowHexahedra<MixingCoder<RangeEncoder>>;
template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
