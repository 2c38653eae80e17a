// Contexts that a mixing coder uses for the decisions of RowHexahedra, in addition to the context
// of the adaptive model. Each context is a hash of a few numbers that the context of the model does
// not include. When a decision is coded, all these numbers are the same in encoder and decoder.
#include <algorithm>
#include <bit>
#include <utility>

#include "codecs/surface/cells/row_hexahedra.h"

namespace shm {

// --- numbers in contexts

/// Returns the record of the previous hexahedron. Call this function before attach() adds the
/// current hexahedron.
template <class Coder>
auto RowHexahedra<Coder>::last() const -> const Record& {
  static constexpr Record kNobody{};
  return last_cell_ == kNone ? kNobody : records_[last_cell_];
}
template <class Coder>
std::uint32_t RowHexahedra<Coder>::live_sides(std::uint32_t cell) const {
  std::uint32_t sides = 0;
  for (std::uint32_t k = 0; k < 6; ++k)
    if (live_face(cell, k) != kNone) sides |= bit(k);
  return sides;
}
/// Returns the set of sides of the current hexahedron that are known to be shared.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::shared_sides() const {
  std::uint32_t sides = 0;
  for (std::uint32_t k = 0; k < 6; ++k)
    if (work_.shared[k] != kNone) sides |= bit(k);
  return sides;
}
/// Returns the sum of the fan sizes (numbers of hexahedra around an edge) at the edges of a face.
/// Each size is limited to 5.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::fans(std::uint32_t face) const {
  std::uint32_t sum = 0;
  for (std::uint32_t fan : surface_->face(face).fan) sum += std::min(fan, 5u);
  return sum;
}
/// Returns the fan sizes (numbers of hexahedra around an edge) at the edges of a face, each limited
/// to 5, as octal digits in ascending order.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::sorted_fans(std::uint32_t face) const {
  auto fan = surface_->face(face).fan;
  for (auto& count : fan) count = std::min<std::uint8_t>(count, 5);
  // A sorting network, because std::sort would need much more code.
  for (const auto& [a, b] : {std::pair(0, 1), {2, 3}, {0, 2}, {1, 3}, {1, 2}})
    if (fan[b] < fan[a]) std::swap(fan[a], fan[b]);
  return fan[0] * 512u + fan[1] * 64u + fan[2] * 8u + fan[3];
}
/// Returns the total number of active faces at the four vertices of a face.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::crowd(std::uint32_t face) const {
  std::uint32_t sum = 0;
  for (std::uint32_t slot : surface_->face(face).quad) sum += surface_->vertex(slot).face_count;
  return sum;
}
/// Returns the total number of uses of the four vertices of a face.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::uses(std::uint32_t face) const {
  std::uint32_t sum = 0;
  for (std::uint32_t slot : surface_->face(face).quad) sum += surface_->vertex(slot).uses;
  return sum;
}
/// Returns the age of a face: the number of hexahedra coded since the face's hexahedron, as a bit
/// length.
template <class Coder>
std::uint32_t RowHexahedra<Coder>::age(std::uint32_t face) const {
  const std::uint64_t coded = records_[surface_->face(face).cell].sequence;
  return static_cast<std::uint32_t>(std::bit_width(sequence_ - coded));
}
template <class Coder>
std::uint32_t RowHexahedra<Coder>::gate_age() const {
  return work_.owner == nullptr
             ? 0
             : static_cast<std::uint32_t>(std::bit_width(sequence_ - owner_.sequence));
}

// --- gate

template <class Coder>
void RowHexahedra<Coder>::about_candidates(Coder& symbols) const {
  const Candidate& first = candidates_[0];
  const Record& before = last();
  const std::uint32_t support = std::min(first.support, 3u);
  symbols.about(kHit, clue(candidate_count_, gates_ & 0xfff),
                clue(candidate_count_, support, first.guessed, sorted_fans(first.face)),
                clue(candidate_count_, support, before.shared, before.introduced),
                clue(candidate_count_, support, first.guessed, age(first.face),
                     surface_->face(first.face).side, last_gate_side_),
                clue(candidate_count_, crowd(first.face), uses(first.face)));
}

template <class Coder>
void RowHexahedra<Coder>::about_candidate(Coder& symbols, std::uint32_t index) const {
  const Candidate& candidate = candidates_[index];
  symbols.about(kWhich,
                clue(fans(candidate.face), fans(candidates_[index + 1].face), age(candidate.face)),
                clue(candidate_count_ - index, candidate.support, candidate.guessed, gates_ & 0x3f,
                     age(candidate.face)),
                clue(candidate_count_ - index, index, candidate.support, candidate.guessed,
                     sorted_fans(candidate.face)));
}

template <class Coder>
void RowHexahedra<Coder>::about_kind(Coder& symbols) const {
  const std::uint32_t sides = last_cell_ == kNone ? 0 : live_sides(last_cell_);
  symbols.about(kKind, clue(gates_ & 7, last().shared, candidate_count_),
                clue(sides, gates_ & 0x3f, candidate_count_), clue(gates_ & 0xfffff));
}

template <class Coder>
void RowHexahedra<Coder>::about_cell_side(Coder& symbols, Question question, std::uint32_t cell,
                                          std::uint32_t side, std::uint32_t left) const {
  const std::uint32_t face = live_face(cell, side);
  symbols.about(question, clue(side, live_sides(cell), last_side_), clue(side, sorted_fans(face)),
                clue(side, left, crowd(face), uses(face)),
                clue(side, last_gate_side_, gate_side_before_, last_side_));
}

template <class Coder>
void RowHexahedra<Coder>::about_listed(Coder& symbols, Kind kind) const {
  symbols.about(kind == kChain ? kChainPlace : kEdgePlace, clue(faces_.size()),
                clue(last().shared));
}

template <class Coder>
void RowHexahedra<Coder>::about_distance(Coder& symbols, Question question) const {
  const auto before = static_cast<std::uint32_t>(std::bit_width(distances_[0]));
  symbols.about(question, clue(gates_ & 0xfff), clue(last().shared, before));
}

// --- faces and corners

template <class Coder>
void RowHexahedra<Coder>::about_side(Coder& symbols, FaceEdge edge, std::uint32_t evidence,
                                     bool candidate, std::uint32_t yes) const {
  const auto& gate = surface_->face(edge / 4);
  const std::uint32_t fan = std::min<std::uint32_t>(gate.fan[edge % 4], 7);
  const auto& a = surface_->vertex(gate.quad[edge % 4]);
  const auto& b = surface_->vertex(gate.quad[(edge + 1) % 4]);
  symbols.about(kSide,
                clue(fan, evidence, candidate, std::min(a.face_count, b.face_count),
                     std::max(a.face_count, b.face_count)),
                clue(fan, evidence, candidate, a.uses, b.uses, work_.kind),
                clue(fan, evidence, candidate, yes, age(surface_->mate(edge) / 4), gate_age()));
}

template <class Coder>
void RowHexahedra<Coder>::about_far(Coder& symbols, FaceEdge top, FaceEdge mate) const {
  const std::uint32_t face = mate / 4;
  symbols.about(kFar, clue(surface_->fan(top), crowd(face), uses(face)),
                clue(age(face), gate_age(), work_.kind));
}

template <class Coder>
void RowHexahedra<Coder>::about_new(Coder& symbols, std::uint32_t corner, std::uint32_t leads,
                                    std::uint32_t neighbours) const {
  std::array<std::uint32_t, 3> faces{};  // numbers of faces at the known neighbours
  std::uint32_t count = 0;
  for (std::uint32_t axis : {1u, 2u, 4u})
    if ((work_.known >> (corner ^ axis) & 1) != 0)
      faces[count++] = surface_->vertex(work_.corner[corner ^ axis]).face_count;
  symbols.about(kNew, clue(leads, neighbours, faces[0], faces[1], faces[2]),
                clue(leads, neighbours, corner, work_.introduced, last().introduced),
                clue(leads, neighbours, work_.kind, gate_age(), std::popcount(shared_sides())));
}

template <class Coder>
void RowHexahedra<Coder>::about_join(Coder& symbols, std::uint32_t rank) const {
  const JoinCandidate& join = joins_[rank];
  const auto& vertex = surface_->vertex(join.slot);
  symbols.about(kJoin, clue(join.score, vertex.face_count, vertex.uses, rank > 0),
                clue(join.score, std::bit_width(surface_->next_id() - vertex.id), rank > 0));
}

template <class Coder>
void RowHexahedra<Coder>::about_closing_vertex(Coder& symbols, std::uint32_t corner,
                                               const ClosingVertex& closing) const {
  const auto& vertex = surface_->vertex(closing.slot);
  symbols.about(kCloses, clue(closing.score, closing.others, std::popcount(work_.known)),
                clue(closing.score, vertex.face_count, vertex.uses, shared_sides()),
                clue(corner, closing.score, work_.introduced, last().introduced));
}

template <class Coder>
void RowHexahedra<Coder>::about_reference(Coder& symbols, Question question) const {
  symbols.about(question, clue(std::popcount(work_.known), work_.kind), clue(shared_sides()));
}

// --- corner order and last use

template <class Coder>
void RowHexahedra<Coder>::about_orientation(Coder& corner_order, std::uint32_t index,
                                            std::uint8_t orientation, std::uint32_t votes,
                                            std::uint32_t voters) const {
  corner_order.about(kOrientation, clue(index, orientation, last().orientation),
                     clue(index, votes, voters, orientation == owner_.orientation, gate_age()),
                     clue(index, votes, shared_sides(), work_.gate_side),
                     clue(index, orientation, owner_.orientation),
                     clue(index, orientation, work_.gate_side, gates_ & 63));
}

template <class Coder>
void RowHexahedra<Coder>::about_stored_face(Coder& corner_order, std::uint32_t theirs) const {
  corner_order.about(kStoredFace, clue(theirs, work_.kind),
                     clue(owner_.orientation, work_.gate_side));
}

template <class Coder>
void RowHexahedra<Coder>::about_stored_corner(Coder& corner_order, std::uint32_t mine) const {
  corner_order.about(kStoredCorner, clue(owner_.orientation, work_.gate_side, mine));
}

template <class Coder>
void RowHexahedra<Coder>::about_last_use(Coder& symbols, const Record& record, std::uint32_t corner,
                                         std::uint32_t slot, std::uint32_t next_uses) const {
  const auto& vertex = surface_->vertex(slot);
  std::uint32_t sum = 0, largest = 0, open = 0;
  for (FaceCorner face_corner = vertex.first_face; face_corner != kNone;
       face_corner = surface_->next_around(face_corner)) {
    const std::uint32_t fan = std::min(surface_->fan(face_corner), 7u);
    sum += fan;
    largest = std::max(largest, fan);
    open += surface_->mate(face_corner) == kNone ? 1 : 0;
  }
  if (open_ != nullptr) {
    const OpenFaces::Vertex open_there = open_->vertex(slot);
    symbols.about(kFinalOfMixed, clue(open_there.bare, open_there.edges, vertex.face_count),
                  clue(vertex.face_count, vertex.uses, open_there.bare, next_uses),
                  clue(open_faces_of_others(slot), corner, last_finals_, record.finals, next_uses));
    return;
  }
  symbols.about(
      kFinal,
      clue(vertex.face_count, vertex.uses, std::min(sum, 31u), largest, std::min(open, 3u),
           next_uses),
      clue(vertex.face_count, vertex.uses, std::bit_width(surface_->next_id() - vertex.id),
           next_uses),
      clue(vertex.face_count, vertex.uses, corner, last_finals_, record.finals, next_uses));
}

template class RowHexahedra<MixingCoder<RangeEncoder>>;
template class RowHexahedra<MixingCoder<RangeDecoder>>;

}  // namespace shm
