#include "order/spooled_mesh.h"

#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "base/external_sorter.h"
#include "mesh/cell_cursor.h"
#include "mesh/coding_order.h"
#include "mesh/mesh_points.h"
#include "mesh/vertex_compaction.h"
#include "order/hilbert_curve.h"

namespace shm::converters {
namespace {

constexpr std::uint64_t kElementsAtOnce = 16384;
constexpr std::uint32_t kRecordNodes = 8;

// A record for sorting the cells, which contains up to eight nodes of one cell. A cell with more
// nodes has several consecutive records.
struct CellRecord {
  std::uint32_t number, block;
  std::uint32_t count;  // number of nodes in this record
  bool last;            // true if this is the last record of the cell
  std::array<std::uint32_t, kRecordNodes> nodes;
};

template <class T>
const std::byte* bytes_of(const T& value) {
  return reinterpret_cast<const std::byte*>(&value);
}

}  // namespace

bool must_be_spooled(const MeshInfo& info, std::size_t memory) {
  constexpr std::uint64_t kBytesACell = 115, kBytesAVertex = 40;
  std::uint64_t bytes = info.vertices * kBytesAVertex + info.cells() * kBytesACell;
  for (std::size_t b = 0; b < info.block_cells.size(); ++b) {
    const std::uint32_t nodes = info.schema.blocks[b].nodes_per_cell;
    if (nodes > 8) bytes += info.block_cells[b] * sizeof(std::uint32_t) * (nodes - 8);
  }
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a)
    bytes += info.array_elements(a) * info.array_stride(a);
  return bytes > memory && SpooledMesh::fits(info);
}

SpooledMesh::SpooledMesh(MeshSource& mesh, Spool& spool, std::size_t sort_bytes,
                         const Progress& progress)
    : mesh_(&mesh),
      spool_(&spool),
      sort_bytes_(sort_bytes),
      info_(mesh.info()),
      old_vertex_(&spool),
      new_vertex_(&spool),
      old_cell_(&spool),
      new_cell_(&spool),
      points_(spool, 3 * scalar_bytes(info_.schema.coordinate_type)),
      blocks_(&spool),
      hexahedra_(&spool),
      all_cells_(spool),
      values_(info_.schema.arrays.size()) {
  plain_ = true;
  for (const BlockInfo& block : info_.schema.blocks) {
    hexahedral_.push_back(holds_hexahedra(block));
    plain_ = plain_ && holds_hexahedra(block) && block.nodes_per_cell == 8;
  }
  sort_vertices(progress);
  sort_cells(progress);
  for_each_part(old_cell_, [&](std::uint64_t, const std::vector<std::uint32_t>& part) {
    for (const std::uint32_t number : part) new_cell_.push_back(number);
  });
  renumber_extras();
}

bool SpooledMesh::all_hexahedra() const {
  return std::find(hexahedral_.begin(), hexahedral_.end(), false) == hexahedral_.end();
}

// Computes the inverse of `list`, which contains the old number for each new number. Calls
// visit(first, part) for consecutive parts of the inverse, each of which fits into memory: part[i]
// is the new number of the vertex or cell with the old number `first + i`.
template <class Visit>
void SpooledMesh::for_each_part(const Numbers& list, Visit&& visit) const {
  const std::uint64_t most = std::max<std::uint64_t>(sort_bytes_ / sizeof(std::uint32_t), 1);
  std::vector<std::uint32_t> part;
  for (std::uint64_t first = 0; first < list.size(); first += part.size()) {
    part.resize(std::min(most, list.size() - first));
    for (std::uint64_t position = 0; position < list.size(); ++position) {
      const std::uint64_t old = list[position];
      if (old >= first && old - first < part.size())
        part[old - first] = static_cast<std::uint32_t>(position);
    }
    visit(first, part);
  }
}

// Returns, for each vertex, whether a cell uses it.
std::vector<bool> SpooledMesh::used_vertices() const {
  std::vector<bool> used(info_.vertices);
  std::uint64_t cell = 0;
  for (CellCursor cursor(*mesh_); cursor.next(); ++cell)
    for (const std::uint64_t v : cursor.corners()) {
      require_vertex(cell, v, info_.vertices);
      used[v] = true;
    }
  return used;
}

void SpooledMesh::sort_vertices(const Progress& progress) {
  if (progress) progress("sorting vertices", 0, 2);
  // Vertices that no cell uses come last, in the mesh's order, because the writer also stores them
  // last.
  constexpr std::uint64_t kUnused = ~std::uint64_t{0};
  const std::vector<bool> used = used_vertices();
  const CurveGrid grid(*mesh_);
  const std::size_t stride = 3 * scalar_bytes(info_.schema.coordinate_type);
  std::vector<std::byte> record(sizeof(std::uint32_t) + stride), piece;
  ExternalSorter sorted(spool_->directory(), record.size(), sort_bytes_);
  for (std::uint64_t first = 0; first < info_.vertices; first += kElementsAtOnce) {
    const std::uint64_t count = std::min(kElementsAtOnce, info_.vertices - first);
    piece.resize(count * stride);
    mesh_->read_points(first, count, piece.data());
    for (std::uint64_t i = 0; i < count; ++i) {
      const auto number = static_cast<std::uint32_t>(first + i);
      std::memcpy(record.data(), &number, sizeof number);
      std::memcpy(record.data() + sizeof number, piece.data() + i * stride, stride);
      const auto place = point_at(piece.data() + i * stride, info_.schema.coordinate_type);
      sorted.add(used[number] ? along_curve(grid.place(place)) : kUnused, record.data());
    }
  }
  if (progress) progress("sorting vertices", 1, 2);
  std::uint64_t key;
  for (const std::byte* next; sorted.next(key, next);) {
    std::uint32_t number;
    std::memcpy(&number, next, sizeof number);
    old_vertex_.push_back(number);
    points_.append(1, next + sizeof number);
  }
}

// Returns the corners of all cells as new vertex numbers. The cells are in the mesh's order.
SpooledMesh::Numbers SpooledMesh::renumbered_corners(Spool& spool, const Progress& progress) {
  Numbers corners(&spool);
  for_each_part(old_vertex_, [&](std::uint64_t first, const std::vector<std::uint32_t>& part) {
    if (progress) progress("numbering corners", first, info_.vertices);
    for (const std::uint32_t number : part) new_vertex_.push_back(number);
    std::uint64_t cell = 0, corner = 0;
    for (CellCursor cursor(*mesh_); cursor.next(); ++cell)
      for (const std::uint64_t v : cursor.corners()) {
        require_vertex(cell, v, info_.vertices);
        if (first == 0)
          corners.push_back(v < part.size() ? part[v] : 0);
        else if (v >= first && v - first < part.size())
          corners.set(corner, part[v - first]);
        ++corner;
      }
  });
  return corners;
}

void SpooledMesh::sort_cells(const Progress& progress) {
  Spool corner_spool(spool_->directory(), sort_bytes_ / 4);
  const Numbers corners = renumbered_corners(corner_spool, progress);
  ExternalSorter sorted(spool_->directory(), sizeof(CellRecord), sort_bytes_);
  if (progress) progress("sorting cells", 0, 2);
  std::uint64_t corner = 0;
  std::vector<std::uint32_t> nodes;
  CellRecord record{};
  for (CellCursor cursor(*mesh_); cursor.next(); ++record.number) {
    nodes.clear();
    for (std::size_t i = 0; i < cursor.corners().size(); ++i) nodes.push_back(corners[corner++]);
    record.block = cursor.block();
    std::uint32_t lowest = nodes.empty() ? 0 : *std::min_element(nodes.begin(), nodes.end());
    for (std::size_t first = 0; first == 0 || first < nodes.size(); first += kRecordNodes) {
      record.count =
          static_cast<std::uint32_t>(std::min<std::size_t>(nodes.size() - first, kRecordNodes));
      record.last = first + record.count == nodes.size();
      std::copy_n(nodes.begin() + static_cast<std::ptrdiff_t>(first), record.count,
                  record.nodes.begin());
      sorted.add(lowest, bytes_of(record));
    }
  }
  if (progress) progress("sorting cells", 1, 2);
  std::uint64_t key;
  for (const std::byte* next; sorted.next(key, next);) {
    std::memcpy(&record, next, sizeof record);
    nodes_.insert(nodes_.end(), record.nodes.begin(), record.nodes.begin() + record.count);
    if (record.last) add_cell(record.number, record.block);
  }
}

// Adds a cell with the nodes in nodes_.
void SpooledMesh::add_cell(std::uint32_t number, std::uint32_t block) {
  std::array<std::uint32_t, 8> corners{};
  if (hexahedral_[block] && nodes_.size() >= corners.size())
    for (std::size_t i = 0; i < corners.size(); ++i)
      corners[i] = static_cast<std::uint32_t>(nodes_[i]);
  hexahedra_.push_back(corners);
  if (!plain_) all_cells_.append(block, nodes_);
  if (!one_block()) blocks_.push_back(block);
  old_cell_.push_back(number);
  nodes_.clear();
}

void SpooledMesh::renumber_extras() {
  Renumbering to;
  to.vertices = info_.vertices;
  to.cells = info_.cells();
  to.vertex = [this](std::uint64_t v) { return std::uint64_t{new_vertex_[v]}; };
  to.cell = [this](std::uint64_t c) { return std::uint64_t{new_cell_[c]}; };
  for (Extra& extra : info_.extras) extra = renumbered(std::move(extra), to);
}

std::span<const std::uint32_t> SpooledMesh::cell(std::uint32_t cell) const {
  if (plain_) {
    const auto nodes = hexahedra_.get(cell);
    corners_.assign(nodes.begin(), nodes.end());
    return corners_;
  }
  batch_.clear();
  all_cells_.read(cell, batch_);
  corners_.clear();
  for (const std::uint64_t v : batch_.corners) corners_.push_back(static_cast<std::uint32_t>(v));
  return corners_;
}

bool SpooledMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  const std::uint64_t end = std::min<std::uint64_t>(size(), next_cell_ + max_cells);
  for (; next_cell_ < end; ++next_cell_) {
    const auto number = static_cast<std::uint32_t>(next_cell_);
    const auto nodes = cell(number);
    out.blocks.push_back(block(number));
    out.corners.insert(out.corners.end(), nodes.begin(), nodes.end());
    out.corner_begin.push_back(out.corners.size());
  }
  return out.size() > 0;
}

// Returns the new number of each element of an array. The elements are in the order of the original
// mesh. If the array covers only some blocks, returns new cell numbers instead of element indices,
// which is enough because the caller uses them only as sort keys.
SpooledMesh::Numbers& SpooledMesh::places_of(std::size_t array) {
  const ArrayInfo& info = info_.schema.arrays[array];
  if (info.location == Location::point) return new_vertex_;
  if (info.blocks.empty()) return new_cell_;
  const auto [place, fresh] = places_.try_emplace(info.blocks, spool_);
  std::uint32_t number = 0;
  if (fresh)
    for (CellCursor cursor(*mesh_); cursor.next(); ++number)
      if (info_.schema.array_covers(array, cursor.block()))
        place->second.push_back(new_cell_[number]);
  return place->second;
}

void SpooledMesh::take_values(std::size_t array, std::uint64_t step, PagedArray& out) {
  const std::size_t stride = info_.array_stride(array);
  const std::uint64_t elements = info_.array_elements(array);
  const Numbers& places = places_of(array);
  // The sort uses half of the memory, because a Writer or Reader is active at the same time.
  ExternalSorter sorted(spool_->directory(), stride, sort_bytes_ / 2);
  std::vector<std::byte> piece;
  for (std::uint64_t first = 0; first < elements; first += kElementsAtOnce) {
    const std::uint64_t count = std::min(kElementsAtOnce, elements - first);
    piece.resize(count * stride);
    mesh_->read_array(array, step, first, count, piece.data());
    for (std::uint64_t i = 0; i < count; ++i)
      sorted.add(places[first + i], piece.data() + i * stride);
  }
  std::uint64_t key, position = 0;
  for (const std::byte* next; sorted.next(key, next); ++position) out.write(position, 1, next);
}

void SpooledMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                             std::uint64_t count, std::byte* out) {
  if (!is_on_mesh(info_.schema.arrays[array].location))
    return mesh_->read_array(array, step, first, count, out);
  Values& values = values_[array];
  if (!values.held || values.step != step) {
    if (!values.held) values.held.emplace(*spool_, info_.array_stride(array));
    take_values(array, step, *values.held);
    values.step = step;
  }
  values.held->read(first, count, out);
}

}  // namespace shm::converters
