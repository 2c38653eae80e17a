#include "vtk/xml/cells.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <unordered_set>
#include <utility>

#include "base/failure.h"
#include "mesh/mesh_source.h"
#include "vtk/words.h"

namespace shm::converters::vtu {
namespace {

const std::byte* bytes_of(const std::vector<std::int64_t>& values) {
  return reinterpret_cast<const std::byte*>(values.data());
}

// Limit for the number of points in the faces of all polyhedra together: kMostFaceUses times the
// number of points in the array of faces, plus kFewFaceNodes. The faces of all polyhedra have more
// points than the array of faces if several polyhedra use the same face. A face usually belongs to
// two polyhedra, rarely to more.
constexpr std::uint64_t kMostFaceUses = 16, kFewFaceNodes = 1 << 20;

}  // namespace

std::vector<std::int64_t> first_uses(const std::vector<std::int64_t>& stream) {
  std::vector<std::int64_t> nodes;
  std::unordered_set<std::int64_t> seen;
  for (std::size_t position = 1; position < stream.size();) {
    const auto size = static_cast<std::size_t>(stream[position++]);
    for (std::size_t i = 0; i < size; ++i, ++position)
      if (seen.insert(stream[position]).second) nodes.push_back(stream[position]);
  }
  return nodes;
}

CellCollector::CellCollector(ArrayLoader& loader, Spool& spool)
    : loader_(loader),
      spool_(spool),
      offsets_(spool, sizeof(std::int64_t)),
      connectivity_(spool, sizeof(std::int64_t)),
      types_(spool, 1),
      streams_(spool, sizeof(std::int64_t)),
      stream_ends_(spool, sizeof(std::int64_t)) {
  offsets_.set<std::int64_t>(0, 0);
}

CellCollector::Column::Column(CellCollector& owner, Node& array, std::uint64_t most)
    : values(owner.spool_, sizeof(std::int64_t)) {
  owner.loader_.read_integers(array, most, [&](std::span<const std::int64_t> piece) {
    values.append(piece.size(), reinterpret_cast<const std::byte*>(piece.data()));
  });
}

// Returns the first array with this name in the Cells element. If the file has several time steps,
// there may be one array per step.
Node* CellCollector::find(Node& cells, std::string_view name) const {
  for (Node& each : cells.children)
    if (each.is_array() && each.attribute_or("Name", "") == name) return &each;
  return nullptr;
}

void CellCollector::add_piece(Node& cells, const PieceRange& piece) {
  Node* offsets = find(cells, kOffsets);
  Node* connectivity = find(cells, kConnectivity);
  Node* types = find(cells, kTypes);
  if (piece.cells > 0) {
    if (offsets == nullptr || connectivity == nullptr || types == nullptr)
      loader_.fail(ErrorCode::corrupt, cells, "lacks connectivity, offsets or types");
    const bool polyhedra = read_types(*types, piece);
    if (polyhedra || find(cells, kFaces) != nullptr || find(cells, kPolyhedronEnds) != nullptr) {
      read_with_faces(cells, *offsets, *connectivity, piece);
    } else {
      read_plain(*offsets, *connectivity, piece);
    }
  }
  mark_steps(cells);
  mark_rest(cells);
}

// Checks that the cells of later time steps equal the cells of the first step.
void CellCollector::mark_steps(Node& cells) {
  std::map<std::string, Node*> firsts;
  for (Node& each : cells.children) {
    if (!each.is_array()) continue;
    Node* first = firsts.try_emplace(each.attribute_or("Name", ""), &each).first->second;
    if (first == &each || first->values() == nullptr || first->values()->text.empty()) continue;
    if (!loader_.same_values(*first, each, spool_))
      loader_.fail(ErrorCode::unsupported, each,
                   "cells that change from step to step are not read");
    loader_.mark_like(each, first->values()->text);
  }
}

// Handles the arrays in the Cells element that have not been read. Arrays named offsets,
// connectivity or types are unread only if the piece has no cells; they have no values, and are
// only marked. All other arrays are kept as extras.
void CellCollector::mark_rest(Node& cells) {
  for (Node& each : cells.children) {
    if (!each.is_array()) continue;
    if (const Node* values = each.values(); values != nullptr && !values->text.empty()) continue;
    const std::string name = each.attribute_or("Name", "");
    if (name == kOffsets || name == kConnectivity || name == kTypes) {
      loader_.mark(each, name);
    } else {
      loader_.keep_as_extra(each, kNoLimit);
    }
  }
}

bool CellCollector::read_types(Node& types, const PieceRange& piece) {
  bool polyhedra = false;
  std::vector<std::byte> narrow;
  const std::uint64_t found =
      loader_.read_integers(types, piece.cells, [&](std::span<const std::int64_t> values) {
        narrow.clear();
        for (const std::int64_t value : values) {
          if (value < 0 || value > 255)
            loader_.fail(ErrorCode::corrupt, types,
                         "the cell type " + std::to_string(value) + " is unknown");
          polyhedra |= value == vtk::kPolyhedron;
          narrow.push_back(static_cast<std::byte>(value));
        }
        types_.append(narrow.size(), narrow.data());
      });
  if (found != piece.cells)
    loader_.fail(
        ErrorCode::truncated, types,
        "has " + std::to_string(found) + " types for " + std::to_string(piece.cells) + " cells");
  loader_.mark(types, std::string(kTypes));
  return polyhedra;
}

void CellCollector::read_plain(Node& offsets, Node& connectivity, const PieceRange& piece) {
  const auto base = static_cast<std::int64_t>(connectivity_.size());
  std::int64_t last = 0;
  std::vector<std::int64_t> moved;
  std::uint64_t found =
      loader_.read_integers(offsets, piece.cells, [&](std::span<const std::int64_t> values) {
        moved.clear();
        for (const std::int64_t value : values) {
          if (value < last)
            loader_.fail(ErrorCode::corrupt, offsets, "an offset is less than before");
          last = value;
          std::int64_t sum = 0;
          if (__builtin_add_overflow(base, value, &sum))
            loader_.fail(ErrorCode::corrupt, offsets, "an offset is impossibly large");
          moved.push_back(sum);
        }
        offsets_.append(moved.size(), bytes_of(moved));
      });
  if (found != piece.cells)
    loader_.fail(
        ErrorCode::truncated, offsets,
        "has " + std::to_string(found) + " values for " + std::to_string(piece.cells) + " cells");
  loader_.mark(offsets, std::string(kOffsets));
  const auto size = static_cast<std::uint64_t>(last);
  found = loader_.read_integers(connectivity, size, [&](std::span<const std::int64_t> values) {
    moved.assign(values.begin(), values.end());
    check_nodes(connectivity, moved, piece);
    for (std::int64_t& node : moved) node += static_cast<std::int64_t>(piece.first_point);
    connectivity_.append(moved.size(), bytes_of(moved));
  });
  if (found != size)
    loader_.fail(
        ErrorCode::truncated, connectivity,
        "has " + std::to_string(found) + " values, but the offsets end at " + std::to_string(size));
  loader_.mark(connectivity, std::string(kConnectivity));
}

void CellCollector::check_nodes(Node& array, const std::vector<std::int64_t>& nodes,
                                const PieceRange& piece) const {
  for (const std::int64_t node : nodes)
    if (node < 0 || static_cast<std::uint64_t>(node) >= piece.points)
      loader_.fail(ErrorCode::corrupt, array,
                   "names point " + std::to_string(node) + " of " + std::to_string(piece.points));
}

// Reads the cells of a piece with polyhedra. If the writer would arrange the arrays of faces
// differently, the original arrays are kept as extras.
void CellCollector::read_with_faces(Node& cells, Node& offsets, Node& connectivity,
                                    const PieceRange& piece) {
  face_nodes_ = 0;
  streams_ = PagedArray(spool_, sizeof(std::int64_t));
  stream_ends_ = PagedArray(spool_, sizeof(std::int64_t));
  Node* faces = find(cells, kFaces);
  Node* ends = find(cells, kFaceOffsets);
  if (faces != nullptr && ends != nullptr) {
    if (face_streams(*faces, *ends, piece)) {
      loader_.mark(*faces, std::string(kFaces));
      loader_.mark(*ends, std::string(kFaceOffsets));
    } else {
      loader_.keep_as_extra(*faces, kNoLimit);
      loader_.keep_as_extra(*ends, kNoLimit);
    }
  } else {
    const bool standard = face_tables(cells, piece);
    for (const std::string_view name :
         {kFaceConnectivity, kFaceEnds, kPolyhedronFaces, kPolyhedronEnds}) {
      if (standard) {
        loader_.mark(*find(cells, name), std::string(name));
      } else {
        loader_.keep_as_extra(*find(cells, name), kNoLimit);
      }
    }
  }
  add_cells(offsets, connectivity, piece);
  loader_.mark(offsets, std::string(kOffsets));
  loader_.mark(connectivity, std::string(kConnectivity));
}

void CellCollector::begin_stream(std::uint64_t faces) {
  streams_.set(streams_.size(), static_cast<std::int64_t>(faces));
}

void CellCollector::add_stream_face(Node& array, Column& nodes, std::uint64_t begin,
                                    std::uint64_t end) {
  if (end - begin > kMostFaceUses * nodes.size() + kFewFaceNodes - face_nodes_)
    loader_.fail(ErrorCode::over_limit, array,
                 "its points belong to faces of more than " + std::to_string(kMostFaceUses) +
                     " polyhedra on average");
  face_nodes_ += end - begin;
  if (end - begin > kMaxNodesPerCell)
    loader_.fail(
        ErrorCode::unsupported, array,
        "a face has " + std::to_string(end - begin) + " points; at most 65536 are supported");
  std::vector<std::int64_t> face(1 + (end - begin));
  face[0] = static_cast<std::int64_t>(end - begin);
  nodes.values.read(begin, end - begin, reinterpret_cast<std::byte*>(face.data() + 1));
  streams_.append(face.size(), bytes_of(face));
}

// Reads the faces in files up to version 2.2. For each polyhedron, the array `faces` contains the
// number of faces, then the size and the points of each face. For each cell, the array `ends`
// contains the end of its data in `faces`, or -1 if the cell is not a polyhedron. Returns false if
// `faces` contains additional numbers.
bool CellCollector::face_streams(Node& faces, Node& ends, const PieceRange& piece) {
  Column numbers(*this, faces, kNoLimit), cell_ends(*this, ends, piece.cells);
  if (cell_ends.size() != piece.cells)
    loader_.fail(ErrorCode::truncated, ends, "has too few values");
  const std::uint64_t first_cell = types_.size() - piece.cells;
  std::uint64_t position = 0;
  bool standard = true;
  for (std::uint64_t c = 0; c < piece.cells; ++c) {
    const std::int64_t stated = cell_ends.at(c);
    if (types_.get<std::uint8_t>(first_cell + c) == vtk::kPolyhedron) {
      const auto end = static_cast<std::uint64_t>(stated);
      if (stated <= static_cast<std::int64_t>(position) || end > numbers.size())
        loader_.fail(ErrorCode::corrupt, ends,
                     "the end of the faces of cell " + std::to_string(c) + " is out of range");
      const std::int64_t count = numbers.at(position++);
      if (count < 0 || static_cast<std::uint64_t>(count) > end - position)
        loader_.fail(ErrorCode::corrupt, faces,
                     "cell " + std::to_string(c) + " has an impossible number of faces");
      begin_stream(static_cast<std::uint64_t>(count));
      for (std::int64_t f = 0; f < count; ++f) {
        const std::int64_t size = position < end ? numbers.at(position++) : -1;
        if (size < 0 || static_cast<std::uint64_t>(size) > end - position)
          loader_.fail(ErrorCode::corrupt, faces,
                       "cell " + std::to_string(c) + " has a face beyond its end");
        add_stream_face(faces, numbers, position, position + static_cast<std::uint64_t>(size));
        position += static_cast<std::uint64_t>(size);
      }
      standard &= position == end;
      position = end;
    } else {
      standard &= stated == -1;
      if (stated > static_cast<std::int64_t>(position))
        position = static_cast<std::uint64_t>(stated);
    }
    stream_ends_.set(c, static_cast<std::int64_t>(streams_.size()));
  }
  return standard && position == numbers.size();
}

// Reads the faces in files from version 2.3 on, in which polyhedra are lists of faces, and faces
// are lists of points. Returns false if polyhedra share faces, if faces are not numbered in the
// order of the polyhedra, or if the arrays contain unused entries.
bool CellCollector::face_tables(Node& cells, const PieceRange& piece) {
  Node* arrays[4] = {find(cells, kFaceConnectivity), find(cells, kFaceEnds),
                     find(cells, kPolyhedronFaces), find(cells, kPolyhedronEnds)};
  if (std::find(std::begin(arrays), std::end(arrays), nullptr) != std::end(arrays))
    loader_.fail(ErrorCode::corrupt, cells, "there are polyhedra, but no arrays of faces");
  Column points(*this, *arrays[0], kNoLimit), face_ends(*this, *arrays[1], kNoLimit),
      face_ids(*this, *arrays[2], kNoLimit), cell_ends(*this, *arrays[3], piece.cells);
  if (cell_ends.size() != piece.cells)
    loader_.fail(ErrorCode::truncated, *arrays[3], "has too few values");
  const std::uint64_t first_cell = types_.size() - piece.cells;
  bool standard = face_ends.size() == face_ids.size();
  std::uint64_t position = 0;
  for (std::uint64_t c = 0; c < piece.cells; ++c) {
    const std::int64_t stated = cell_ends.at(c);
    const auto end = static_cast<std::uint64_t>(stated);
    if (stated < static_cast<std::int64_t>(position) || end > face_ids.size())
      loader_.fail(ErrorCode::corrupt, *arrays[3],
                   "the end of the faces of cell " + std::to_string(c) + " is out of range");
    const bool polyhedron = types_.get<std::uint8_t>(first_cell + c) == vtk::kPolyhedron;
    standard &= polyhedron || end == position;
    if (polyhedron) begin_stream(end - position);
    for (; position < end; ++position) {
      const std::int64_t id = face_ids.at(position);
      if (id < 0 || static_cast<std::uint64_t>(id) >= face_ends.size())
        loader_.fail(
            ErrorCode::corrupt, *arrays[2],
            "names face " + std::to_string(id) + " of " + std::to_string(face_ends.size()));
      standard &= static_cast<std::uint64_t>(id) == position;
      const auto face = static_cast<std::uint64_t>(id);
      const std::int64_t from = face == 0 ? 0 : face_ends.at(face - 1);
      const std::int64_t to = face_ends.at(face);
      if (from < 0 || to < from || static_cast<std::uint64_t>(to) > points.size())
        loader_.fail(ErrorCode::corrupt, *arrays[1],
                     "the end of face " + std::to_string(id) + " is out of range");
      if (polyhedron)
        add_stream_face(*arrays[0], points, static_cast<std::uint64_t>(from),
                        static_cast<std::uint64_t>(to));
    }
    stream_ends_.set(c, static_cast<std::int64_t>(streams_.size()));
  }
  const std::int64_t used = face_ends.size() == 0 ? 0 : face_ends.at(face_ends.size() - 1);
  return standard && position == face_ids.size() &&
         used == static_cast<std::int64_t>(points.size());
}

void CellCollector::Reordered::add(std::uint64_t cell, const std::vector<std::int64_t>& points,
                                   std::uint64_t first_point) {
  cells.push_back(static_cast<std::int64_t>(cell));
  counts.push_back(static_cast<std::int64_t>(points.size()));
  for (const std::int64_t point : points)
    nodes.push_back(point + static_cast<std::int64_t>(first_point));
}

void CellCollector::add_cells(Node& offsets, Node& connectivity, const PieceRange& piece) {
  Column ends(*this, offsets, piece.cells);
  if (ends.size() != piece.cells) loader_.fail(ErrorCode::truncated, offsets, "has too few values");
  const std::int64_t size = ends.at(piece.cells - 1);
  if (size < 0) loader_.fail(ErrorCode::corrupt, offsets, "the last offset is negative");
  Column nodes(*this, connectivity, static_cast<std::uint64_t>(size));
  const std::uint64_t first_cell = types_.size() - piece.cells;
  std::int64_t begin = 0, stream_begin = 0;
  std::vector<std::int64_t> cell;
  for (std::uint64_t c = 0; c < piece.cells; ++c) {
    const std::int64_t end = ends.at(c);
    if (end < begin || static_cast<std::uint64_t>(end) > nodes.size())
      loader_.fail(ErrorCode::corrupt, offsets,
                   "the end of cell " + std::to_string(c) + " is out of range");
    if (end - begin > static_cast<std::int64_t>(kMaxNodesPerCell))
      loader_.fail(ErrorCode::unsupported, connectivity,
                   "cell " + std::to_string(c) + " has more than 65536 points");
    cell.resize(static_cast<std::size_t>(end - begin));
    nodes.values.read(static_cast<std::uint64_t>(begin), cell.size(),
                      reinterpret_cast<std::byte*>(cell.data()));
    check_nodes(connectivity, cell, piece);
    const std::int64_t stream_end = stream_ends_.get<std::int64_t>(c);
    if (types_.get<std::uint8_t>(first_cell + c) == vtk::kPolyhedron) {
      if (stream_end - stream_begin > static_cast<std::int64_t>(2 * kMaxNodesPerCell))
        loader_.fail(ErrorCode::unsupported, connectivity,
                     "the faces of cell " + std::to_string(c) + " have more than 65536 points");
      std::vector<std::int64_t> stream(static_cast<std::size_t>(stream_end - stream_begin));
      streams_.read(static_cast<std::uint64_t>(stream_begin), stream.size(),
                    reinterpret_cast<std::byte*>(stream.data()));
      std::vector<std::int64_t> points = first_uses(stream);
      if (cell != points) unlike_faces_.add(first_cell + c, cell, piece.first_point);
      std::sort(points.begin(), points.end());
      if (cell != points) not_ascending_.add(first_cell + c, cell, piece.first_point);
      cell = std::move(stream);
    }
    add_cell(c, types_.get<std::uint8_t>(first_cell + c), cell, piece);
    begin = end;
    stream_begin = stream_end;
  }
}

// Adds a cell. `numbers` contains its points or, for a polyhedron, its face stream. Converts point
// numbers of the piece to point numbers of the mesh; face sizes do not change.
void CellCollector::add_cell(std::uint64_t cell, std::uint8_t type,
                             const std::vector<std::int64_t>& numbers, const PieceRange& piece) {
  std::vector<std::int64_t> moved = numbers;
  const auto first_point = static_cast<std::int64_t>(piece.first_point);
  if (type == vtk::kPolyhedron) {
    for (std::size_t position = 1; position < moved.size();) {
      const std::int64_t size = moved[position++];
      for (std::int64_t i = 0; i < size; ++i, ++position) {
        if (moved[position] < 0 || static_cast<std::uint64_t>(moved[position]) >= piece.points)
          moved[position] = -1;  // not a point number, so CellTable will report an error
        else
          moved[position] += first_point;
      }
    }
  } else {
    for (std::int64_t& node : moved) node += first_point;
  }
  connectivity_.append(moved.size(), bytes_of(moved));
  offsets_.set(piece.first_cell + cell + 1, static_cast<std::int64_t>(connectivity_.size()));
}

void CellCollector::finish(vtk::CellTable& table, MeshInfo& info) {
  const bool any = types_.size() > 0;
  PagedArray none(spool_, sizeof(std::int64_t));
  table.set_types(vtk::Values(ScalarType::uint8, std::move(types_)));
  table.set_offsets(vtk::Values(ScalarType::int64, any ? std::move(offsets_) : std::move(none)),
                    vtk::Values(ScalarType::int64, std::move(connectivity_)));
  const bool ascending = not_ascending_.nodes.size() < unlike_faces_.nodes.size();
  const Reordered& others = ascending ? not_ascending_ : unlike_faces_;
  if (ascending)
    info.extras.push_back(integers_extra("vtu/polyhedron/ascending", std::vector<std::int32_t>{1}));
  if (others.cells.empty()) return;
  info.extras.push_back(integers_extra("vtu/polyhedron/cells", others.cells, Reference::cell));
  info.extras.push_back(integers_extra("vtu/polyhedron/counts", others.counts, Reference::nothing));
  info.extras.push_back(integers_extra("vtu/polyhedron/points", others.nodes, Reference::vertex));
}

}  // namespace shm::converters::vtu
