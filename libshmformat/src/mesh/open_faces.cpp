#include "mesh/open_faces.h"

#include <algorithm>

#include "base/lists.h"

namespace shm {

OpenFaces::Vertex& OpenFaces::vertex_at(std::uint32_t slot) { return at_slot(vertices_, slot); }

std::uint32_t OpenFaces::new_cell() {
  std::uint32_t place = static_cast<std::uint32_t>(cells_.size());
  if (resting_.size() > kResting) {
    place = resting_.front();
    resting_.pop_front();
    by_number_.erase(cells_[place].number);
  } else {
    cells_.emplace_back();
  }
  cells_[place] = Cell{};
  cells_[place].number = next_number_++;
  by_number_.insert(cells_[place].number, place);
  return place;
}

void OpenFaces::add_cell(const CellSides& sides, std::span<const std::uint32_t> corners) {
  current_ = new_cell();
  Cell& cell = cells_[current_];
  cell.size = static_cast<std::uint32_t>(std::min<std::size_t>(corners.size(), kMost));
  std::copy_n(corners.begin(), cell.size, cell.node.begin());
  behind_.fill(kNever);
  std::array<std::uint32_t, 4> cycle{};
  std::uint32_t k = 0;
  for (const ShapeFace& side : sides.sides) {
    bool differ = true;
    for (std::uint32_t i = 0; i < side.size; ++i) {
      cycle[i] = corners[side.at[i]];
      for (std::uint32_t j = 0; j < i; ++j) differ &= cycle[i] != cycle[j];
    }
    if (differ) add_side(k, std::span<const std::uint32_t>(cycle).first(side.size), sides);
    ++k;
  }
  if (cells_[current_].open == 0) resting_.push_back(current_);
  current_ = kNone;
}

void OpenFaces::add_side(std::uint32_t side, std::span<const std::uint32_t> cycle,
                         const CellSides& sides) {
  const std::uint32_t found = find(cycle);
  if (found != kNone && side < kMost) behind_[side] = number_of(faces_[found]);
  if (!sides.opens) return;
  const bool itself = sides.flat && cycle.size() > 2;
  if (found == kNone)
    add_face(cycle, current_, itself);
  else if (!itself)
    remove_face(found);
  else if (!faces_[found].flat)
    cover(found);
}

void OpenFaces::add_face(std::span<const std::uint32_t> cycle, std::uint32_t cell, bool flat) {
  for (std::uint32_t v : cycle) {
    const Vertex& vertex = vertex_at(v);
    if (vertex.faces + vertex.edges >= static_cast<int>(kMostAtVertex)) return;
  }
  std::uint32_t slot = static_cast<std::uint32_t>(faces_.size());
  if (free_faces_.empty()) {
    faces_.emplace_back();
  } else {
    slot = free_faces_.back();
    free_faces_.pop_back();
  }
  Face& face = faces_[slot];
  face = Face{};
  face.size = static_cast<std::uint8_t>(cycle.size());
  face.cell = cell;
  face.flat = flat;
  ++cells_[cell].open;
  for (std::uint32_t i = 0; i < face.size; ++i) {
    Vertex& vertex = vertices_[cycle[i]];
    face.node[i] = cycle[i];
    face.next[i] = vertex.first;
    face.previous[i] = kNone;
    if (vertex.first != kNone) faces_[vertex.first / 4].previous[vertex.first % 4] = slot * 4 + i;
    vertex.first = slot * 4 + i;
    if (face.size == 2) {
      ++vertex.edges;
    } else {
      ++vertex.faces;
      ++vertex.bare;
    }
  }
}

void OpenFaces::cover(std::uint32_t slot) {
  Face& face = faces_[slot];
  if (face.covered) return;
  face.covered = true;
  for (std::uint32_t i = 0; i < face.size; ++i) --vertices_[face.node[i]].bare;
}

void OpenFaces::remove_face(std::uint32_t slot) {
  Face& face = faces_[slot];
  for (std::uint32_t i = 0; i < face.size; ++i) {
    Vertex& vertex = vertices_[face.node[i]];
    const std::uint32_t next = face.next[i], previous = face.previous[i];
    if (next != kNone) faces_[next / 4].previous[next % 4] = previous;
    (previous == kNone ? vertex.first : faces_[previous / 4].next[previous % 4]) = next;
    if (face.size == 2) {
      --vertex.edges;
    } else {
      --vertex.faces;
      vertex.bare = static_cast<std::uint8_t>(vertex.bare - (face.covered ? 0 : 1));
    }
  }
  face.size = 0;
  free_faces_.push_back(slot);
  if (--cells_[face.cell].open == 0 && face.cell != current_) resting_.push_back(face.cell);
}

void OpenFaces::forget(std::uint32_t slot) {
  if (slot >= vertices_.size()) return;
  while (vertices_[slot].first != kNone) remove_face(vertices_[slot].first / 4);
}

std::uint32_t OpenFaces::find(std::span<const std::uint32_t> cycle) const {
  if (cycle[0] >= vertices_.size()) return kNone;
  const std::size_t n = cycle.size();
  for (std::uint32_t corner = vertices_[cycle[0]].first; corner != kNone;
       corner = faces_[corner / 4].next[corner % 4]) {
    const Face& face = faces_[corner / 4];
    if (face.size != n) continue;
    const std::uint32_t place = corner % 4;
    bool along = true, against = true;
    for (std::size_t i = 1; i < n; ++i) {
      along &= face.node[(place + i) % n] == cycle[i];
      against &= face.node[(place + n - i) % n] == cycle[i];
    }
    if (along || against) return corner / 4;
  }
  return kNone;
}

}  // namespace shm
