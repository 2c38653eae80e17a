#include "codecs/surface/cells/cell_corners.h"

#include <algorithm>
#include <bit>

#include "base/lists.h"
#include "codecs/surface/cells/by_chance.h"

namespace shm {
namespace {

/// The way in which a corner was coded. Later decisions use it as context.
enum Outcome : std::uint32_t { kIntroduced = 1, kRepeats = 2, kMissed = 3, kTaken = 4 };

constexpr std::uint32_t least(std::uint32_t a, std::uint32_t b) { return a < b ? a : b; }

}  // namespace

template <class Coder>
auto CellCorners<Coder>::models_of(CellShape shape) -> ShapeModels& {
  const auto index = static_cast<std::size_t>(shape) - static_cast<std::size_t>(CellShape::line);
  auto& models = all_models_[index];
  if (!models) {
    models = std::make_unique<ShapeModels>();
    for (auto& list : models->which) list.resize(std::size_t{3} * 2 * 4 * 9 * 2);
  }
  return *models;
}

template <class Coder>
bool CellCorners<Coder>::code(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                              CellShape shape,
                              const std::function<void(std::uint32_t)>& add_vertex) {
  mixing_.use(symbols);
  const std::uint32_t corners = corner_count(shape, cell.slots.size());
  models_ = &models_of(shape);
  block_ = &past_[cell.block];
  block_->ids.resize(std::max<std::size_t>(corners, block_->ids.size()));
  sides_ = sides_of(shape, corners).sides;
  shape_ = static_cast<std::uint32_t>(shape);
  owners_.clear();
  gates_ = outcomes_ = six_cells_ = 0;
  two_cells_ = mixing::hash(models_->before[0], models_->before[1]);
  for (std::uint32_t o : models_->before) six_cells_ = mixing::hash(six_cells_, o);

  std::uint64_t shift = block_->step;
  for (std::uint32_t i = 0; i < corners; ++i) {
    Corner corner;
    corner.position = i;
    corner.model = least(i, kPositions - 1);
    corner.expected = block_->ids[i] + shift;
    if (!code_corner(symbols, stored, cell, corner, add_vertex)) return false;
    const std::uint64_t id = surface_->vertex(cell.slots[i]).id;
    shift = id - block_->ids[i];
    if (i == 0) block_->step = shift;
    block_->ids[i] = id;
    find_owners(cell, i);
  }
  std::copy_backward(models_->before.begin(), models_->before.end() - 1, models_->before.end());
  models_->before[0] = outcomes_;
  return true;
}

template <class Coder>
bool CellCorners<Coder>::code_corner(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                                     Corner& corner,
                                     const std::function<void(std::uint32_t)>& add_vertex) {
  const std::uint32_t i = corner.position;
  gather(cell, corner);
  if constexpr (!Coder::kDecodes)
    for (std::uint32_t j = 0; j < i && corner.repeats == kNone; ++j)
      if (stored.numbers[j] == stored.numbers[i]) corner.repeats = j;

  std::uint32_t shared = 0, guesses = 0;
  for (const Candidate& c : candidates_) {
    shared = std::max<std::uint32_t>(shared, c.shared);
    guesses = std::max<std::uint32_t>(guesses, c.guesses);
  }
  const std::uint32_t chance = candidates_.empty() ? 16 : candidates_[0].chance >> 12;
  const auto code_bit = [&](Question question, auto& models, bool value) {
    mixing_.about(question, clue(shape_, i, gates_, shared, guesses), clue(shape_, i, outcomes_),
                  clue(shape_, i, outcomes_, models_->before[0]),
                  clue(shape_, i, outcomes_, six_cells_),
                  clue(shape_, i, chance, candidates_.size(), gates_));
    return mixing_.bit(models[corner.model][least(gates_, 2)], value);
  };
  std::uint32_t outcome = kIntroduced;
  if (code_bit(kNew, models_->is_new, cell.slots[i] == kNone && corner.repeats == kNone)) {
    add_vertex(i);
  } else {
    bool among = false;
    if constexpr (!Coder::kDecodes)
      among = corner.repeats == kNone &&
              std::any_of(candidates_.begin(), candidates_.end(),
                          [&](const Candidate& c) { return c.slot == cell.slots[i]; });
    if (!candidates_.empty() && code_bit(kAmong, models_->among, among)) {
      outcome = code_taken(cell, corner);
    } else {
      outcome = code_missed(symbols, cell, corner);
      if (outcome == 0) return false;
    }
  }
  if (corner.lead_model != nullptr) corner.lead_model->update(cell.slots[i] == corner.lead);
  outcomes_ = mixing::hash(outcomes_, outcome + 1);
  return true;
}

/// Codes which of the candidates is the vertex of the corner. Returns the outcome.
template <class Coder>
std::uint32_t CellCorners<Coder>::code_taken(CellTopology& cell, const Corner& corner) {
  const std::uint32_t i = corner.position;
  std::uint32_t r = 0;
  for (; r + 1 < candidates_.size(); ++r) {
    const Candidate& c = candidates_[r];
    const OpenFaces::Vertex open = faces_.vertex(c.slot);
    mixing_.about(kWhich, clue(shape_, i, c.why(), r),
                  clue(shape_, i, c.guesses, c.shared, least(c.beside, 5), c.directions, r),
                  clue(shape_, i, outcomes_, models_->before[0], c.why()),
                  clue(shape_, i, c.shared, least(c.beside, 3), least(open.bare, 7),
                       least(open.edges, 3), least(surface_->vertex(c.slot).uses, 31)),
                  clue(shape_, i, outcomes_, two_cells_, six_cells_, c.why()));
    if (mixing_.bit(*c.model, c.slot == cell.slots[i])) break;
  }
  const Candidate& c = candidates_[r];
  cell.slots[i] = c.slot;
  return kTaken + (c.place < kMost ? c.place : kMost + least(c.shared, 2));
}

/// Codes a corner whose vertex is not a candidate: an earlier vertex of this cell, or any live
/// vertex. Returns the outcome, or 0 if the data is damaged and does not identify a vertex.
template <class Coder>
std::uint32_t CellCorners<Coder>::code_missed(Coder& symbols, CellTopology& cell,
                                              const Corner& corner) {
  const std::uint32_t i = corner.position;
  if (i > 0 && symbols.bit(models_->repeated, corner.repeats != kNone)) {
    const std::uint64_t back = code_number(symbols, models_->repeat, i - 1 - corner.repeats);
    if (back >= i) return 0;
    cell.slots[i] = cell.slots[i - 1 - static_cast<std::uint32_t>(back)];
    return kRepeats;
  }
  std::uint64_t id = 0;
  if constexpr (!Coder::kDecodes) id = surface_->vertex(cell.slots[i]).id;
  id = corner.expected +
       static_cast<std::uint64_t>(code_signed(symbols, models_->step[i > 0 ? 1 : 0],
                                              static_cast<std::int64_t>(id - corner.expected)));
  cell.slots[i] = surface_->slot_of(id);
  return cell.slots[i] == kNone ? 0u : static_cast<std::uint32_t>(kMissed);
}

// --- candidates

template <class Coder>
auto CellCorners<Coder>::add(const CellTopology& cell, std::uint32_t position, std::uint32_t slot)
    -> Candidate* {
  Listed& listed = at_slot(listed_, slot);
  if (listed.round == round_)
    return listed.candidate == kNone ? nullptr : &candidates_[listed.candidate];
  listed = {round_, kNone};
  if (candidates_.size() == kCandidates || !surface_->vertex(slot).alive) return nullptr;
  for (std::uint32_t j = 0; j < position; ++j)
    if (cell.slots[j] == slot) return nullptr;
  listed.candidate = static_cast<std::uint32_t>(candidates_.size());
  Candidate& candidate = candidates_.emplace_back();
  candidate.slot = slot;
  return &candidate;
}

template <class Coder>
void CellCorners<Coder>::gather(const CellTopology& cell, Corner& corner) {
  candidates_.clear();
  ++round_;
  gather_likely(cell, corner);
  if (corner.lead_model == nullptr || corner.lead_model->probability_of_one() <= kSure) {
    if (corner.position == 0)
      gather_beside(cell, corner.position);
    else
      gather_faces(cell, corner.position);
  }
  rank(corner);
}

/// Collects the candidates that can be found without examining faces. Chooses the lead among them:
/// the candidate with the strongest evidence (the first one if there is a tie).
template <class Coder>
void CellCorners<Coder>::gather_likely(const CellTopology& cell, Corner& corner) {
  const std::uint32_t i = corner.position;
  if (i < kMost)
    for (const Guess& guess : block_->guesses) {
      const OpenFaces::Cell* behind = faces_.cell(guess.number);
      if (behind == nullptr || guess.place[i] >= behind->size) continue;
      if (Candidate* c = add(cell, i, behind->node[guess.place[i]]); c != nullptr && c->guesses < 2)
        ++c->guesses;
    }
  const std::uint32_t next = surface_->slot_of(corner.expected);
  if (next != kNone)
    if (Candidate* c = add(cell, i, next)) c->shift = true;
  std::uint32_t best = 0;
  for (const Candidate& c : candidates_) {
    const std::uint32_t reasons = 2u * c.guesses + (c.shift ? 1 : 0);
    if (reasons <= best) continue;
    best = reasons;
    corner.lead = c.slot;
    corner.lead_model = &models_->lead[corner.model][reasons];
  }
  for (std::uint32_t k = 0; k < last_size_; ++k)
    if (Candidate* c = add(cell, i, last_cell_[k]); c != nullptr && c->place == kMost)
      c->place = static_cast<std::uint8_t>(k);
}

/// Collects candidates: the nodes of open faces that contain a corner of the previous cell.
template <class Coder>
void CellCorners<Coder>::gather_beside(const CellTopology& cell, std::uint32_t position) {
  for (std::uint32_t k = 0; k < last_size_; ++k)
    faces_.around(last_cell_[k], [&](const OpenFaces::Face& face, std::uint32_t) {
      for (std::uint32_t n = 0; n < face.size; ++n) count_beside(add(cell, position, face.node[n]));
    });
}

/// Collects candidates of two kinds: vertices that would close an open face whose other nodes are
/// known, and vertices that an edge of an open face connects to a known node.
template <class Coder>
void CellCorners<Coder>::gather_faces(const CellTopology& cell, std::uint32_t position) {
  std::uint32_t beside = 0;  // bit set: positions of known nodes that an edge of this cell connects
                             // to the current node
  for (const ShapeFace& side : sides_) {
    std::uint32_t place = side.size, known = 0;
    for (std::uint32_t k = 0; k < side.size; ++k) {
      if (side.at[k] == position) place = k;
      if (side.at[k] < position) ++known;
    }
    if (place == side.size || known == 0) continue;
    for (std::uint32_t k : {place + 1, place + side.size - 1})
      if (side.at[k % side.size] < position) beside |= 1u << side.at[k % side.size];
    if (known > 1 || side.size == 2) gather_shared(cell, side, place, known);
  }
  for (; beside != 0; beside &= beside - 1) {
    const std::uint32_t from = cell.slots[static_cast<std::size_t>(std::countr_zero(beside))];
    faces_.around(from, [&](const OpenFaces::Face& face, std::uint32_t index) {
      for (std::uint32_t k : {index + 1, index + face.size - 1})
        count_beside(add(cell, position, face.node[k % face.size]));
    });
  }
}

/// Collects candidates: nodes of open faces that match the face `ours`. A face matches if it has
/// the same number of nodes as `ours`, and contains the known nodes of `ours` at the same places,
/// in either direction around the face.
template <class Coder>
void CellCorners<Coder>::gather_shared(const CellTopology& cell, const ShapeFace& ours,
                                       std::uint32_t place, std::uint32_t known) {
  const std::uint32_t n = ours.size, position = ours.at[place];
  std::uint32_t anchor = 0;
  while (ours.at[anchor] >= position) ++anchor;
  faces_.around(cell.slots[ours.at[anchor]], [&](const OpenFaces::Face& face, std::uint32_t index) {
    if (face.size != n) return;
    if (std::find(owners_.begin(), owners_.end(), faces_.number_of(face)) != owners_.end()) return;
    for (std::uint32_t direction :
         // Direction in which the nodes of the face are listed, compared with the side of this
         // cell. 1: opposite, as usual for the face of a neighbour; 2: the same
         {1u, 2u}) {
      const auto node = [&](std::uint32_t k) {
        const std::uint32_t steps = (k + n - anchor) % n;
        return face.node[(index + (direction == 1 ? n - steps : steps)) % n];
      };
      bool fits = true;
      for (std::uint32_t k = 0; k < n && fits; ++k)
        fits = ours.at[k] >= position || node(k) == cell.slots[ours.at[k]];
      if (!fits) continue;
      if (Candidate* candidate = add(cell, position, node(place))) {
        candidate->shared = static_cast<std::uint8_t>(least(candidate->shared + known, 7));
        candidate->directions |= static_cast<std::uint8_t>(direction);
      }
      if (n == 2) break;
    }
  });
}

/// Chooses the model of each candidate. Sorts the candidates by predicted probability; the most
/// likely candidate comes first.
template <class Coder>
void CellCorners<Coder>::rank(const Corner& corner) {
  auto& which = models_->which[corner.model];
  for (Candidate& c : candidates_) {
    std::size_t index = c.guesses;
    index = 2 * index + (c.shift ? 1 : 0);
    index = 4 * index + least(c.shared, 3);
    index = 9 * index + c.place;
    index = 2 * index + (c.beside > 0 ? 1 : 0);
    c.model = &which[index];
    c.chance = c.model->adaptive.probability_of_one();
  }
  sort_by_chance(candidates_);
}

/// The node at `position` has just become known. For each side of the current cell whose nodes are
/// now all known, finds the neighbour across this side.
template <class Coder>
void CellCorners<Coder>::find_owners(const CellTopology& cell, std::uint32_t position) {
  std::array<std::uint32_t, 4> cycle{};
  for (const ShapeFace& side : sides_) {
    if (*std::max_element(side.at.begin(), side.at.begin() + side.size) != position) continue;
    for (std::uint32_t k = 0; k < side.size; ++k) cycle[k] = cell.slots[side.at[k]];
    const std::uint32_t found = faces_.find(std::span<const std::uint32_t>(cycle).first(side.size));
    if (found == kNone) continue;
    gates_ = least(gates_ + 1, 3);
    owners_.push_back(faces_.number_of(faces_.face(found)));
  }
}

// --- after a cell

template <class Coder>
void CellCorners<Coder>::take_note(const CellTopology& cell, CellShape shape, bool as_stored) {
  const std::uint32_t corners = corner_count(shape, cell.slots.size());
  if (corners == 0) {
    faces_.skip_cell();
    return;
  }
  std::array<std::uint32_t, kMaxPolygonCorners> stored{};
  for (std::uint32_t i = 0; i < corners; ++i)
    stored[as_stored ? cell.stored_position(i) : i] = cell.slots[i];
  const auto nodes = std::span<const std::uint32_t>(stored).first(corners);
  faces_.add_cell(sides_of(shape, corners), nodes);
  last_size_ = least(corners, kMost);
  std::copy_n(nodes.begin(), last_size_, last_cell_.begin());
  if (!cell.hexahedral) make_guesses(past_[cell.block], nodes);
}

/// Guesses the neighbours of the next cell of the block, as sequence numbers. Let n be a neighbour
/// of the current cell, and m the corresponding neighbour of the previous cell of the block. The
/// two guesses from n are the cells n + 1 and n + (n - m).
template <class Coder>
void CellCorners<Coder>::make_guesses(Past& past, std::span<const std::uint32_t> corners) {
  const auto before = past.behind;
  past.behind = faces_.behind();
  past.guesses.clear();
  for (std::uint32_t k = 0; k < kMost; ++k) {
    const std::uint64_t number = past.behind[k];
    const OpenFaces::Cell* behind = number == OpenFaces::kNever ? nullptr : faces_.cell(number);
    if (behind == nullptr) continue;
    Guess guess;
    guess.place.fill(kMost);
    for (std::uint32_t i = 0; i < least(static_cast<std::uint32_t>(corners.size()), kMost); ++i)
      for (std::uint32_t j = 0; j < behind->size; ++j)
        if (behind->node[j] == corners[i]) guess.place[i] = static_cast<std::uint8_t>(j);
    const auto add_guess = [&](std::uint64_t next) {
      guess.number = next;
      if (std::none_of(past.guesses.begin(), past.guesses.end(),
                       [&](const Guess& known) { return known.number == next; }))
        past.guesses.push_back(guess);
    };
    add_guess(number + 1);
    if (before[k] != OpenFaces::kNever) add_guess(number + (number - before[k]));
  }
}

template <class Coder>
void CellCorners<Coder>::code_last_use(Coder& symbols, CellTopology& cell, CellShape shape) {
  mixing_.use(symbols);
  ShapeModels& models = models_of(shape);
  const std::uint32_t corners = corner_count(shape, cell.slots.size());
  std::uint32_t finals = 1;
  for (std::uint32_t i = 0; i < corners; ++i) {
    const auto end = cell.slots.begin() + i;
    if (std::find(cell.slots.begin(), end, cell.slots[i]) != end) {
      cell.last_use[i] = 0;
      continue;
    }
    const OpenFaces::Vertex open = faces_.vertex(cell.slots[i]);
    const std::uint32_t uses = surface_->vertex(cell.slots[i]).uses;
    const std::uint32_t bare = least(open.bare, 7), edges = least(open.edges, 3);
    mixing_.about(kLast, clue(shape_, bare, least(open.faces, 15), edges),
                  clue(shape_, bare, edges, i, finals), clue(shape_, bare, edges, least(uses, 63)),
                  clue(shape_, i, finals, models.finals, bare == 0),
                  clue(shape_, i, outcomes_, models.before[1], finals));
    auto& model = models.last[least(i, kPositions - 1)][bare];
    cell.last_use[i] = mixing_.bit(model, cell.last_use[i] != 0) ? 1 : 0;
    finals = 2 * finals + cell.last_use[i];
  }
  models.finals = finals;
}

template class CellCorners<RangeEncoder>;
template class CellCorners<RangeDecoder>;

}  // namespace shm
