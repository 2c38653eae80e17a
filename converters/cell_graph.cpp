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

bool all_different(const std::array<std::uint32_t, 4>& v) {
  return v[0] != v[1] && v[0] != v[2] && v[0] != v[3] && v[1] != v[2] && v[1] != v[3] &&
         v[2] != v[3];
}

// Tells faces with the same lowest vertex apart, nearly always: the vertex diagonally opposite, and
// a hash of the other two.
std::uint64_t key_of(const std::array<std::uint32_t, 4>& v, std::size_t lowest) {
  const std::uint64_t a = v[(lowest + 1) % 4], b = v[(lowest + 3) % 4];
  const std::uint64_t both = (a + b) * 0x9e3779b97f4a7c15u ^ (a * b) * 0xff51afd7ed558ccdu;
  return std::uint64_t{v[(lowest + 2) % 4]} << 32 | both >> 32;
}

// Calls visit(face, lowest vertex, key) for the faces of four different vertices whose lowest one
// is in [begin, end).
template <class Visit>
void for_each_face(const CellTable& cells, std::uint64_t begin, std::uint64_t end, Visit&& visit) {
  for (std::uint32_t cell = 0; cell < cells.size(); ++cell) {
    if (!cells.is_hexahedron(cell)) continue;
    for (std::uint32_t face = 0; face < 6; ++face) {
      const CellFace at(cell, face);
      const auto v = vertices_of(cells, at);
      const auto lowest =
          static_cast<std::size_t>(std::min_element(v.begin(), v.end()) - v.begin());
      if (v[lowest] < begin || v[lowest] >= end || !all_different(v)) continue;
      visit(at, v[lowest], key_of(v, lowest));
    }
  }
}

}  // namespace

CellGraph::CellGraph(const CellTable& cells, const Progress& progress)
    : cells_(&cells), neighbours_(6 * std::uint64_t{cells.size()}) {
  // In slices of vertices, so that what is looked for at once stays small.
  constexpr std::uint64_t kSliceCells = 1 << 18, kMostSlices = 8;
  const std::uint64_t slices =
      std::clamp<std::uint64_t>(cells.size() / kSliceCells, 1, kMostSlices);
  for (std::uint64_t slice = 0; slice < slices; ++slice) {
    if (progress) progress("joining faces", slice, slices);
    join_slice(cells.vertices() * slice / slices, cells.vertices() * (slice + 1) / slices);
  }
}

// Faces whose lowest vertex is in [begin, end).
void CellGraph::join_slice(std::uint64_t begin, std::uint64_t end) {
  // By that vertex: counted, then dealt out.
  std::vector<std::uint32_t> end_of(end - begin + 1, 0);
  for_each_face(*cells_, begin, end, [&](CellFace, std::uint32_t lowest, std::uint64_t) {
    ++end_of[lowest - begin + 1];
  });
  for (std::size_t v = 1; v < end_of.size(); ++v) end_of[v] += end_of[v - 1];
  std::vector<Candidate> faces(end_of.back());
  for_each_face(*cells_, begin, end, [&](CellFace face, std::uint32_t lowest, std::uint64_t key) {
    faces[end_of[lowest - begin]++] = {static_cast<std::uint32_t>(key >> 32),
                                       static_cast<std::uint32_t>(key), face};
  });
  std::uint32_t first = 0;
  for (std::uint64_t v = 0; v < end - begin; first = end_of[v++])
    join(std::span(faces).subspan(first, end_of[v] - first));
}

// Joins faces that are the same, two by two, the first with the second. Should two different ones
// have the same key, orders suffer a little, and nothing else.
void CellGraph::join(std::span<const Candidate> faces) {
  constexpr std::size_t kManyFaces = 64;
  if (faces.size() > kManyFaces) return join_many(faces);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    const Candidate& a = faces[i];
    for (std::size_t j = i + 1; j < faces.size(); ++j) {
      const Candidate& b = faces[j];
      if (a.opposite != b.opposite || a.others != b.others || a.face.cell() == b.face.cell() ||
          neighbour(b.face))
        continue;
      if (neighbour(a.face)) break;
      neighbour(a.face) = b.face;
      neighbour(b.face) = a.face;
      break;
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
