#include "vtk/cells.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/failure.h"
#include "mesh/mesh_source.h"

namespace shm::converters::vtk {
void CellTable::set_rows(std::uint64_t cells, Values rows) {
  cells_ = cells;
  has_offsets_ = false;
  rows_ = std::move(rows);
}

void CellTable::set_offsets(Values offsets, Values connectivity) {
  cells_ = offsets.size() == 0 ? 0 : offsets.size() - 1;
  has_offsets_ = true;
  offsets_ = std::move(offsets);
  rows_ = std::move(connectivity);
}

void CellTable::set_types(Values types) { types_ = std::move(types); }

void CellTable::fail(const Values& values, std::string detail) const {
  const std::string_view section = &values == &types_ ? "CELL_TYPES" : keyword(list_);
  throw Failure(
      Error{ErrorCode::corrupt, std::move(detail), std::string(section), values.offset(), path_});
}

void CellTable::fail_size(std::uint64_t nodes) const {
  throw Failure(Error{ErrorCode::unsupported,
                      "cell " + std::to_string(cell_) + " has " + std::to_string(nodes) +
                          " nodes; at most " + std::to_string(kMaxNodesPerCell) + " are supported",
                      std::string(keyword(list_)), rows_.offset(), path_});
}

void CellTable::rewind() {
  cell_ = 0;
  begin_ = 0;
  row_.rewind();
  offset_.rewind();
  type_cursor_.rewind();
  if (!has_offsets_ || offsets_.size() == 0) return;
  if (offset_.next() != 0) fail(offsets_, "the first offset is not 0");
}

bool CellTable::next_cell() {
  if (cell_ == cells_) {
    if (row_.left() > 0) fail(rows_, std::to_string(row_.left()) + " numbers follow the last cell");
    return false;
  }
  const auto name = [&] { return "cell " + std::to_string(cell_); };
  if (!has_offsets_ && row_.left() == 0) fail(rows_, "the list of nodes ends before " + name());
  const std::int64_t end = has_offsets_ ? offset_.next() : row_.next();
  std::uint64_t count = static_cast<std::uint64_t>(end);
  if (has_offsets_) {
    if (end < begin_) fail(offsets_, "the offset after " + name() + " is less than before");
    count = static_cast<std::uint64_t>(end) - static_cast<std::uint64_t>(begin_);
    begin_ = end;
  }
  if (end < 0 || count > row_.left())
    fail(rows_, name() + " states " + std::to_string(has_offsets_ ? count : end) +
                    " nodes, but the list has " + std::to_string(row_.left()) + " more numbers");
  read_type(count);
  // The row of a polyhedron also contains the number of faces and the size of each face. A
  // polyhedron has at most one face per node, so its row may be twice as long as the row of another
  // cell.
  const std::uint64_t room = type_ == kPolyhedron ? 2 : 1;
  if (count > room * kMaxNodesPerCell + 1) fail_size(count);
  nodes_.clear();
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::int64_t node = row_.next();
    // The row of a polyhedron also contains face sizes, so unpack_faces() checks its nodes.
    if (type_ != kPolyhedron && (node < 0 || static_cast<std::uint64_t>(node) >= vertices_))
      fail(rows_,
           name() + " uses point " + std::to_string(node) + " of " + std::to_string(vertices_));
    nodes_.push_back(static_cast<std::uint64_t>(node));
  }
  if (type_ == kPolyhedron) unpack_faces();
  if (type_ == kPolyhedron && closed_faces_) closed_faces_ = close_faces();
  if (nodes_.size() > kMaxNodesPerCell) fail_size(nodes_.size());
  permute_nodes(type_, nodes_.data(), nodes_.size(), old_numbering_);
  ++cell_;
  return true;
}

void CellTable::read_type(std::uint64_t nodes) {
  const bool listed = list_ != EntryKind::cells;
  const std::int64_t type = listed ? cell_type_in(list_, nodes) : type_cursor_.next();
  if (type < 0 || type > 255)
    fail(types_, "cell " + std::to_string(cell_) + " has the unknown type " + std::to_string(type));
  type_ = static_cast<std::uint8_t>(type);
}

// Separates face sizes from nodes. On entry, nodes_ contains the number of faces, then the size and
// the nodes of each face. On return, nodes_ contains only the nodes, and face_sizes_ contains the
// sizes.
void CellTable::unpack_faces() {
  face_sizes_.clear();
  const auto name = [&] { return "polyhedron " + std::to_string(cell_); };
  const std::uint64_t faces = nodes_.empty() ? 0 : nodes_[0];
  if (nodes_.empty() || faces > nodes_.size() - 1)
    fail(rows_, name() + " has an impossible number of faces");
  std::size_t from = 1, to = 0;
  for (std::uint64_t face = 0; face < faces; ++face) {
    if (from == nodes_.size()) fail(rows_, name() + " ends before its last face");
    const std::uint64_t size = nodes_[from++];
    if (size > nodes_.size() - from) fail(rows_, name() + " has a face beyond its end");
    face_sizes_.push_back(static_cast<std::int64_t>(size));
    for (std::uint64_t i = 0; i < size; ++i) {
      if (nodes_[from] >= vertices_)
        fail(rows_, name() + " uses a point that is not among the " + std::to_string(vertices_) +
                        " points");
      nodes_[to++] = nodes_[from++];
    }
  }
  if (from != nodes_.size()) fail(rows_, name() + " has numbers after its last face");
  nodes_.resize(to);
}

// Repeats the first point of each face at the end of the face, so that face sizes need not be
// stored: a face ends at the point with which it began. Returns false if the node list would become
// too long, or if a face is empty or contains its first point twice, so that the list would be
// ambiguous.
bool CellTable::close_faces() {
  std::vector<std::uint64_t> closed;
  closed.reserve(nodes_.size() + face_sizes_.size());
  auto from = nodes_.begin();
  for (const std::int64_t size : face_sizes_) {
    const auto end = from + static_cast<std::ptrdiff_t>(size);
    if (size == 0 || std::find(from + 1, end, *from) != end) return false;
    closed.insert(closed.end(), from, end);
    closed.push_back(*from);
    from = end;
  }
  if (closed.size() > kMaxNodesPerCell) return false;
  nodes_ = std::move(closed);
  return true;
}

std::uint32_t CellTable::block_of_cell() const {
  const TypeBlocks& of_type = by_type_[type_];
  if (of_type.varying) return of_type.blocks.front().index;
  for (const Block& block : of_type.blocks)
    if (block.nodes == nodes_.size()) return block.index;
  return of_type.blocks.front().index;
}

void CellTable::count_cell(MeshInfo& info) {
  TypeBlocks& of_type = by_type_[type_];
  if (of_type.blocks.empty() && type_ == kPolyhedron) of_type.varying = true;
  const auto nodes = static_cast<std::uint32_t>(nodes_.size());
  for (const Block& block : of_type.blocks) {
    if (of_type.varying || block.nodes == nodes) {
      ++info.block_cells[block.index];
      return;
    }
  }
  const auto index = static_cast<std::uint32_t>(info.schema.blocks.size());
  of_type.blocks.push_back({nodes, index});
  const std::uint32_t per_cell = of_type.varying ? 0 : nodes;
  BlockInfo block = block_of_cell_type(type_, per_cell);
  if (type_ == kPolyhedron && !closed_faces_) block.shape = CellShape::polyhedron;
  info.schema.blocks.push_back(std::move(block));
  info.block_cells.push_back(1);
}

bool CellTable::collect_blocks(MeshInfo& info, std::size_t others, Faces& faces) {
  rewind();
  info.schema.blocks.resize(others);
  info.block_cells.resize(others);
  for (TypeBlocks& of_type : by_type_) of_type.blocks.clear();
  faces = {};
  const bool closed = closed_faces_;
  while (next_cell()) {
    if (closed_faces_ != closed) return false;
    count_cell(info);
    TypeBlocks& of_type = by_type_[type_];
    const std::size_t sizes = of_type.blocks.size();
    if (sizes > kMostSizes || (sizes > 1 && has_varying_nodes(type_))) {
      of_type.varying = true;
      return false;
    }
    if (type_ == kPolyhedron && !closed_faces_) {
      faces.cells.push_back(static_cast<std::int64_t>(cell_ - 1));
      faces.counts.push_back(static_cast<std::int64_t>(face_sizes_.size()));
      faces.sizes.insert(faces.sizes.end(), face_sizes_.begin(), face_sizes_.end());
    }
  }
  return true;
}

void CellTable::find_blocks(MeshInfo& info, const std::string& path) {
  path_ = path;
  vertices_ = info.vertices;
  if (list_ == EntryKind::cells && types_.size() != cells_)
    fail(types_, "there are " + std::to_string(cells_) + " cells, but " +
                     std::to_string(types_.size()) + " cell types");
  Faces faces;
  const std::size_t others = info.schema.blocks.size();
  while (!collect_blocks(info, others, faces)) {
  }
  add_faces(info, faces);
  rewind();
}

void CellTable::add_faces(MeshInfo& info, const Faces& faces) {
  if (faces.cells.empty()) return;
  const auto add = [&](const char* key, Reference refers, const std::vector<std::int64_t>& values) {
    info.extras.push_back(integers_extra(key, values, refers));
  };
  add("vtk/polyhedron/cells", Reference::cell, faces.cells);
  add("vtk/polyhedron/faces", Reference::nothing, faces.counts);
  add("vtk/polyhedron/face_sizes", Reference::nothing, faces.sizes);
}

void CellTable::next_cells(CellBatch& out, std::size_t max_cells) {
  for (std::size_t added = 0; added < max_cells && next_cell(); ++added) {
    out.blocks.push_back(block_of_cell());
    out.corners.insert(out.corners.end(), nodes_.begin(), nodes_.end());
    out.corner_begin.push_back(out.corners.size());
  }
}

Extra cell_types_extra(const MeshInfo& info) {
  std::vector<std::int32_t> types;
  for (const BlockInfo& block : info.schema.blocks)
    types.push_back(static_cast<std::int32_t>(block.id));
  return integers_extra("vtk/cell_types", types);
}

}  // namespace shm::converters::vtk
