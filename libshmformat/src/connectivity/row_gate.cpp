// The gate of RowHexahedra: which active face a hexahedron is glued to.
#include <algorithm>
#include <utility>

#include "connectivity/row_hexahedra.h"
#include "surface/hexahedron.h"

namespace shm {
namespace {

constexpr std::uint32_t kChainLength = 32;

}  // namespace

template <class Coder>
std::uint32_t RowHexahedra<Coder>::live_face(std::uint32_t cell, std::uint32_t side) const {
  const std::uint32_t face = records_[cell].face[side];
  if (face == kNone) return kNone;
  const auto& it = surface_->face(face);
  return it.alive && it.cell == cell && it.side == side ? face : kNone;
}

template <class Coder>
void RowHexahedra<Coder>::list_candidates() {
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
auto RowHexahedra<Coder>::fit(const CellTopology& cell, std::uint32_t face) const -> Fit {
  const auto& it = surface_->face(face);
  const std::uint32_t axis = kFaceAxis[it.side];
  std::array<std::uint32_t, 4> g{};
  for (std::uint32_t i = 0; i < 4; ++i) g[i] = kFaceBits[it.side][i] ^ axis;
  const auto slot = [&](std::uint32_t stored_bits) { return cell.slots[kCornerBits[stored_bits]]; };
  for (std::uint32_t s0 = 0; s0 < 8; ++s0) {
    if (slot(s0) != it.quad[0]) continue;
    for (std::uint32_t x = 1; x < 8; x <<= 1) {
      if (slot(s0 ^ x) != it.quad[1]) continue;
      for (std::uint32_t y = 1; y < 8; y <<= 1) {
        if (y == x || slot(s0 ^ y) != it.quad[3] || slot(s0 ^ x ^ y) != it.quad[2]) continue;
        std::array<std::uint32_t, 5> image{};
        image[g[0] ^ g[1]] = x;
        image[g[0] ^ g[3]] = y;
        image[axis] = 7 ^ x ^ y;
        std::uint32_t base = s0;
        for (std::uint32_t a : {1u, 2u, 4u})
          if ((g[0] & a) != 0) base ^= image[a];
        return {face, orientation_of(base, image[1], image[2])};
      }
    }
  }
  return {};
}

template <class Coder>
void RowHexahedra<Coder>::find_shared(const CellTopology& cell, std::vector<Fit>& out) const {
  out.clear();
  for (std::uint32_t k = 0; k < 6; ++k) {
    const auto& c = kFaceCorners[k];
    bool old = true;
    for (std::uint32_t i : c) old = old && cell.slots[i] != kNone;
    if (!old) continue;
    const std::uint32_t face =
        surface_->find_face(cell.slots[c[0]], cell.slots[c[1]], cell.slots[c[2]], cell.slots[c[3]]);
    if (face == kNone) continue;
    const Fit found = fit(cell, face);
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
bool RowHexahedra<Coder>::code_gate(Coder& symbols, const CellTopology& cell, Fit& gate,
                                    Kind& kind) {
  list_candidates();
  if (code_candidate(symbols, cell, gate)) {
    kind = kCandidate;
    return true;
  }
  std::uint32_t index = 0;  // in the list of its kind
  kind = kStart;
  if constexpr (!Coder::kDecodes) kind = choose_elsewhere(cell, gate, index);
  if constexpr (Coder::kMixes) about_kind(symbols);
  const std::uint32_t said = code_tree(symbols, kind_[kinds_], static_cast<std::uint32_t>(kind));
  if (said >= kKinds || said == kCandidate) return false;
  kind = static_cast<Kind>(said);
  kinds_ = (kinds_ << 3 | said) & 63;
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

/// Says whether the gate is a candidate, and which. Encoding: `gate` is set if so.
template <class Coder>
bool RowHexahedra<Coder>::code_candidate(Coder& symbols, const CellTopology& cell, Fit& gate) {
  if (candidate_count_ == 0) return false;
  const std::uint32_t none = candidate_count_;
  std::uint32_t hit = none;
  if constexpr (!Coder::kDecodes)
    for (std::uint32_t i = 0; i < candidate_count_ && hit == none; ++i) {
      gate = fit(cell, candidates_[i].face);
      if (gate.face != kNone) hit = i;
    }
  const Candidate& first = candidates_[0];
  auto& model = hit_[candidate_count_][std::min(first.support, 3u)][hits_][first.guessed ? 1 : 0];
  if constexpr (Coder::kMixes) about_candidates(symbols);
  if (!symbols.bit(model, hit != none)) return false;
  std::uint32_t i = 0;
  for (; i + 1 < candidate_count_; ++i) {
    const Candidate& it = candidates_[i];
    const std::uint32_t side = surface_->face(it.face).side;
    const std::uint32_t again =
        (side == last_gate_side_ ? 1u : 0u) + (side == gate_side_before_ ? 2u : 0u);
    auto& yes = which_[std::min(candidate_count_ - i, 3u)][std::min(i, 3u)]
                      [std::min(it.support, 3u)][again][it.guessed ? 1 : 0];
    if constexpr (Coder::kMixes) about_candidate(symbols, i);
    if (symbols.bit(yes, hit == i)) break;
  }
  gate.face = candidates_[i].face;
  return true;
}

/// The encoder's choice where no candidate is shared: the first kind that can say a shared face;
/// among any faces, one at a distance said before, or else the youngest.
template <class Coder>
auto RowHexahedra<Coder>::choose_elsewhere(const CellTopology& cell, Fit& gate,
                                           std::uint32_t& index) -> Kind {
  gate = {};
  find_shared(cell, fits_);
  if (fits_.empty()) return kStart;
  for (Kind kind : {kPrevious, kChain, kAtEdge}) {
    list_faces(kind, faces_);
    for (index = 0; index < faces_.size(); ++index)
      for (const Fit& it : fits_)
        if (it.face == faces_[index]) {
          gate = it;
          return kind;
        }
  }
  std::uint64_t youngest = ~std::uint64_t{0};
  for (const Fit& it : fits_) {
    const std::uint64_t distance = sequence_ - records_[surface_->face(it.face).cell].sequence;
    const bool again =
        std::find(distances_.begin(), distances_.end(), distance) != distances_.end();
    if (again || distance < youngest) gate = it;
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

/// One of the active faces of a hexahedron, by its side.
template <class Coder>
bool RowHexahedra<Coder>::code_side(Coder& symbols, Question question, std::uint32_t cell,
                                    std::uint32_t& face) {
  auto& models = question == kPreviousSide ? previous_side_ : recent_side_;
  std::uint32_t left = 0;
  for (std::uint32_t side = 0; side < 6; ++side) left += live_face(cell, side) != kNone ? 1 : 0;
  for (std::uint32_t side = 0; side < 6; ++side) {
    const std::uint32_t it = live_face(cell, side);
    if (it == kNone) continue;
    if constexpr (Coder::kMixes)
      if (left > 1) about_cell_side(symbols, question, cell, side, left);
    if (--left > 0 && !symbols.bit(models[last_side_].yes[side], it == face)) continue;
    face = it;
    last_side_ = side;
    return true;
  }
  return false;
}

/// Any face: by how many hexahedra ago its owner was coded, and its side.
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

template <class Coder>
bool RowHexahedra<Coder>::taken(std::uint32_t face) const {
  return std::find(work_.shared.begin(), work_.shared.end(), face) != work_.shared.end();
}

/// The slot of the hexahedron with this place in coding order, kNone when it is forgotten.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::cell_of(std::uint64_t sequence) const {
  const auto found = std::lower_bound(
      births_.begin(), births_.end(), sequence,
      [](const Birth& birth, std::uint64_t wanted) { return birth.sequence < wanted; });
  const bool here = found != births_.end() && found->sequence == sequence &&
                    records_[found->cell].sequence == sequence;
  return here ? found->cell : kNone;
}

template <class Coder>
void RowHexahedra<Coder>::take_gate(std::uint32_t face) {
  const auto& it = surface_->face(face);
  owner_ = records_[it.cell];
  work_.owner = &owner_;
  gate_side_before_ = std::exchange(last_gate_side_, it.side);
  work_.gate_side = kOppositeFace[it.side];
  work_.shared[work_.gate_side] = face;
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t b = kFaceBits[it.side][i] ^ kFaceAxis[it.side];
    work_.corner[b] = it.quad[i];
    work_.known |= bit(b);
  }
}

template class RowHexahedra<RangeEncoder>;
template class RowHexahedra<RangeDecoder>;
template class RowHexahedra<MixingCoder<RangeEncoder>>;
template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
