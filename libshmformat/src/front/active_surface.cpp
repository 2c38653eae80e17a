#include "front/active_surface.h"

namespace shm {
namespace {

template <class T>
std::uint32_t take_slot(std::vector<T>& slots, std::vector<std::uint32_t>& free) {
  if (free.empty()) {
    slots.emplace_back();
    return static_cast<std::uint32_t>(slots.size() - 1);
  }
  const std::uint32_t slot = free.back();
  free.pop_back();
  return slot;
}

}  // namespace

std::uint32_t ActiveSurface::add_vertex() {
  const std::uint32_t slot = take_slot(vertices_, free_vertices_);
  Vertex& vertex = vertices_[slot];
  vertex = Vertex{};
  vertex.id = next_id_++;
  vertex.alive = true;
  vertex.older = youngest_;
  (youngest_ == kNone ? oldest_ : vertices_[youngest_].younger) = slot;
  youngest_ = slot;
  slots_.insert(vertex.id, slot);
  return slot;
}

void ActiveSurface::finalize(std::uint32_t slot) {
  Vertex& vertex = vertices_[slot];
  while (vertex.first_face != kNone) remove_face(vertex.first_face / 4);
  (vertex.older == kNone ? oldest_ : vertices_[vertex.older].younger) = vertex.younger;
  (vertex.younger == kNone ? youngest_ : vertices_[vertex.younger].older) = vertex.older;
  slots_.erase(vertex.id);
  vertex.alive = false;
  free_vertices_.push_back(slot);
}

std::uint32_t ActiveSurface::begin_cell() {
  current_cell_ = take_slot(cell_faces_, free_cells_);
  cell_faces_[current_cell_] = 0;
  return current_cell_;
}

void ActiveSurface::end_cell() {
  if (cell_faces_[current_cell_] == 0) free_cells_.push_back(current_cell_);
  current_cell_ = kNone;
}

std::uint32_t ActiveSurface::add_face(const Quad& quad,
                                      const std::array<std::uint8_t, 4>& owner_corner) {
  const std::uint32_t slot = take_slot(faces_, free_faces_);
  Face& face = faces_[slot];
  face.quad = quad;
  face.owner_corner = owner_corner;
  face.cell = current_cell_;
  face.alive = true;
  ++cell_faces_[current_cell_];
  for (std::uint32_t i = 0; i < 4; ++i) {
    Vertex& vertex = vertices_[quad[i]];
    face.next[i] = vertex.first_face;
    vertex.first_face = slot * 4 + i;
    ++vertex.face_count;
  }
  return slot;
}

void ActiveSurface::unlink(FaceCorner at) {
  Vertex& vertex = vertices_[faces_[at / 4].quad[at % 4]];
  FaceCorner* link = &vertex.first_face;
  while (*link != at) link = &faces_[*link / 4].next[*link % 4];
  *link = faces_[at / 4].next[at % 4];
  --vertex.face_count;
}

void ActiveSurface::remove_face(std::uint32_t slot) {
  for (std::uint32_t i = 0; i < 4; ++i) unlink(slot * 4 + i);
  faces_[slot].alive = false;
  free_faces_.push_back(slot);
  const std::uint32_t owner = faces_[slot].cell;
  if (--cell_faces_[owner] == 0 && owner != current_cell_) free_cells_.push_back(owner);
}

std::uint32_t ActiveSurface::find_face(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                       std::uint32_t d) const {
  for (FaceCorner at = vertices_[a].first_face; at != kNone; at = next_around(at)) {
    if (around(at, 2) != c) continue;
    const std::uint32_t after = around(at, 1), before = around(at, 3);
    if ((after == b && before == d) || (after == d && before == b)) return at / 4;
  }
  return kNone;
}

FaceCorner ActiveSurface::find_path(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  for (FaceCorner at = vertices_[b].first_face; at != kNone; at = next_around(at)) {
    const std::uint32_t after = around(at, 1), before = around(at, 3);
    if ((after == a && before == c) || (after == c && before == a)) return at;
  }
  return kNone;
}

}  // namespace shm
