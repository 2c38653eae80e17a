#include "codecs/paper/paper_hexahedra.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace shm {
namespace {

// Returns the bit that represents a face in a bit mask of faces.
constexpr std::uint32_t face_bit(std::uint32_t face) { return 1u << face; }

// Order in which the faces of the previous hexahedron are tried as the gate, which is the face to
// which the current hexahedron is attached. The first is face 5, opposite to the previous gate; the
// last is face 0, the previous gate itself.
constexpr std::array<std::uint8_t, 6> kGateOrder = {5, 3, 1, 4, 2, 0};

template <std::size_t kCount>
bool all_different(const std::array<std::uint32_t, kCount>& slots) {
  for (std::size_t i = 0; i < kCount; ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (slots[i] == slots[j]) return false;
  return true;
}

enum class Fit : std::uint8_t { none, hut, roof, step, bridge };
/// Returns the operation that codes a hexahedron whose active faces are `mask`. The faces are
/// numbered as in the rotated hexahedron. Returns `none` if no operation has these active faces.
constexpr Fit fit_of(std::uint32_t mask) {
  const auto has = [&](std::uint32_t faces) { return (mask & faces) == faces; };
  const int count = std::popcount(mask);
  if (!has(face_bit(0))) return Fit::none;
  if (count == 1) return Fit::hut;
  if (count == 2 && has(face_bit(5))) return Fit::roof;
  if (count == 2 && has(face_bit(1))) return Fit::step;
  if (has(face_bit(1) | face_bit(2))) return Fit::step;  // CORNER, GAP, PIT, DEN
  const bool tunnel = mask == (face_bit(0) | face_bit(1) | face_bit(3) | face_bit(5));
  return (count == 3 || tunnel) && has(face_bit(1) | face_bit(3)) ? Fit::bridge : Fit::none;
}

/// A rotation that the encoder tries, and the operation that can code the hexahedron if it is
/// rotated in this way.
struct RotationFit {
  std::uint8_t rotation = 0;
  Fit fit = Fit::none;
};
struct RotationFits {
  std::array<RotationFit, kRotationCount> fits{};
  std::uint8_t count = 0;
};
constexpr auto kFits = [] {
  std::array<RotationFits, 64> table{};
  for (std::uint32_t active = 0; active < 64; ++active)
    for (std::uint8_t r = 0; r < kRotationCount; ++r) {
      std::uint32_t mask = 0;
      for (std::uint32_t k = 0; k < 6; ++k)
        if ((active >> kRotatedFace[r][k] & 1) != 0) mask |= face_bit(k);
      const Fit fit = fit_of(mask);
      if (fit != Fit::none) table[active].fits[table[active].count++] = {r, fit};
    }
  return table;
}();

// Returns true if all corners of the face are known. `corners`: vertex slots of the corners of the
// hexahedron; kNone for an unknown corner.
bool known(const std::array<std::uint32_t, 8>& corners, std::uint32_t face) {
  for (std::uint8_t c : kFaceCorners[face])
    if (corners[c] == kNone) return false;
  return true;
}

}  // namespace

// --- encoder: the choice of operation, rotation and gate

template <class Coder>
auto PaperHexahedra<Coder>::choose_plan(const StoredCell& cell) const -> Plan {
  Plan best;
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t j = 0; j < i; ++j)
      if (cell.numbers[i] == cell.numbers[j]) return best;
  Corners stored{};
  std::copy_n(cell.slots.begin(), 8, stored.begin());
  std::array<std::uint32_t, 6> active{};
  std::uint32_t active_set = 0;
  for (std::uint32_t f = 0; f < 6; ++f) {
    const auto& c = kFaceCorners[f];
    active[f] = known(stored, f)
                    ? surface_.find_face(stored[c[0]], stored[c[1]], stored[c[2]], stored[c[3]])
                    : kNone;
    if (active[f] != kNone) active_set |= face_bit(f);
  }
  const RotationFits& possible = kFits[active_set];
  for (std::uint32_t n = 0; n < possible.count; ++n) {
    const auto [r, fit] = possible.fits[n];
    Plan plan;
    plan.rotation = r;
    plan.operation = fit == Fit::hut    ? kHut
                     : fit == Fit::roof ? kRoof
                     : fit == Fit::step ? kStep
                                        : kBridge;
    plan.gate_face = active[kRotatedFace[r][0]];
    if (fit == Fit::roof) plan.far_face = active[kRotatedFace[r][5]];
    if (fit == Fit::bridge) plan.far_face = active[kRotatedFace[r][3]];
    if (fit == Fit::step || fit == Fit::bridge) plan.side_face = active[kRotatedFace[r][1]];
    Corners target{};
    for (std::uint32_t i = 0; i < 8; ++i) target[i] = stored[kRotations[r][i]];
    rate_gate(plan, target);
    if (plan.cost < best.cost) best = plan;
  }
  return best;
}

/// Determines how the gate would be coded (`plan.mode`), and estimates its coding cost
/// (`plan.cost`, in arbitrary units). A smaller cost is better.
template <class Coder>
void PaperHexahedra<Coder>::rate_gate(Plan& plan, const Corners& target) const {
  const bool turns = plan.operation == kStep || plan.operation == kBridge;
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t k = kGateOrder[i];
    if (previous_face_[k] != plan.gate_face || !on_previous(plan.gate_face)) continue;
    const Quad& quad = surface_.face(plan.gate_face).quad;
    const auto turn =
        static_cast<std::uint32_t>(std::find(quad.begin(), quad.end(), target[0]) - quad.begin());
    if (!turns && turn != 0)
      return;  // a HUT or ROOF is possible on this face only if corner 0 is the face's first vertex
    plan.mode = kOnFace;
    plan.cost = (k == last_face_ ? 0 : 8 + i) * 8 + (turn == last_turn_ ? 0 : 1 + turn);
    return;
  }
  if (has_previous_) {
    for (std::uint32_t e = 0; e < 12; ++e) {
      const std::uint32_t a = kEdgeCorners[e][0], b = kEdgeCorners[e][1];
      if (!previous_alive(a) || !previous_alive(b)) continue;
      const bool here = (previous_[a] == target[0] && previous_[b] == target[3]) ||
                        (previous_[a] == target[3] && previous_[b] == target[0]);
      if (!here) continue;
      plan.mode = kAtEdge;
      plan.cost = 1000 + e;
      return;
    }
    for (std::uint32_t c = 0; c < 8; ++c) {
      if (!previous_alive(c) || previous_[c] != target[0]) continue;
      plan.mode = kAtVertex;
      plan.cost = 2000 + c;
      return;
    }
  }
  plan.mode = kAnywhere;
  const std::uint64_t id = surface_.vertex(target[0]).id;
  const std::uint64_t last = gate_reference_.last;
  const std::uint64_t step = id > last ? id - last : last - id;
  std::uint64_t position = 0;
  for (FaceCorner corner = surface_.vertex(target[0]).first_face; corner != kNone;
       corner = surface_.next_around(corner), ++position)
    if (corner / 4 == plan.gate_face) break;
  plan.cost = 4000 + std::min(step, id - surface_.oldest_id()) * 16 + position;
}

template <class Coder>
void PaperHexahedra<Coder>::rotate(const StoredCell& stored, CellTopology& cell,
                                   std::uint32_t rotation) {
  for (std::uint32_t i = 0; i < 8; ++i) {
    const std::uint8_t from = kRotations[rotation][i];
    cell.stored_corner[i] = from;
    cell.slots[i] = stored.slots[from];
    cell.last_use[i] = stored.last_use[from];
  }
}

// --- coding of a hexahedron

template <class Coder>
bool PaperHexahedra<Coder>::code(Coder& symbols, Coder& corner_order, const StoredCell& stored,
                                 CellTopology& cell, bool order_matters) {
  Plan plan;
  if constexpr (!Coder::kDecodes) {
    plan = choose_plan(stored);
    if (plan.operation != kStart) rotate(stored, cell, plan.rotation);
  }
  Corners target{};
  std::copy_n(cell.slots.begin(), 8, target.begin());

  const std::uint32_t coded = code_tree(symbols, operations_[last_operation_][mode_history_],
                                        static_cast<std::uint32_t>(plan.operation));
  if (coded >= kOperations) return false;
  operation_ = static_cast<Operation>(coded);
  if constexpr (Coder::kDecodes) plan.operation = operation_;

  if (operation_ == kStart) {
    for (std::uint8_t i : kCornerOrder) {
      const std::uint32_t repeats = Coder::kDecodes ? 8 : earlier_corner(stored, i);
      if (!code_corner(symbols, target, cell, i, repeats)) return false;
    }
    last_operation_ = operation_;
    attach(cell, order_matters);
    return true;
  }
  Gate gate;
  if (!code_gate(symbols, plan, target, gate)) return false;
  for (std::uint32_t i = 0; i < 4; ++i)
    cell.slots[i] = surface_.around(gate.at, gate.mirrored ? (4 - i) % 4 : i);

  bool ok = true;
  if (operation_ == kRoof) ok = code_roof(symbols, plan, target, cell);
  if (operation_ == kStep || operation_ == kBridge)
    ok = code_second_face(symbols, plan, target, gate.at, cell);
  if (operation_ == kHut)
    for (std::uint32_t i : {4u, 7u, 5u, 6u}) ok = ok && code_corner(symbols, target, cell, i);
  last_operation_ = operation_;
  ok = ok && (!order_matters || code_corner_order(corner_order, gate, cell, plan.rotation));
  if (ok) attach(cell, order_matters);
  return ok;
}

template <class Coder>
bool PaperHexahedra<Coder>::previous_alive(std::uint32_t corner) const {
  const auto& vertex = surface_.vertex(previous_[corner]);
  return vertex.alive && vertex.id == previous_id_[corner];
}

template <class Coder>
bool PaperHexahedra<Coder>::on_previous(std::uint32_t face) const {
  return surface_.face(face).alive && surface_.face(face).cell == previous_cell_;
}

/// Lists the faces at the edges of the previous hexahedron, except that hexahedron's own faces.
/// Each entry is a pair: the corner of the face at the first vertex of the edge, and the index of
/// the edge. Edges are in ascending order; the faces at one edge are listed from newest to oldest.
template <class Coder>
void PaperHexahedra<Coder>::list_edge_gates(
    std::vector<std::pair<FaceCorner, std::uint32_t>>& out) const {
  out.clear();
  if (!has_previous_) return;
  for (std::uint32_t e = 0; e < 12; ++e) {
    const std::uint32_t a = kEdgeCorners[e][0], b = kEdgeCorners[e][1];
    if (!previous_alive(a) || !previous_alive(b)) continue;
    for (FaceCorner corner = surface_.vertex(previous_[a]).first_face; corner != kNone;
         corner = surface_.next_around(corner))
      if ((surface_.around(corner, 1) == previous_[b] ||
           surface_.around(corner, 3) == previous_[b]) &&
          !on_previous(corner / 4))
        out.emplace_back(corner, e);
  }
}

template <class Coder>
void PaperHexahedra<Coder>::list_vertex_gates(
    std::vector<std::pair<FaceCorner, std::uint32_t>>& out) const {
  out.clear();
  if (!has_previous_) return;
  for (std::uint32_t c = 0; c < 8; ++c) {
    if (!previous_alive(c)) continue;
    for (FaceCorner corner = surface_.vertex(previous_[c]).first_face; corner != kNone;
         corner = surface_.next_around(corner))
      if (!on_previous(corner / 4)) out.emplace_back(corner, c);
  }
}

template <class Coder>
bool PaperHexahedra<Coder>::code_gate(Coder& symbols, const Plan& plan, const Corners& target,
                                      Gate& gate) {
  bool mirrored = false;
  if constexpr (!Coder::kDecodes) {
    const Quad& quad = surface_.face(plan.gate_face).quad;
    const auto turn =
        static_cast<std::uint32_t>(std::find(quad.begin(), quad.end(), target[0]) - quad.begin());
    mirrored = quad[(turn + 1) % 4] != target[1];
  }
  gate.mirrored = symbols.bit(mirrored_[operation_], mirrored);
  return code_gate_face(symbols, plan, target, gate.at, gate.mirrored);
}

/// Codes the gate. Tries the modes (on the previous hexahedron, at its edges, at its vertices,
/// anywhere) in this order, and skips modes for which no face exists.
template <class Coder>
bool PaperHexahedra<Coder>::code_gate_face(Coder& symbols, const Plan& plan, const Corners& target,
                                           FaceCorner& corner, bool mirrored) {
  auto& models = modes_[operation_][mode_history_];
  const auto is_mode = [&](GateMode mode, bool possible) {
    const bool is = mode == kAnywhere || (possible && symbols.bit(models[mode], plan.mode == mode));
    if (is) mode_history_ = (mode_history_ << 2 | static_cast<std::uint32_t>(mode)) & 15;
    return is;
  };
  std::uint32_t previous_faces = 0;
  for (std::uint32_t k : kGateOrder)
    if (previous_face_[k] != kNone && on_previous(previous_face_[k])) ++previous_faces;
  if (is_mode(kOnFace, previous_faces > 0)) {
    corner = code_gate_on_face(symbols, plan, target, previous_faces);
    return true;
  }
  list_edge_gates(scratch_);
  if (is_mode(kAtEdge, !scratch_.empty())) {
    corner = code_gate_at_edge(symbols, plan, target, mirrored);
    return true;
  }
  list_vertex_gates(scratch_);
  if (is_mode(kAtVertex, !scratch_.empty())) {
    corner = code_gate_at_vertex(symbols, plan, target);
    return true;
  }
  is_mode(kAnywhere, true);
  return code_gate_anywhere(symbols, plan, target, corner);
}

/// Codes which face of the previous hexahedron is the gate, and which corner of this face is corner
/// 0 of the current hexahedron. `left`: number of faces of the previous hexahedron that are still
/// active.
template <class Coder>
FaceCorner PaperHexahedra<Coder>::code_gate_on_face(Coder& symbols, const Plan& plan,
                                                    const Corners& target, std::uint32_t left) {
  for (std::uint32_t k : kGateOrder) {
    const std::uint32_t face = previous_face_[k];
    if (face == kNone || !on_previous(face)) continue;
    if (--left > 0 && !symbols.bit(gate_on_face_[last_face_][k], face == plan.gate_face)) continue;
    std::uint32_t turn = 0;
    if (operation_ == kStep || operation_ == kBridge) {
      const Quad& quad = surface_.face(face).quad;
      turn = static_cast<std::uint32_t>(std::find(quad.begin(), quad.end(), target[0]) -
                                        quad.begin()) &
             3;
      turn = code_tree(symbols, turn_[k][last_turn_], turn);
      last_turn_ = turn;
    }
    last_face_ = k;
    return face * 4 + turn;
  }
  return kNone;
}

/// Codes which of the faces in `scratch_` is the gate. Each of these faces shares an edge with the
/// previous hexahedron. The shared edge of the gate becomes the edge from corner 0 to corner 3 of
/// the current hexahedron.
template <class Coder>
FaceCorner PaperHexahedra<Coder>::code_gate_at_edge(Coder& symbols, const Plan& plan,
                                                    const Corners& target, bool mirrored) {
  for (std::size_t i = 0; i < scratch_.size(); ++i) {
    const auto [corner, edge] = scratch_[i];
    const bool forward = surface_.around(corner, 1) == previous_[kEdgeCorners[edge][1]];
    // In the order around the face, corner 3 is just before corner 0. If the face is mirrored,
    // corner 3 is just after corner 0.
    const std::uint32_t step = forward ? (mirrored ? 0u : 1u) : (mirrored ? 3u : 0u);
    const FaceCorner origin = corner / 4 * 4 + (corner + step) % 4;
    const bool hit =
        !Coder::kDecodes && corner / 4 == plan.gate_face && surface_.around(origin, 0) == target[0];
    if (i + 1 == scratch_.size() || symbols.bit(gate_at_edge_[edge], hit)) return origin;
  }
  return kNone;
}

/// Codes which of the faces in `scratch_` is the gate. Each of these faces shares a vertex with the
/// previous hexahedron. The shared vertex of the gate becomes corner 0 of the current hexahedron.
template <class Coder>
FaceCorner PaperHexahedra<Coder>::code_gate_at_vertex(Coder& symbols, const Plan& plan,
                                                      const Corners& target) {
  for (std::size_t i = 0; i < scratch_.size(); ++i) {
    const auto [corner, vertex] = scratch_[i];
    const bool hit =
        !Coder::kDecodes && corner / 4 == plan.gate_face && surface_.around(corner, 0) == target[0];
    if (i + 1 == scratch_.size() || symbols.bit(gate_at_vertex_[vertex], hit)) return corner;
  }
  return kNone;
}

/// Codes the gate as the number of a live vertex and the index of the gate among the faces at this
/// vertex.
template <class Coder>
bool PaperHexahedra<Coder>::code_gate_anywhere(Coder& symbols, const Plan& plan,
                                               const Corners& target, FaceCorner& corner) {
  std::uint32_t vertex = target[0];
  if (!code_reference(symbols, gate_reference_, vertex)) return false;
  scratch_.clear();
  std::uint32_t index = 0;
  for (FaceCorner f = surface_.vertex(vertex).first_face; f != kNone; f = surface_.next_around(f)) {
    if (f / 4 == plan.gate_face) index = static_cast<std::uint32_t>(scratch_.size());
    scratch_.emplace_back(f, 0);
  }
  if (scratch_.empty()) return false;
  index = code_choice(symbols, gate_anywhere_, static_cast<std::uint32_t>(scratch_.size()), index);
  corner = scratch_[index].first;
  return true;
}

/// Codes a face that contains the edge between the vertices `from` and `along` and differs from
/// `not_face`. Sets `above_from` to the other vertex next to `from` in this face, and `above_along`
/// to the other vertex next to `along`.
template <class Coder>
bool PaperHexahedra<Coder>::code_side(Coder& symbols, std::uint32_t along, std::uint32_t from,
                                      std::uint32_t not_face, std::uint32_t side_face, int model,
                                      std::uint32_t& above_from, std::uint32_t& above_along) {
  scratch_.clear();
  std::uint32_t index = 0;
  for (FaceCorner corner = surface_.vertex(from).first_face; corner != kNone;
       corner = surface_.next_around(corner)) {
    if (corner / 4 == not_face) continue;
    if (surface_.around(corner, 1) != along && surface_.around(corner, 3) != along) continue;
    if (corner / 4 == side_face) index = static_cast<std::uint32_t>(scratch_.size());
    scratch_.emplace_back(corner, 0);
  }
  if (scratch_.empty()) return false;
  index = code_choice(symbols, side_[static_cast<std::size_t>(model)],
                      static_cast<std::uint32_t>(scratch_.size()), index);
  const FaceCorner corner = scratch_[index].first;
  const bool forward = surface_.around(corner, 1) == along;
  above_from = surface_.around(corner, forward ? 3 : 1);
  above_along = surface_.around(corner, 2);
  return true;
}

template <class Coder>
bool PaperHexahedra<Coder>::code_second_face(Coder& symbols, const Plan& plan,
                                             const Corners& target, FaceCorner gate,
                                             CellTopology& cell) {
  auto& v = cell.slots;
  if (!code_side(symbols, v[3], v[0], gate / 4, plan.side_face, 0, v[4], v[7])) return false;
  if (operation_ == kBridge)
    return code_side(symbols, v[2], v[1], gate / 4, plan.far_face, 1, v[5], v[6]);
  return code_corners_left(symbols, target, cell);
}

/// Codes corners 5 and 6 after a STEP. If active faces determine these corners, the corners are
/// deduced from the faces instead of being coded.
template <class Coder>
bool PaperHexahedra<Coder>::code_corners_left(Coder& symbols, const Corners& target,
                                              CellTopology& cell) {
  auto& v = cell.slots;
  const FaceCorner front = surface_.find_path(v[1], v[0], v[4]);
  if (front != kNone) {
    const std::uint32_t deduced = surface_.around(front, 2);
    if (symbols.bit(confirm_[0], deduced == target[5])) {
      v[5] = deduced;
      const std::array<std::array<std::uint32_t, 3>, 3> paths = {
          {{v[2], v[1], v[5]}, {v[2], v[3], v[7]}, {v[5], v[4], v[7]}}};
      for (std::size_t i = 0; i < 3; ++i) {
        const FaceCorner corner = surface_.find_path(paths[i][0], paths[i][1], paths[i][2]);
        if (corner == kNone) continue;
        const std::uint32_t sixth = surface_.around(corner, 2);
        if (!symbols.bit(confirm_[i + 1], sixth == target[6])) continue;
        v[6] = sixth;
        return true;
      }
      return code_corner(symbols, target, cell, 6);
    }
  }
  return code_corner(symbols, target, cell, 5) && code_corner(symbols, target, cell, 6);
}

template <class Coder>
bool PaperHexahedra<Coder>::code_roof(Coder& symbols, const Plan& plan, const Corners& target,
                                      CellTopology& cell) {
  auto& v = cell.slots;
  v[4] = target[4];
  if (!code_reference(symbols, join_reference_, v[4])) return false;
  scratch_.clear();
  std::uint32_t index = 0;
  for (FaceCorner corner = surface_.vertex(v[4]).first_face; corner != kNone;
       corner = surface_.next_around(corner)) {
    if (corner / 4 == plan.far_face) index = static_cast<std::uint32_t>(scratch_.size());
    scratch_.emplace_back(corner, 0);
  }
  if (scratch_.empty()) return false;
  index = code_choice(symbols, roof_face_, static_cast<std::uint32_t>(scratch_.size()), index);
  const FaceCorner corner = scratch_[index].first;
  const bool turned = symbols.bit(roof_turned_, surface_.around(corner, 1) == target[5]);
  for (std::uint32_t i = 1; i < 4; ++i) v[4 + i] = surface_.around(corner, turned ? i : 4 - i);
  return true;
}

// --- coding of single vertices

template <class Coder>
std::uint32_t PaperHexahedra<Coder>::add_vertex(CellTopology& cell, std::uint32_t position) {
  cell.new_positions.push_back(position);
  return cell.slots[position] = surface_.add_vertex();
}

/// Encoder: returns the first corner that is coded before corner `position` and has the same
/// vertex. Returns 8 if no such corner exists. Only in a START can two corners have the same
/// vertex.
template <class Coder>
std::uint32_t PaperHexahedra<Coder>::earlier_corner(const StoredCell& stored,
                                                    std::uint32_t position) {
  for (std::uint32_t i : kCornerOrder) {
    if (i == position) break;
    if (stored.numbers[i] == stored.numbers[position]) return i;
  }
  return 8;
}

template <class Coder>
bool PaperHexahedra<Coder>::code_corner(Coder& symbols, const Corners& target, CellTopology& cell,
                                        std::uint32_t position, std::uint32_t repeats) {
  auto& model = corner_new_[operation_][position][last_new_];
  const bool is_new = symbols.bit(model, target[position] == kNone && repeats == 8);
  last_new_ = is_new;
  if (is_new) {
    add_vertex(cell, position);
    return true;
  }
  if (operation_ == kStart && symbols.bit(corner_repeated_[position], repeats != 8)) {
    cell.slots[position] = cell.slots[code_tree(symbols, repeated_corner_, repeats & 7)];
    return cell.slots[position] != kNone;
  }
  std::uint32_t slot = target[position];
  if (!code_reference(symbols, join_reference_, slot)) return false;
  cell.slots[position] = slot;
  return true;
}

template <class Coder>
bool PaperHexahedra<Coder>::code_reference(Coder& symbols, ReferenceModel& model,
                                           std::uint32_t& slot) {
  std::uint64_t id = 0;
  bool near = false;
  const std::uint64_t oldest = surface_.oldest_id();
  if constexpr (!Coder::kDecodes) {
    id = surface_.vertex(slot).id;
    near = (id > model.last ? id - model.last : model.last - id) <= id - oldest;
  }
  if (symbols.bit(model.from_last, near)) {
    id = model.last + static_cast<std::uint64_t>(code_signed(
                          symbols, model.step, static_cast<std::int64_t>(id - model.last)));
  } else {
    id = oldest + code_number(symbols, model.age, id - oldest);
  }
  model.last = id;
  slot = surface_.slot_of(id);
  return slot != kNone;
}

// --- corner order and surface

template <class Coder>
bool PaperHexahedra<Coder>::code_corner_order(Coder& corner_order, const Gate& gate,
                                              CellTopology& cell, std::uint32_t rotation) {
  // Predicted rotation: the rotation whose axes continue the axes of the hexahedron that owns the
  // gate.
  std::uint32_t expected = kRotationCount;
  if (!gate.mirrored) {
    const auto& owner = surface_.face(gate.at / 4).owner_corner;
    const auto bits = [&](std::uint32_t i) {
      return std::uint32_t{kCornerBits[owner[(gate.at + i) % 4]]};
    };
    const std::uint32_t across = 7u & ~((bits(0) ^ bits(1)) | (bits(0) ^ bits(3)));
    if (std::popcount(across) == 1)
      expected = rotation_of(kCornerBits[bits(0) ^ across], kCornerBits[bits(1) ^ across],
                             kCornerBits[bits(3) ^ across]);
  }
  if (expected != kRotationCount) {
    const bool hit = corner_order.bit(rotation_hit_[rotation_history_], rotation == expected);
    rotation_history_ = (rotation_history_ << 1 | (hit ? 1u : 0u)) & 3;
    if (hit)
      rotation = expected;
    else
      expected = kRotationCount;
  }
  if (expected == kRotationCount) rotation = code_tree(corner_order, rotation_, rotation);
  if (rotation >= kRotationCount) return false;
  cell.stored_corner = kRotations[rotation];
  return true;
}

/// Removes the faces that the hexahedron shares with the surface, and adds its other faces.
template <class Coder>
void PaperHexahedra<Coder>::attach(CellTopology& cell, bool order_matters) {
  cell.cell_slot = surface_.begin_cell();
  Corners v{};
  std::copy_n(cell.slots.begin(), 8, v.begin());
  const bool distinct = all_different(v);
  std::array<std::uint32_t, 6> present{};
  for (std::uint32_t k = 0; k < 6; ++k) {
    const auto& c = kFaceCorners[k];
    const Quad quad = {v[c[0]], v[c[1]], v[c[2]], v[c[3]]};
    present[k] = distinct || all_different(quad)
                     ? surface_.find_face(quad[0], quad[1], quad[2], quad[3])
                     : kNone;
    if (present[k] == kNone) continue;
    cell.face_mask |= static_cast<std::uint8_t>(face_bit(k));
  }
  previous_face_.fill(kNone);
  for (std::uint32_t k = 0; k < 6; ++k) {
    const auto& c = kFaceCorners[k];
    const Quad quad = {v[c[0]], v[c[1]], v[c[2]], v[c[3]]};
    if (!distinct && !all_different(quad)) continue;
    // If corners are repeated, two faces of the hexahedron may be identical, and the first of them
    // has already been added or removed. So search for the face again.
    const std::uint32_t now =
        distinct ? present[k] : surface_.find_face(quad[0], quad[1], quad[2], quad[3]);
    if (now != kNone) {
      for (std::uint32_t& face : previous_face_)
        if (face == now) face = kNone;  // the slot of the removed face may be reused
      surface_.remove_face(now);
    } else if (std::all_of(quad.begin(), quad.end(), [&](std::uint32_t vertex) {
                 return surface_.vertex(vertex).face_count < kMaxFacesAtVertex;
               })) {
      // Number the corners in the same order as a reader does. If the corner order matters, this is
      // the stored order. Otherwise, it is the order in which this coder arranges them (positions 0
      // to 7).
      const auto stored = [&](std::uint8_t i) { return order_matters ? cell.stored_corner[i] : i; };
      previous_face_[k] =
          surface_.add_face(quad, {stored(c[0]), stored(c[1]), stored(c[2]), stored(c[3])},
                            static_cast<std::uint8_t>(k));
    }
  }
  previous_ = v;
  for (std::size_t i = 0; i < 8; ++i) previous_id_[i] = surface_.vertex(v[i]).id;
  previous_cell_ = cell.cell_slot;
  has_previous_ = true;
}

template class PaperHexahedra<RangeEncoder>;
template class PaperHexahedra<RangeDecoder>;

}  // namespace shm
