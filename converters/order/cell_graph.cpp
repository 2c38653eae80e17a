#include "order/cell_graph.h"

#include <algorithm>
#include <cstring>

#include "base/external_sorter.h"
#include "mesh/cell_keys.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kNoFace = 6;

// For two adjacent faces f and g, kEdgeBetween[f][g] contains the two corners of their common edge.
// If f and g do not share exactly one edge, the entry is not used.
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

// For each corner of a hexahedron, a bit set of its faces: bit f is set if the corner is on face f.
constexpr auto kFacesOfCorner = [] {
  std::array<std::uint8_t, 8> table{};
  for (std::size_t f = 0; f < 6; ++f)
    for (const std::uint8_t c : kFacesByDirection[f])
      table[c] = static_cast<std::uint8_t>(table[c] | 1u << f);
  return table;
}();

bool all_different(const std::array<std::uint32_t, 4>& v) {
  return v[0] != v[1] && v[0] != v[2] && v[0] != v[3] && v[1] != v[2] && v[1] != v[3] &&
         v[2] != v[3];
}

// Returns the face of a hexahedron that contains the edge between the vertices `a` and `b`, but is
// neither the face `not_this` nor the face opposite it.
std::uint32_t face_at_edge(const std::array<std::uint32_t, 8>& corners, std::uint32_t a,
                           std::uint32_t b, std::uint32_t not_this) {
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

}  // namespace

CellGraph::CellGraph(const Cells& cells, const Progress& progress, Spool* spool,
                     std::size_t sort_bytes)
    : cells_(&cells), neighbours_(spool, 6 * std::uint64_t{cells.size()}) {
  if (spool != nullptr) {
    join_sorted(*spool, sort_bytes, progress);
    return;
  }
  // Each pass matches only the faces whose lowest vertex number is in one range (slice), so that
  // the table of faces stays small.
  constexpr std::uint64_t kSliceCells = 1 << 18, kMostSlices = 8;
  const std::uint64_t slices =
      std::clamp<std::uint64_t>(cells.size() / kSliceCells, 1, kMostSlices);
  for (std::uint64_t slice = 0; slice < slices; ++slice) {
    if (progress) progress("joining faces", slice, slices);
    join_slice(cells.vertices() * slice / slices, cells.vertices() * (slice + 1) / slices);
  }
}

// Calls visit(lowest vertex, Candidate) for each face of a hexahedron that has four distinct
// vertices.
template <class Visit>
void CellGraph::for_each_face(Visit&& visit) const {
  for (std::uint32_t cell = 0; cell < cells_->size(); ++cell) {
    if (!cells_->is_hexahedron(cell)) continue;
    const auto corners = cells_->hexahedron(cell);
    for (std::uint32_t face = 0; face < 6; ++face) {
      std::array<std::uint32_t, 4> v{};
      for (std::size_t i = 0; i < 4; ++i) v[i] = corners[kFacesByDirection[face][i]];
      if (!all_different(v)) continue;
      const auto lowest =
          static_cast<std::size_t>(std::min_element(v.begin(), v.end()) - v.begin());
      const auto [low, high] = std::minmax({v[(lowest + 1) % 4], v[(lowest + 3) % 4]});
      visit(v[lowest], Candidate{v[(lowest + 2) % 4], low, high, CellFace(cell, face)});
    }
  }
}

// Finds faces with the same four vertices among the faces whose lowest vertex is in [begin, end),
// and makes their cells neighbours.
void CellGraph::join_slice(std::uint64_t begin, std::uint64_t end) {
  // Bucket sort by lowest vertex: first count the faces, then distribute them.
  std::vector<std::uint32_t> end_of(end - begin + 1, 0);
  for_each_face([&](std::uint32_t lowest, const Candidate&) {
    if (lowest >= begin && lowest < end) ++end_of[lowest - begin + 1];
  });
  for (std::size_t v = 1; v < end_of.size(); ++v) end_of[v] += end_of[v - 1];
  std::vector<Candidate> faces(end_of.back());
  for_each_face([&](std::uint32_t lowest, const Candidate& face) {
    if (lowest >= begin && lowest < end) faces[end_of[lowest - begin]++] = face;
  });
  std::uint32_t first = 0;
  for (std::uint64_t v = 0; v < end - begin; first = end_of[v++])
    join(std::span(faces).subspan(first, end_of[v] - first));
}

// Finds all faces with the same four vertices and makes their cells neighbours, as join_slice()
// does for some of the faces. Uses an external sort, which needs a bounded amount of memory.
void CellGraph::join_sorted(const Spool& spool, std::size_t sort_bytes, const Progress& progress) {
  ExternalSorter sorted(spool.directory(), sizeof(Candidate), sort_bytes);
  if (progress) progress("joining faces", 0, 2);
  for_each_face([&](std::uint32_t lowest, const Candidate& face) {
    // Only faces with the same sort key are compared with each other. The key contains a hash, so
    // that few faces have the same key even if very many faces have the same lowest vertex.
    const std::uint64_t hash = hash_of(0, face.others()) >> 32;
    sorted.add(std::uint64_t{lowest} << 32 | hash, reinterpret_cast<const std::byte*>(&face));
  });
  if (progress) progress("joining faces", 1, 2);
  std::vector<Candidate> faces;
  std::uint64_t key = 0, before = 0;
  for (const std::byte* record; sorted.next(key, record); before = key) {
    if (key != before) {
      join(faces);
      faces.clear();
    }
    std::memcpy(&faces.emplace_back(), record, sizeof(Candidate));
  }
  join(faces);
}

// Finds faces with the same four vertices in `faces`, and makes their cells neighbours. All of
// `faces` must have the same lowest vertex.
void CellGraph::join(std::span<Candidate> faces) {
  constexpr std::size_t kManyFaces = 64;
  if (faces.size() > kManyFaces) return join_many(faces);
  std::array<CellFace, kManyFaces> same;
  std::uint64_t done = 0;
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (done >> i & 1) continue;
    std::size_t count = 0;
    same[count++] = faces[i].face;
    for (std::size_t j = i + 1; j < faces.size(); ++j) {
      if (faces[i].others() != faces[j].others()) continue;
      same[count++] = faces[j].face;
      done |= std::uint64_t{1} << j;
    }
    join_same(std::span(same).first(count));
  }
}

// Does the same as join(), but in O(n log n) time, for long lists of faces. A list may have any
// length, because any number of faces may have the same lowest vertex.
void CellGraph::join_many(std::span<Candidate> faces) {
  std::stable_sort(faces.begin(), faces.end(),
                   [](const Candidate& a, const Candidate& b) { return a.others() < b.others(); });
  std::vector<CellFace> same;
  for (std::size_t i = 0; i < faces.size();) {
    same.clear();
    const std::size_t first = i;
    while (i < faces.size() && faces[i].others() == faces[first].others())
      same.push_back(faces[i++].face);
    join_same(same);
  }
}

// `faces` are the occurrences of one face in several cells. Divides these cells into pairs, in the
// mesh's order of cells, and makes the two cells of each pair neighbours.
void CellGraph::join_same(std::span<CellFace> faces) {
  if (faces.size() < 2) return;
  if (faces.size() > 2)
    std::sort(faces.begin(), faces.end(), [&](CellFace a, CellFace b) {
      const std::uint32_t cell_a = cells_->number_of(a.cell()),
                          cell_b = cells_->number_of(b.cell());
      return cell_a != cell_b ? cell_a < cell_b : a.face() < b.face();
    });
  for (std::size_t i = 0; i < faces.size(); ++i) {
    if (neighbour(faces[i])) continue;
    for (std::size_t j = i + 1; j < faces.size(); ++j) {
      if (faces[i].cell() == faces[j].cell() || neighbour(faces[j])) continue;
      set_neighbour(faces[i], faces[j]);
      set_neighbour(faces[j], faces[i]);
      break;
    }
  }
}

void CellGraph::cut_between_blocks() {
  for (std::uint32_t cell = 0; cell < cells_->size(); ++cell)
    for (std::uint32_t face = 0; face < 6; ++face) {
      const CellFace to = across(cell, face);
      if (to && cells_->block(to.cell()) != cells_->block(cell))
        set_neighbour(CellFace(cell, face), {});
    }
}

int CellGraph::degree(std::uint32_t cell) const {
  int count = 0;
  for (std::uint32_t face = 0; face < 6; ++face) count += across(cell, face) ? 1 : 0;
  return count;
}

Frame CellGraph::carried(std::uint32_t cell, const Frame& frame, std::uint32_t face,
                         CellFace to) const {
  Frame result{};
  const auto corners = cells_->hexahedron(cell), corners_there = cells_->hexahedron(to.cell());
  // Bit a is set if one of the directions found so far is along axis a of the neighbour.
  std::uint32_t used = 0;
  std::array<bool, 3> known{};
  for (std::size_t a = 0; a < 3; ++a) {
    std::uint32_t there;
    if (frame[a] >> 1 == face >> 1) {
      there = frame[a] == face ? to.face() ^ 1 : to.face();
    } else {
      const auto& edge = kEdgeBetween[face][frame[a]];
      there = face_at_edge(corners_there, corners[edge[0]], corners[edge[1]], to.face());
    }
    if (there == kNoFace || used >> (there >> 1) & 1) continue;
    result[a] = static_cast<std::uint8_t>(there);
    used |= 1u << (there >> 1);
    known[a] = true;
  }
  // In a collapsed hexahedron, a direction may be undetermined. Such a direction is set along an
  // axis of the neighbour that no other direction uses.
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
