#include "codecs/surface/cells/polyhedra.h"

#include <algorithm>

#include "base/lists.h"
#include "codecs/surface/cells/by_chance.h"

namespace shm {
namespace {

constexpr std::uint32_t at_most(std::size_t a, std::uint32_t b) {
  return a < b ? static_cast<std::uint32_t>(a) : b;
}

}  // namespace

/// Encoding: returns true if the vertex numbers of a cell are a list of faces: at least three
/// different vertices for each face, followed by a repetition of its first vertex.
template <class Coder>
bool Polyhedra<Coder>::told_by_faces(std::span<const std::uint64_t> numbers) {
  std::vector<std::uint64_t> face;
  for (auto begin = numbers.begin(); begin != numbers.end();) {
    const auto end = std::find(begin + 1, numbers.end(), *begin);
    if (end == numbers.end() || end - begin < 3) return false;
    face.assign(begin, end);
    std::sort(face.begin(), face.end());
    if (std::adjacent_find(face.begin(), face.end()) != face.end()) return false;
    begin = end + 1;
  }
  return !numbers.empty();
}

template <class Coder>
bool Polyhedra<Coder>::code(Coder& symbols, const StoredCell& stored, CellTopology& cell,
                            std::uint64_t number,
                            const std::function<void(std::uint32_t)>& add_vertex) {
  bool by_faces = false;
  if constexpr (!Coder::kDecodes) by_faces = told_by_faces(stored.numbers);
  cell.by_faces = symbols.bit(by_faces_, by_faces);
  if (!cell.by_faces) return true;
  mixing_.use(symbols);
  add_vertex_ = &add_vertex;
  number_ = number;
  numbers_ = stored.numbers;
  begin_cell(cell);
  do {
    if (!code_face(cell)) return false;
  } while (!code_end());
  end_cell();
  block_->ids.resize(cell.slots.size());
  for (std::size_t i = 0; i < cell.slots.size(); ++i)
    block_->ids[i] = surface_->vertex(cell.slots[i]).id;
  return true;
}

template <class Coder>
void Polyhedra<Coder>::begin_cell(CellTopology& cell) {
  for (auto& models : which_)
    if (models.empty()) models.resize(std::size_t{4} * 3 * 4 * 2 * 2);
  block_ = &past_[cell.block];
  shift_ = block_->step;
  ++cell_round_;
  ++face_round_;  // the first face of a cell has no previous face
  behind_.fill(OpenFaces::kNever);
  behind_count_ = 0;
  vertex_count_ = 0;
  position_ = faces_ = open_edges_ = last_size_ = 0;
  outcomes_ = 0;
  cell_outcomes_.clear();
  cell_edges_.clear();
  new_cycles_.clear();
  cycle_ends_.clear();
  if constexpr (Coder::kDecodes) {
    cell.slots.clear();
  } else {
    positions_.clear();
    for (std::uint32_t i = 0; i < numbers_.size(); ++i) positions_.push_back({numbers_[i], i});
    std::sort(positions_.begin(), positions_.end());
  }
}

template <class Coder>
void Polyhedra<Coder>::end_cell() {
  std::uint32_t begin = 0;
  for (const std::uint32_t end : cycle_ends_) {
    open_.add_face(std::span(new_cycles_).subspan(begin, end - begin), number_);
    begin = end;
  }
  for (const auto& [a, b] : cell_edges_) open_.add_edge(a, b);
  before_ = outcomes_;
  last_outcomes_.swap(cell_outcomes_);
}

template <class Coder>
bool Polyhedra<Coder>::code_face(CellTopology& cell) {
  path_.clear();
  matches_.clear();
  ++face_round_;
  const std::uint32_t begin = position_;
  for (;;) {
    if (position_ == kMaxNodesPerCell) return false;
    bool ends = false;
    if constexpr (!Coder::kDecodes) ends = numbers_[position_] == numbers_[begin];
    if (path_.size() >= 3 && code_close(ends)) break;
    if (!code_node(cell)) return false;
  }
  if constexpr (Coder::kDecodes) cell.slots.push_back(path_[0]);
  ++position_;
  note_outcome(kCloses);
  close_face();
  return true;
}

/// Codes whether the face ends here.
template <class Coder>
bool Polyhedra<Coder>::code_close(bool ends) {
  const std::size_t n = path_.size();
  std::uint32_t match = matches_.empty() ? 0 : 1;
  for (const Match& found : matches_)
    if (open_.cycle(found.face).size() == n) match = 2;
  const std::uint32_t inside = times(path_.back(), path_[0]);
  const std::uint32_t edge = inside == 1                                                 ? 1
                             : inside == 0 && open_.cells_at(path_.back(), path_[0]) > 0 ? 2
                                                                                         : 0;
  const std::uint32_t i = at_most(n, 15);
  mixing_.about(kClose, clue(match, edge, i, at_most(open_edges_, 7)),
                clue(position_, outcomes_, match), clue(position_, outcomes_, before_, match),
                clue(match, edge, i, last_size_), clue(match, edge, i, last_outcome(), faces_));
  return mixing_.bit(close_[match][edge][i], ends);
}

/// Codes whether the face just coded is the last face of the cell.
template <class Coder>
bool Polyhedra<Coder>::code_end() {
  const bool closed = open_edges_ == 0;
  bool ends = false;
  if constexpr (!Coder::kDecodes) ends = position_ == numbers_.size();
  mixing_.about(kEnd, clue(closed, faces_), clue(closed, outcomes_), clue(closed, last_outcome()),
                clue(closed, at_most(open_edges_, 15), last_size_));
  return mixing_.bit(end_[closed ? 1 : 0][at_most(faces_, 15)], ends);
}

template <class Coder>
bool Polyhedra<Coder>::code_node(CellTopology& cell) {
  const std::uint32_t q = position_;
  const auto& ids = block_->ids;
  expected_ = q < ids.size() ? ids[q] + shift_ : q > 0 ? surface_->vertex(cell.slots[q - 1]).id : 0;
  if constexpr (Coder::kDecodes) cell.slots.push_back(kNone);
  gather();
  const std::uint32_t i = at_most(path_.size(), 2);
  Candidate none;
  const Candidate& best = candidates_.empty() ? none : candidates_[0];
  const std::uint32_t chance = candidates_.empty() ? 16 : best.chance >> 12;
  const std::uint32_t kind = candidates_.empty() ? 0 : best.open > 0 ? 1 : best.inside == 1 ? 2 : 3;
  const auto code_bit = [&](Question question, auto& models, bool value) {
    mixing_.about(question, clue(i, best.why(), chance), clue(q, outcomes_),
                  clue(q, outcomes_, before_), clue(i, last_outcome(), best.why()),
                  clue(at_most(path_.size(), 15), chance, at_most(matches_.size(), 3),
                       at_most(open_edges_, 15), candidates_.size()));
    return mixing_.bit(models[i][kind], value);
  };
  std::uint32_t outcome = kIsNew;
  if (code_bit(kNew, is_new_, cell.slots[q] == kNone)) {
    (*add_vertex_)(q);
    if constexpr (!Coder::kDecodes) fill_repeats(cell);
  } else {
    bool among = false;
    if constexpr (!Coder::kDecodes)
      among = std::any_of(candidates_.begin(), candidates_.end(),
                          [&](const Candidate& c) { return c.slot == cell.slots[q]; });
    if (!candidates_.empty() && code_bit(kAmong, among_, among)) {
      outcome = code_taken(cell);
    } else {
      if (!code_missed(cell)) return false;
      outcome = kIsMissed;
    }
  }
  const std::uint64_t id = surface_->vertex(cell.slots[q]).id;
  if (q < ids.size()) shift_ = id - ids[q];
  if (q == 0) block_->step = shift_;
  ++position_;
  note_outcome(outcome);
  take(cell.slots[q]);
  return true;
}

/// Codes which of the candidates the node is. Returns the outcome.
template <class Coder>
std::uint32_t Polyhedra<Coder>::code_taken(CellTopology& cell) {
  const std::uint32_t q = position_, i = at_most(path_.size(), 2);
  std::uint32_t r = 0;
  for (; r + 1 < candidates_.size(); ++r) {
    const Candidate& c = candidates_[r];
    mixing_.about(kWhich, clue(i, c.why(), r), clue(i, c.why(), c.place, faces_ == 0),
                  clue(q, outcomes_, c.why()), clue(i, c.why(), c.place, last_size_, path_.size()),
                  clue(q, last_outcome(), c.why(), before_));
    if (mixing_.bit(*c.model, c.slot == cell.slots[q])) break;
  }
  const Candidate& c = candidates_[r];
  cell.slots[q] = c.slot;
  return kIsTaken + c.open + 4u * at_most(c.inside, 1) + 8u * c.place;
}

/// Codes a node that is not a candidate: any live vertex that is not yet in the face. Returns false
/// if the data is damaged and does not identify such a vertex.
template <class Coder>
bool Polyhedra<Coder>::code_missed(CellTopology& cell) {
  const std::uint32_t q = position_;
  std::uint64_t id = 0;
  if constexpr (!Coder::kDecodes) id = surface_->vertex(cell.slots[q]).id;
  id = expected_ +
       static_cast<std::uint64_t>(code_signed(mixing_.engine(), step_[q > 0 ? 1 : 0],
                                              static_cast<std::int64_t>(id - expected_)));
  cell.slots[q] = surface_->slot_of(id);
  return cell.slots[q] != kNone && seen(cell.slots[q]).face != face_round_;
}

template <class Coder>
void Polyhedra<Coder>::note_outcome(std::uint32_t outcome) {
  outcomes_ = mixing::hash(outcomes_, outcome);
  cell_outcomes_.push_back(outcome);
}

/// Encoding: copies the slot of the new vertex at this position to all other positions of the cell
/// that have the same vertex number.
template <class Coder>
void Polyhedra<Coder>::fill_repeats(CellTopology& cell) {
  const std::uint64_t number = numbers_[position_];
  for (auto it = std::lower_bound(positions_.begin(), positions_.end(),
                                  std::pair<std::uint64_t, std::uint32_t>{number, 0});
       it != positions_.end() && it->first == number; ++it)
    cell.slots[it->second] = cell.slots[position_];
}

// --- the current cell and face

/// Appends the next node of the face.
template <class Coder>
void Polyhedra<Coder>::take(std::uint32_t slot) {
  Seen& vertex = seen(slot);
  if (vertex.cell != cell_round_) {
    vertex.cell = cell_round_;
    vertex.vertex = static_cast<std::uint32_t>(vertex_count_++);
    if (vertices_.size() < vertex_count_) vertices_.emplace_back();
    vertices_[vertex.vertex].slot = slot;
    vertices_[vertex.vertex].edges.clear();
  }
  const std::size_t i = path_.size();
  path_.push_back(slot);
  vertex.face = face_round_;
  vertex.place = at_most(i + 1, 7);
  if (i == 0) {
    const auto places = open_.faces_at(slot);
    for (std::size_t k = places.size(); k-- > 0;)
      for (const bool along : {false, true})
        matches_.push_back({places[k].face, places[k].at, along});
  } else {
    std::erase_if(matches_, [&](const Match& match) { return node_of(match, i) != slot; });
  }
}

/// Returns the vertex of the open face that corresponds to node `i` of the current face. Returns
/// kNone if the open face has no more vertices.
template <class Coder>
std::uint32_t Polyhedra<Coder>::node_of(const Match& match, std::size_t i) const {
  const auto cycle = open_.cycle(match.face);
  const std::size_t n = cycle.size();
  return i < n ? cycle[(match.at + (match.along ? i : n - i)) % n] : kNone;
}

template <class Coder>
void Polyhedra<Coder>::close_face() {
  if (const std::uint32_t found = open_.find(path_); found != kNone) {
    if (behind_count_ < behind_.size()) behind_[behind_count_++] = open_.cell_of(found);
    open_.remove_face(found);
  } else {
    new_cycles_.insert(new_cycles_.end(), path_.begin(), path_.end());
    cycle_ends_.push_back(static_cast<std::uint32_t>(new_cycles_.size()));
  }
  for (std::size_t i = 0; i < path_.size(); ++i) note_edge(path_[i], path_[(i + 1) % path_.size()]);
  last_size_ = at_most(path_.size(), 15);
  ++faces_;
}

template <class Coder>
void Polyhedra<Coder>::note_edge(std::uint32_t a, std::uint32_t b) {
  auto& from = vertices_[seen(a).vertex].edges;
  auto& to = vertices_[seen(b).vertex].edges;
  const auto find = [](auto& edges, std::uint32_t end) {
    return std::find_if(edges.begin(), edges.end(),
                        [&](const auto& edge) { return edge.first == end; });
  };
  if (const auto there = find(from, b); there != from.end()) {
    if (there->second == 1) --open_edges_;
    there->second = find(to, a)->second = 2;
  } else if (from.size() < kMostEdges && to.size() < kMostEdges) {
    from.push_back({b, 1});
    to.push_back({a, 1});
    ++open_edges_;
    cell_edges_.push_back({a, b});
  }
}

/// Returns how many of the faces coded so far in this cell contain the edge; 2 means two or more.
template <class Coder>
std::uint32_t Polyhedra<Coder>::times(std::uint32_t a, std::uint32_t b) {
  if (seen(a).cell != cell_round_) return 0;
  for (const auto& [to, count] : vertices_[seen(a).vertex].edges)
    if (to == b) return count;
  return 0;
}

// --- candidates

template <class Coder>
auto Polyhedra<Coder>::add(std::uint32_t slot) -> Candidate* {
  Seen& vertex = seen(slot);
  if (vertex.node == node_round_)
    return vertex.candidate == kNone ? nullptr : &candidates_[vertex.candidate];
  vertex.node = node_round_;
  vertex.candidate = kNone;
  if (candidates_.size() == kCandidates || vertex.face == face_round_ ||
      !surface_->vertex(slot).alive)
    return nullptr;
  vertex.candidate = static_cast<std::uint32_t>(candidates_.size());
  Candidate& c = candidates_.emplace_back();
  c.slot = slot;
  c.ours = vertex.cell == cell_round_;
  c.place =
      vertex.face + 1 == face_round_ ? static_cast<std::uint8_t>(vertex.place) : std::uint8_t{0};
  return &c;
}

template <class Coder>
void Polyhedra<Coder>::gather() {
  candidates_.clear();
  ++node_round_;
  if (!path_.empty())
    gather_next();
  else if (faces_ > 0)
    gather_beginnings();
  else
    gather_first();
  rank();
}

/// Collects candidates for the first node of the first face of a cell.
template <class Coder>
void Polyhedra<Coder>::gather_first() {
  add_expected();
  const auto& ids = block_->ids;
  for (std::size_t k = 0; k < std::min(ids.size(), kLooked); ++k) {
    const std::uint32_t slot = surface_->slot_of(ids[k]);
    Candidate* const c = slot == kNone ? nullptr : add(slot);
    if (c == nullptr) continue;
    const auto places = open_.faces_at(slot);
    c->edge = static_cast<std::uint8_t>(at_most(places.size(), 3));
    if (std::any_of(places.begin(), places.end(), [](const auto& place) { return place.at == 0; }))
      c->inside = 1;
  }
}

/// Collects candidates for the first node of a later face: the ends of edges that only one face of
/// the cell contains, and neighbours of these vertices.
template <class Coder>
void Polyhedra<Coder>::gather_beginnings() {
  const std::size_t looked = std::min(vertex_count_, kLooked);
  for (std::size_t k = 0; k < looked; ++k) {
    const CellVertex& vertex = vertices_[k];
    std::size_t open_edges = 0;
    for (const auto& edge : vertex.edges) open_edges += edge.second == 1 ? 1 : 0;
    Candidate* const c = open_edges == 0 ? nullptr : add(vertex.slot);
    if (c == nullptr) continue;
    const auto places = open_.faces_at(vertex.slot);
    c->inside = static_cast<std::uint8_t>(at_most(open_edges, 2));
    c->edge = static_cast<std::uint8_t>(at_most(places.size(), 3));
    for (const auto& place : places.last(std::min(places.size(), kLookedFaces))) {
      const auto cycle = open_.cycle(place.face);
      const std::size_t n = cycle.size();
      if (times(vertex.slot, cycle[(place.at + 1) % n]) != 1 &&
          times(vertex.slot, cycle[(place.at + n - 1) % n]) != 1)
        continue;
      c->open = std::max(c->open, beginning(place.at, n));
    }
  }
  add_expected();
  for (std::size_t k = 0; k < looked && candidates_.size() < kCandidates; ++k)
    for (const auto& edge : open_.edges_at(vertices_[k].slot))
      if (seen(edge.to).cell != cell_round_) add(edge.to);
}

/// Collects candidates for a later node of a face: the next vertex along an open face, along an
/// edge that only one face of the cell contains, or along an edge of the mesh.
template <class Coder>
void Polyhedra<Coder>::gather_next() {
  const std::uint32_t from = path_.back();
  for (const Match& match : matches_) {
    const std::uint32_t slot = node_of(match, path_.size());
    Candidate* const c = slot == kNone ? nullptr : add(slot);
    if (c != nullptr)
      c->open = std::max(c->open, beginning(match.at, open_.cycle(match.face).size()));
  }
  const auto& edges = vertices_[seen(from).vertex].edges;
  for (const auto& [to, count] : edges)
    if (Candidate* const c = count == 1 ? add(to) : nullptr) c->inside = 1;
  for (const auto& edge : open_.edges_at(from))
    if (Candidate* const c = add(edge.to))
      c->edge = static_cast<std::uint8_t>(at_most(edge.cells, 3));
  add_expected();
  for (const auto& [to, count] : edges)
    if (const Seen& vertex = seen(to);
        count > 1 && vertex.node == node_round_ && vertex.candidate != kNone)
      candidates_[vertex.candidate].inside = 2;
}

template <class Coder>
void Polyhedra<Coder>::add_expected() {
  const std::uint32_t slot = surface_->slot_of(expected_);
  if (Candidate* const c = slot == kNone ? nullptr : add(slot)) c->shift = true;
}

/// Chooses the model of each candidate. Sorts the candidates by predicted probability; the most
/// likely candidate comes first.
template <class Coder>
void Polyhedra<Coder>::rank() {
  auto& which = which_[at_most(path_.size(), 2)];
  for (Candidate& c : candidates_) {
    std::size_t index = c.open;
    index = 3 * index + c.inside;
    index = 4 * index + c.edge;
    index = 2 * index + (c.shift ? 1 : 0);
    index = 2 * index + (c.ours ? 1 : 0);
    c.model = &which[index];
    c.chance = c.model->adaptive.probability_of_one();
  }
  sort_by_chance(candidates_);
}

// --- after a cell

template <class Coder>
void Polyhedra<Coder>::code_last_use(Coder& symbols, CellTopology& cell) {
  mixing_.use(symbols);
  std::uint32_t finals = 1;
  const std::size_t count = std::min<std::size_t>(cell.slots.size(), kMaxLastUse);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t slot = cell.slots[i];
    const auto end = cell.slots.begin() + i;
    if (std::find(cell.slots.begin(), end, slot) != end) {
      cell.last_use[i] = 0;
      continue;
    }
    const std::uint32_t open = at_most(open_.faces_at(slot).size(), 7);
    const std::uint32_t edges = at_most(open_.edges_at(slot).size(), 7);
    const std::uint32_t uses = at_most(surface_->vertex(slot).uses, 63);
    mixing_.about(kLast, clue(open, edges), clue(open, edges, uses), clue(i, open, finals),
                  clue(i, open, edges, last_finals_), clue(open, uses, outcomes_));
    cell.last_use[i] = mixing_.bit(last_[open][edges], cell.last_use[i] != 0) ? 1 : 0;
    finals = 2 * finals + cell.last_use[i];
  }
  last_finals_ = finals;
}

template class Polyhedra<RangeEncoder>;
template class Polyhedra<RangeDecoder>;

}  // namespace shm
