#include "mesh/polyhedron_surface.h"

#include <algorithm>

namespace shm {

void PolyhedronSurface::add_face(std::span<const std::uint32_t> cycle, std::uint64_t cell) {
  for (const std::uint32_t slot : cycle)
    if (at_slot(vertices_, slot).faces.size() == kMostFaces) return;
  std::uint32_t face = static_cast<std::uint32_t>(faces_.size());
  if (free_faces_.empty()) {
    faces_.emplace_back();
  } else {
    face = free_faces_.back();
    free_faces_.pop_back();
  }
  faces_[face].cycle.assign(cycle.begin(), cycle.end());
  faces_[face].cell = cell;
  for (std::uint32_t i = 0; i < cycle.size(); ++i) vertices_[cycle[i]].faces.push_back({face, i});
}

void PolyhedronSurface::remove_face(std::uint32_t face) {
  for (const std::uint32_t slot : faces_[face].cycle)
    std::erase_if(vertices_[slot].faces, [&](const Place& place) { return place.face == face; });
  let_go(faces_[face].cycle);
  free_faces_.push_back(face);
}

std::uint32_t PolyhedronSurface::find(std::span<const std::uint32_t> cycle) const {
  const std::size_t n = cycle.size();
  const auto places = faces_at(cycle[0]);
  for (std::size_t k = places.size(); k-- > 0;) {
    const auto& other = faces_[places[k].face].cycle;
    if (other.size() != n) continue;
    bool along = true, against = true;
    for (std::size_t i = 1; i < n && (along || against); ++i) {
      along = along && other[(places[k].at + i) % n] == cycle[i];
      against = against && other[(places[k].at + n - i) % n] == cycle[i];
    }
    if (along || against) return places[k].face;
  }
  return kNone;
}

void PolyhedronSurface::add_edge(std::uint32_t a, std::uint32_t b) {
  make_room(vertices_, std::max(a, b));
  const auto find = [&](std::uint32_t from, std::uint32_t to) {
    auto& edges = vertices_[from].edges;
    return std::find_if(edges.begin(), edges.end(),
                        [&](const Edge& edge) { return edge.to == to; });
  };
  if (const auto there = find(a, b); there != vertices_[a].edges.end()) {
    there->cells = std::min(there->cells + 1, kMostCells);
    find(b, a)->cells = there->cells;
  } else if (vertices_[a].edges.size() < kMostEdges && vertices_[b].edges.size() < kMostEdges) {
    vertices_[a].edges.push_back({b, 1});
    vertices_[b].edges.push_back({a, 1});
  }
}

std::uint32_t PolyhedronSurface::cells_at(std::uint32_t a, std::uint32_t b) const {
  for (const Edge& edge : edges_at(a))
    if (edge.to == b) return edge.cells;
  return 0;
}

void PolyhedronSurface::forget(std::uint32_t slot) {
  if (slot >= vertices_.size()) return;
  while (!vertices_[slot].faces.empty()) remove_face(vertices_[slot].faces.back().face);
  for (const Edge& edge : vertices_[slot].edges)
    std::erase_if(vertices_[edge.to].edges, [&](const Edge& other) { return other.to == slot; });
  vertices_[slot].edges.clear();
}

}  // namespace shm
