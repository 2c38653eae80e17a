#include "mesh/active_surface.h"

#include <algorithm>

namespace shm {
namespace {

constexpr std::array<std::uint32_t, 4> kNoMates = {kNone, kNone, kNone, kNone};

}  // namespace

void ActiveSurface::sweep_introduced() {
  std::erase_if(introduced_, [&](const Introduced& entry) { return !alive(entry); });
  oldest_ = 0;
}

std::uint32_t ActiveSurface::slot_of(std::uint64_t id) const {
  const auto found = std::lower_bound(
      introduced_.begin(), introduced_.end(), id,
      [](const Introduced& entry, std::uint64_t wanted) { return entry.id < wanted; });
  return found != introduced_.end() && found->id == id && alive(*found) ? found->slot : kNone;
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
                                      const std::array<std::uint8_t, 4>& owner_corner,
                                      std::uint8_t side) {
  const std::uint32_t slot = take_slot(faces_, free_faces_);
  Face& face = faces_[slot];
  face.quad = quad;
  face.mate = kNoMates;
  face.fan = {};
  face.owner_corner = owner_corner;
  face.cell = current_cell_;
  face.side = side;
  face.alive = true;
  ++cell_faces_[current_cell_];
  for (std::uint32_t i = 0; i < 4; ++i) {
    Vertex& vertex = vertices_[quad[i]];
    const FaceCorner here = slot * 4 + i;
    face.next[i] = vertex.first_face;
    face.previous[i] = kNone;
    if (vertex.first_face != kNone)
      faces_[vertex.first_face / 4].previous[vertex.first_face % 4] = here;
    vertex.first_face = here;
    ++vertex.face_count;
  }
  return slot;
}

void ActiveSurface::join(FaceEdge a, FaceEdge b, std::uint32_t fan) {
  const auto size = static_cast<std::uint8_t>(std::min(fan, 255u));
  if (a != kNone) {
    faces_[a / 4].mate[a % 4] = b;
    faces_[a / 4].fan[a % 4] = size;
  }
  if (b != kNone) {
    faces_[b / 4].mate[b % 4] = a;
    faces_[b / 4].fan[b % 4] = size;
  }
}

void ActiveSurface::unlink(FaceCorner corner) {
  Vertex& vertex = vertices_[faces_[corner / 4].quad[corner % 4]];
  const FaceCorner next = faces_[corner / 4].next[corner % 4];
  const FaceCorner previous = faces_[corner / 4].previous[corner % 4];
  if (next != kNone) faces_[next / 4].previous[next % 4] = previous;
  (previous == kNone ? vertex.first_face : faces_[previous / 4].next[previous % 4]) = next;
  --vertex.face_count;
}

void ActiveSurface::remove_face(std::uint32_t slot) {
  Face& face = faces_[slot];
  for (std::uint32_t i = 0; i < 4; ++i) {
    unlink(slot * 4 + i);
    const FaceEdge mate = face.mate[i];
    if (mate != kNone && faces_[mate / 4].mate[mate % 4] == slot * 4 + i)
      faces_[mate / 4].mate[mate % 4] = kNone;
  }
  face.alive = false;
  ++removed_faces_;
  free_faces_.push_back(slot);
  const std::uint32_t owner = face.cell;
  if (--cell_faces_[owner] == 0 && owner != current_cell_) free_cells_.push_back(owner);
}

std::uint32_t ActiveSurface::find_face(std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                       std::uint32_t d) const {
  for (FaceCorner corner = vertices_[a].first_face; corner != kNone; corner = next_around(corner)) {
    if (around(corner, 2) != c) continue;
    const std::uint32_t after = around(corner, 1), before = around(corner, 3);
    if ((after == b && before == d) || (after == d && before == b)) return corner / 4;
  }
  return kNone;
}

FaceCorner ActiveSurface::find_path(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
  for (FaceCorner corner = vertices_[b].first_face; corner != kNone; corner = next_around(corner)) {
    const std::uint32_t after = around(corner, 1), before = around(corner, 3);
    if ((after == a && before == c) || (after == c && before == a)) return corner;
  }
  return kNone;
}

}  // namespace shm
