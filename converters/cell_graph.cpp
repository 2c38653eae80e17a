#include "cell_graph.h"

#include <algorithm>

namespace shm::converters {
namespace {

constexpr std::uint32_t kNoFace = 6;

// Corners shared by two adjacent faces: an edge; equal for opposite faces.
constexpr auto kEdgeBetween = [] {
  std::array<std::array<std::array<std::uint8_t, 2>, 6>, 6> table{};
  for (std::size_t f = 0; f < 6; ++f)
    for (std::size_t g = 0; g < 6; ++g) {
      std::size_t count = 0;
      for (const std::uint8_t a : kFacesByDirection[f])
        for (const std::uint8_t b : kFacesByDirection[g])
          if (a == b && count < 2) table[f][g][count++] = a;
    }
  return table;
}();

// Bit f: the corner stands at face f.
constexpr auto kFacesOfCorner = [] {
  std::array<std::uint8_t, 8> table{};
  for (std::size_t f = 0; f < 6; ++f)
    for (const std::uint8_t c : kFacesByDirection[f])
      table[c] = static_cast<std::uint8_t>(table[c] | 1u << f);
  return table;
}();

std::array<std::uint32_t, 4> vertices_of(const CellTable& cells, CellFace at) {
  const auto corners = cells.cell(at.cell());
  std::array<std::uint32_t, 4> vertices{};
  for (std::size_t i = 0; i < 4; ++i) vertices[i] = corners[kFacesByDirection[at.face()][i]];
  return vertices;
}

// What a face is found by: its lowest vertex, and the one diagonally opposite.
struct FaceKey {
  std::uint32_t lowest = 0, opposite = 0;
  bool proper = false;  // four different vertices
};

FaceKey key_of(const std::array<std::uint32_t, 4>& v) {
  const auto lowest = static_cast<std::size_t>(std::min_element(v.begin(), v.end()) - v.begin());
  FaceKey key{v[lowest], v[(lowest + 2) % 4], true};
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j) key.proper &= v[i] != v[j];
  return key;
}

// Calls visit(face, key) for the proper faces of all hexahedra.
template <class Visit>
void for_each_face(const CellTable& cells, Visit&& visit) {
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    if (!cells.is_hexahedron(cell)) continue;
    for (std::uint32_t face = 0; face < 6; ++face) {
      const CellFace at(cell, face);
      const FaceKey key = key_of(vertices_of(cells, at));
      if (key.proper) visit(at, key);
    }
  }
}

}  // namespace

CellGraph::CellGraph(const CellTable& cells, const Progress& progress)
    : cells_(&cells), neighbours_(6 * std::uint64_t{cells.size()}) {
  if (progress) progress("joining faces", 0, 2);
  // Faces by their lowest vertex: counted, then dealt out.
  std::vector<std::uint32_t> end_of(cells.vertices() + 1, 0);
  for_each_face(cells, [&](CellFace, const FaceKey& key) { ++end_of[key.lowest + 1]; });
  for (std::size_t v = 1; v < end_of.size(); ++v) end_of[v] += end_of[v - 1];
  std::vector<Candidate> faces(end_of.back());
  for_each_face(cells, [&](CellFace face, const FaceKey& key) {
    faces[end_of[key.lowest]++] = {key.opposite, face};
  });
  if (progress) progress("joining faces", 1, 2);
  std::uint32_t begin = 0;
  for (std::uint64_t v = 0; v < cells.vertices(); begin = end_of[v++])
    join(std::span(faces).subspan(begin, end_of[v] - begin));
}

// Joins faces that are the same, two by two, the first with the second.
void CellGraph::join(std::span<Candidate> faces) {
  constexpr std::size_t kManyFaces = 64;
  if (faces.size() > kManyFaces) return join_many(faces);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    CellFace& mine = neighbour(faces[i].face);
    for (std::size_t j = i + 1; j < faces.size() && !mine; ++j) {
      if (faces[i].opposite != faces[j].opposite) continue;
      CellFace& other = neighbour(faces[j].face);
      if (other || !same_face(faces[i].face, faces[j].face)) continue;
      mine = faces[j].face;
      other = faces[i].face;
    }
  }
}

// The same in a time that does not grow with the square: a vertex may have any number of faces.
void CellGraph::join_many(std::span<const Candidate> faces) {
  struct Entry {
    std::array<std::uint32_t, 4> vertices;
    CellFace face;
  };
  std::vector<Entry> sorted;
  for (const Candidate& candidate : faces) {
    sorted.push_back({vertices_of(*cells_, candidate.face), candidate.face});
    std::sort(sorted.back().vertices.begin(), sorted.back().vertices.end());
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Entry& a, const Entry& b) { return a.vertices < b.vertices; });
  for (std::size_t i = 0; i + 1 < sorted.size(); ++i) {
    const CellFace a = sorted[i].face, b = sorted[i + 1].face;
    if (sorted[i].vertices != sorted[i + 1].vertices || a.cell() == b.cell()) continue;
    neighbour(a) = b;
    neighbour(b) = a;
    ++i;
  }
}

// Of faces with the same lowest vertex and the same one opposite.
bool CellGraph::same_face(CellFace a, CellFace b) const {
  if (a.cell() == b.cell()) return false;
  auto mine = vertices_of(*cells_, a), others = vertices_of(*cells_, b);
  std::sort(mine.begin(), mine.end());
  std::sort(others.begin(), others.end());
  return mine == others;
}

void CellGraph::cut_between_blocks() {
  for (std::uint32_t cell = 0; cell < cells_->size(); ++cell)
    for (std::uint32_t face = 0; face < 6; ++face) {
      CellFace& to = neighbours_[6 * std::uint64_t{cell} + face];
      if (to && cells_->block(to.cell()) != cells_->block(cell)) to = {};
    }
}

int CellGraph::degree(std::uint32_t cell) const {
  int count = 0;
  for (std::uint32_t face = 0; face < 6; ++face) count += across(cell, face) ? 1 : 0;
  return count;
}

std::uint32_t CellGraph::face_at_edge(std::uint32_t cell, std::uint32_t a, std::uint32_t b,
                                      std::uint32_t not_this) const {
  const auto corners = cells_->cell(cell);
  std::uint32_t at_a = 0, at_b = 0;
  for (std::size_t c = 0; c < 8; ++c) {
    if (corners[c] == a) at_a |= kFacesOfCorner[c];
    if (corners[c] == b) at_b |= kFacesOfCorner[c];
  }
  const std::uint32_t both = at_a & at_b & ~(1u << not_this) & ~(1u << (not_this ^ 1));
  for (std::uint32_t face = 0; face < 6; ++face)
    if (both >> face & 1) return face;
  return kNoFace;
}

Frame CellGraph::carried(std::uint32_t cell, const Frame& frame, std::uint32_t face,
                         CellFace to) const {
  Frame result{};
  const auto corners = cells_->cell(cell);
  std::uint32_t used = 0;  // bit a: axis a of the neighbour
  std::array<bool, 3> known{};
  for (std::size_t a = 0; a < 3; ++a) {
    std::uint32_t there;
    if (frame[a] >> 1 == face >> 1) {
      there = frame[a] == face ? to.face() ^ 1 : to.face();
    } else {
      const auto& edge = kEdgeBetween[face][frame[a]];
      there = face_at_edge(to.cell(), corners[edge[0]], corners[edge[1]], to.face());
    }
    if (there == kNoFace || used >> (there >> 1) & 1) continue;
    result[a] = static_cast<std::uint8_t>(there);
    used |= 1u << (there >> 1);
    known[a] = true;
  }
  // Collapsed hexahedra may leave a direction open: any axis that is left.
  for (std::size_t a = 0; a < 3; ++a)
    for (std::uint32_t axis = 0; axis < 3 && !known[a]; ++axis) {
      if (used >> axis & 1) continue;
      result[a] = static_cast<std::uint8_t>(2 * axis + 1);
      used |= 1u << axis;
      known[a] = true;
    }
  return result;
}

}  // namespace shm::converters
