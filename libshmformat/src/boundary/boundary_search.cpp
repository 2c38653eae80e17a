#include "boundary/boundary_search.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <string>
#include <utility>

#include "base/errors.h"

namespace shm {
namespace {

// Larger memory limits are reduced to this value, so that the size in bytes of each list fits into
// std::size_t.
constexpr std::uint64_t kMostBytes = std::numeric_limits<std::size_t>::max() / 4;

/// Returns true if cells of a block may have this number of nodes.
bool has_stated_nodes(const BlockInfo& block, std::uint64_t nodes) {
  return block.nodes_per_cell == 0 || block.nodes_per_cell == nodes;
}

Error needs_more_than(std::uint64_t limit) {
  return over_limit("needs more than " + std::to_string(limit) + " bytes, which is the limit",
                    "boundary");
}

}  // namespace

BoundarySearch::BoundarySearch(const Schema& schema, const BoundaryOptions& options)
    : schema_(&schema),
      max_bytes_(std::min<std::uint64_t>(options.max_bytes, kMostBytes)),
      found_(schema, options.arrays) {
  for (const BlockInfo& block : schema.blocks) {
    forms_.push_back(form_of(block.shape, block.nodes_per_cell));
    facets_.emplace_back();
    if (!options.subdivide) continue;
    const auto known = std::find_if(divided_.begin(), divided_.end(), [&](const Divided& kind) {
      return kind.shape == block.shape && kind.nodes == block.nodes_per_cell &&
             kind.scheme == block.scheme;
    });
    if (known != divided_.end()) {
      facets_.back() = known->facets;
    } else if (auto facets = facets_of(block); !facets.empty()) {
      divided_.push_back({block.shape, block.scheme, block.nodes_per_cell, std::move(facets)});
      facets_.back() = divided_.back().facets;
    }
  }
  for (const RecordLayout::Column& column : found_.cell_layout().columns) {
    CellColumn& own = cell_columns_.emplace_back();
    for (std::uint32_t b = 0; b < schema.blocks.size(); ++b)
      own.covers.push_back(schema.array_covers(column.array, b));
    if (!column.is_mark) own.nothing = no_value(schema.arrays[column.array]);
  }
  record_.resize(found_.cell_layout().bytes);
}

// --- blocks

/// Checks the sizes of the lists of a block, since the caller may have created the block without a
/// Reader.
Result<void> BoundarySearch::check(const MeshBlock& block) const {
  const std::size_t vertices = block.vertex_count(), cells = block.cell_count();
  bool ok = block.first_vertex == next_vertex_ && block.first_cell == next_cell_ &&
            block.xyz.size() == vertices * 3 * scalar_bytes(schema_->coordinate_type) &&
            block.cell_numbers.size() == cells && block.last_use.size() == cells &&
            block.vertices_before_cell.size() == cells &&
            (block.corner_begin.size() == cells + 1 || (cells == 0 && block.corner_begin.empty()));
  for (std::size_t c = 0; ok && c < cells; ++c)
    ok = block.cell_blocks[c] < schema_->blocks.size() &&
         block.corner_begin[c] <= block.corner_begin[c + 1] &&
         block.vertices_before_cell[c] <= vertices &&
         has_stated_nodes(schema_->blocks[block.cell_blocks[c]],
                          block.corner_begin[c + 1] - block.corner_begin[c]);
  ok = ok && (cells == 0 || block.corner_begin[cells] <= block.corners.size());
  for (const RecordLayout* layout : {&found_.vertex_layout(), &found_.cell_layout()})
    for (const RecordLayout::Column& column : layout->columns) {
      if (!ok || column.is_mark) continue;
      std::size_t elements = vertices;
      if (layout == &found_.cell_layout())
        elements = static_cast<std::size_t>(
            std::count_if(block.cell_blocks.begin(), block.cell_blocks.end(),
                          [&](std::uint32_t b) { return schema_->array_covers(column.array, b); }));
      ok = column.array < block.arrays.size() &&
           block.arrays[column.array].size() == elements * column.bytes;
    }
  return ok ? Result<void>()
            : misuse("the block is not the next block, or is incomplete", "boundary");
}

Result<void> BoundarySearch::check_memory() {
  unchecked_ = 0;
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max() / 2;
  const std::uint64_t bytes =
      slots_.memory() + sides_.memory() + vertices_.capacity() * sizeof(Vertex) +
      records_.capacity() + cells_.capacity() * sizeof(Cell) + cell_records_.capacity() +
      (free_vertices_.capacity() + free_cells_.capacity()) * sizeof(std::uint32_t);
  if (bytes + found_.memory() > max_bytes_ || found_.memory_of_sort() > max_bytes_)
    return needs_more_than(max_bytes_);
  // The lengths of these lists are limited too, because they are indexed with 32-bit numbers.
  if (vertices_.size() > kMost || sides_.size() > kMost || found_.vertices() > kMost ||
      found_.faces() > kMost)
    return needs_more_than(max_bytes_);
  return {};
}

Result<void> BoundarySearch::add(const MeshBlock& block) {
  if (auto status = check(block); !status) return status;
  for (CellColumn& column : cell_columns_) column.taken = 0;
  others_seen_ = 0;
  // The vertices of the block that come after its last cell are not used by any cell of the mesh.
  std::size_t vertex = 0;
  for (std::size_t c = 0; c < block.cell_count(); ++c) {
    const auto end = static_cast<std::size_t>(block.vertices_before_cell[c]);
    for (; vertex < end; ++vertex)
      if (auto status = add_vertex(block, vertex); !status) return status;
    if (auto status = add_cell(block, c); !status) return status;
  }
  next_vertex_ += block.vertex_count();
  next_cell_ += block.cell_count();
  return check_memory();
}

Result<void> BoundarySearch::add_vertex(const MeshBlock& block, std::size_t v) {
  const RecordLayout& layout = found_.vertex_layout();
  auto slot = static_cast<std::uint32_t>(vertices_.size());
  if (free_vertices_.empty()) {
    push_tightly(vertices_, Vertex());
    expect_more(records_, layout.bytes);
    records_.resize(records_.size() + layout.bytes);
  } else {
    slot = free_vertices_.back();
    free_vertices_.pop_back();
  }
  if (!slots_.insert(block.vertex_numbers[v], slot))
    return corrupt("vertex " + std::to_string(block.vertex_numbers[v]) + " occurs twice",
                   "boundary");
  vertices_[slot] = {block.vertex_numbers[v], block.first_vertex + v, 1, kNone, false};
  std::byte* const record = records_.data() + slot * layout.bytes;
  const std::size_t xyz_bytes = 3 * scalar_bytes(schema_->coordinate_type);
  std::memcpy(record, block.xyz.data() + v * xyz_bytes, xyz_bytes);
  for (const RecordLayout::Column& column : layout.columns)
    std::memcpy(record + column.offset, block.arrays[column.array].data() + v * column.bytes,
                column.bytes);
  return {};
}

Result<void> BoundarySearch::add_cell(const MeshBlock& block, std::size_t c) {
  const auto begin = static_cast<std::size_t>(block.corner_begin[c]);
  const auto corners =
      std::span(block.corners)
          .subspan(begin, static_cast<std::size_t>(block.corner_begin[c + 1]) - begin);
  if (auto status = find_slots(corners, block.cell_numbers[c]); !status) return status;
  const BlockInfo& info = schema_->blocks[block.cell_blocks[c]];
  CellForm form = forms_[block.cell_blocks[c]];
  if (info.nodes_per_cell != corners.size()) form = form_of(info.shape, corners.size());
  cell_ = {block.first_cell + c, block.cell_numbers[c], block.cell_blocks[c], 0};
  kept_as_ = kNone;
  if (!cell_columns_.empty()) read_cell_record(block, c);
  const std::span<const Facet> facets = facets_[block.cell_blocks[c]];
  switch (form.kind) {
    case CellForm::unknown: ++left_out_; break;
    case CellForm::itself:
      if (facets.empty())
        add_itself(form.corners);
      else
        add_flat_facets(facets);
      break;
    case CellForm::solid:
      if (facets.empty())
        add_solid(form);
      else
        add_facets(facets, form.has_two_orders);
      break;
    case CellForm::polyhedron: left_out_ += add_polyhedron() ? 0 : 1; break;
  }
  std::uint64_t last_use = block.last_use[c];
  for (std::size_t i = 0; last_use != 0 && i < nodes_.size(); ++i, last_use >>= 1)
    if ((last_use & 1) != 0) finalize(nodes_[i]);
  const auto& other = block.other_last_uses;
  for (; others_seen_ < other.size() && other[others_seen_].cell == c; ++others_seen_) {
    const std::uint32_t slot = slots_.find(other[others_seen_].vertex);
    if (slot != kNone) finalize(slot);
  }
  unchecked_ += corners.size();
  constexpr std::size_t kCheckedAt = 4096;
  return unchecked_ < kCheckedAt ? Result<void>() : check_memory();
}

Result<void> BoundarySearch::find_slots(std::span<const std::uint64_t> corners,
                                        std::uint64_t cell) {
  nodes_.resize(corners.size());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    nodes_[i] = slots_.find(corners[i]);
    if (nodes_[i] == kNone)
      return corrupt("cell " + std::to_string(cell) + " uses vertex " + std::to_string(corners[i]) +
                         ", which does not exist",
                     "boundary");
  }
  return {};
}

/// Fills the record of the current cell. The record contains the cell's value of each static array.
/// For each stepped array it contains the index of the element that belongs to the cell.
void BoundarySearch::read_cell_record(const MeshBlock& block, std::size_t c) {
  const auto& columns = found_.cell_layout().columns;
  for (std::size_t i = 0; i < columns.size(); ++i) {
    CellColumn& own = cell_columns_[i];
    const bool is_covered = own.covers[block.cell_blocks[c]];
    std::byte* const to = record_.data() + columns[i].offset;
    if (columns[i].is_mark) {
      const std::uint64_t mark = SurfaceBuilder::mark_of(own.element, is_covered);
      std::memcpy(to, &mark, sizeof mark);
    } else {
      const std::byte* from =
          is_covered ? block.arrays[columns[i].array].data() + own.taken * columns[i].bytes
                     : own.nothing.data();
      std::memcpy(to, from, columns[i].bytes);
    }
    own.taken += is_covered ? 1 : 0;
    own.element += is_covered ? 1 : 0;
  }
}

// --- cells

void BoundarySearch::add_itself(std::uint32_t corners) {
  for (std::uint32_t i = 0; i < corners; ++i) found_.add_corner(place_of(nodes_[i]));
  found_.add_face({cell_.position, cell_.number, cell_.block, record_.data()}, 0);
}

void BoundarySearch::add_flat_facets(std::span<const Facet> facets) {
  for (std::uint32_t k = 0; k < facets.size(); ++k) {
    for (std::size_t i = 0; i < facets[k].size; ++i)
      found_.add_corner(place_of(nodes_[facets[k].at[i]]));
    found_.add_face({cell_.position, cell_.number, cell_.block, record_.data()}, k + 1);
  }
}

bool BoundarySearch::are_distinct(std::uint32_t corners) const {
  std::uint64_t seen = 0;
  bool maybe = false;
  for (std::uint32_t i = 0; i < corners; ++i) {
    const std::uint64_t bit = std::uint64_t{1} << (nodes_[i] % 64);
    maybe = maybe || (seen & bit) != 0;
    seen |= bit;
  }
  if (!maybe) return true;
  for (std::uint32_t i = 1; i < corners; ++i)
    for (std::uint32_t k = 0; k < i; ++k)
      if (nodes_[i] == nodes_[k]) return false;
  return true;
}

void BoundarySearch::add_solid(const CellForm& form) {
  is_mirrored_ = form.has_two_orders && is_mirrored_wedge();
  if (!are_distinct(form.corners)) {
    add_odd_solid(form);
    return;
  }
  ordinals_.resize(nodes_.size());
  for (std::uint32_t i = 0; i < form.corners; ++i) ordinals_[i] = vertices_[nodes_[i]].ordinal;
  for (std::uint32_t k = 0; k < form.sides.size(); ++k)
    if (form.sides[k].size == 4)
      add_quad(k + 1, form.sides[k].at);
    else
      add_triangle(k + 1, form.sides[k].at);
}

/// Returns true if no vertex occurs at two nodes of the current cell.
bool BoundarySearch::all_distinct() {
  sorted_.assign(nodes_.begin(), nodes_.end());
  std::sort(sorted_.begin(), sorted_.end());
  return std::adjacent_find(sorted_.begin(), sorted_.end()) == sorted_.end();
}

/// Adds the facets of a solid as if they were its sides. Neighbouring cells have the same facets,
/// as they share the nodes.
void BoundarySearch::add_facets(std::span<const Facet> facets, bool has_two_orders) {
  is_mirrored_ = has_two_orders && is_mirrored_wedge();
  if (!all_distinct()) {
    collected_ = 0;
    for (std::uint32_t k = 0; k < facets.size(); ++k)
      collect_side(k + 1, facets[k].size, [&](std::size_t i) { return nodes_[facets[k].at[i]]; });
    add_collected();
    return;
  }
  ordinals_.resize(nodes_.size());
  for (std::size_t i = 0; i < nodes_.size(); ++i) ordinals_[i] = vertices_[nodes_[i]].ordinal;
  for (std::uint32_t k = 0; k < facets.size(); ++k)
    if (facets[k].size == 4)
      add_quad(k + 1, facets[k].at);
    else
      add_triangle(k + 1, facets[k].at);
}

/// Returns true if the first three corners of a wedge are in counter-clockwise order when seen from
/// outside the wedge.
bool BoundarySearch::is_mirrored_wedge() const {
  std::array<std::array<double, 3>, 6> points{};
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::byte* const record = records_.data() + nodes_[i] * found_.vertex_layout().bytes;
    std::array<float, 3> narrow{};
    if (schema_->coordinate_type == ScalarType::float64) {
      std::memcpy(points[i].data(), record, sizeof points[i]);
    } else {
      std::memcpy(narrow.data(), record, sizeof narrow);
      std::copy(narrow.begin(), narrow.end(), points[i].begin());
    }
  }
  std::array<double, 3> along{}, across{}, up{};
  for (std::size_t c = 0; c < 3; ++c) {
    along[c] = points[1][c] - points[0][c];
    across[c] = points[2][c] - points[0][c];
    up[c] =
        points[3][c] - points[0][c] + (points[4][c] - points[1][c]) + (points[5][c] - points[2][c]);
  }
  double volume = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::size_t d = (c + 1) % 3, e = (c + 2) % 3;
    volume += (along[d] * across[e] - along[e] * across[d]) * up[c];
  }
  return volume < 0;
}

// add_quad() and add_triangle() do not call least_cycle(): they contain faster versions of it for
// four and three distinct vertices.

template <class Position>
void BoundarySearch::add_quad(std::uint32_t number, const std::array<Position, 4>& corners) {
  const std::size_t low = ordinals_[corners[1]] < ordinals_[corners[0]] ? 1 : 0;
  const std::size_t high = ordinals_[corners[3]] < ordinals_[corners[2]] ? 3 : 2;
  const std::size_t first = ordinals_[corners[high]] < ordinals_[corners[low]] ? high : low;
  std::size_t second = (first + 1) % 4, last = (first + 3) % 4;
  const bool is_reversed = ordinals_[corners[last]] < ordinals_[corners[second]];
  if (is_reversed) std::swap(second, last);
  const std::uint32_t from = nodes_[corners[first]];
  const SideTable::Rest rest{nodes_[corners[second]], nodes_[corners[(first + 2) % 4]],
                             nodes_[corners[last]]};
  if (SideTable::Side* const side = sides_.find(from, rest))
    side->is_shared = true;
  else
    hang(sides_.add(from, rest), number, is_reversed, std::array{from, rest[0], rest[1], rest[2]});
}

template <class Position>
void BoundarySearch::add_triangle(std::uint32_t number, const std::array<Position, 4>& corners) {
  const std::size_t low = ordinals_[corners[1]] < ordinals_[corners[0]] ? 1 : 0;
  const std::size_t first = ordinals_[corners[2]] < ordinals_[corners[low]] ? 2 : low;
  std::size_t second = (first + 1) % 3, last = (first + 2) % 3;
  const bool is_reversed = ordinals_[corners[last]] < ordinals_[corners[second]];
  if (is_reversed) std::swap(second, last);
  const std::uint32_t from = nodes_[corners[first]];
  const SideTable::Rest rest{nodes_[corners[second]], nodes_[corners[last]], kNone};
  if (SideTable::Side* const side = sides_.find(from, rest))
    side->is_shared = true;
  else
    hang(sides_.add(from, rest), number, is_reversed, std::array{from, rest[0], rest[1]});
}

/// Initializes a new side of the current cell.
void BoundarySearch::hang(SideTable::Side& side, std::uint32_t number, bool is_reversed,
                          std::span<const std::uint32_t> cycle) {
  side.number = static_cast<std::uint16_t>(number);
  side.is_reversed = is_reversed != is_mirrored_;
  side.cell = cell_record();
  ++cells_[side.cell].sides;
  for (const std::uint32_t slot : cycle) ++vertices_[slot].holds;
}

/// Returns the record of the current cell. The first call for a cell stores the record.
std::uint32_t BoundarySearch::cell_record() {
  if (kept_as_ != kNone) return kept_as_;
  kept_as_ = static_cast<std::uint32_t>(cells_.size());
  if (free_cells_.empty()) {
    push_tightly(cells_, cell_);
    expect_more(cell_records_, record_.size());
    cell_records_.resize(cell_records_.size() + record_.size());
  } else {
    kept_as_ = free_cells_.back();
    free_cells_.pop_back();
    cells_[kept_as_] = cell_;
  }
  if (!record_.empty())
    std::memcpy(cell_records_.data() + kept_as_ * record_.size(), record_.data(), record_.size());
  return kept_as_;
}

// --- cells that repeat a vertex, and polyhedra

void BoundarySearch::add_odd_solid(const CellForm& form) {
  collected_ = 0;
  for (std::uint32_t k = 0; k < form.sides.size(); ++k)
    collect_side(k + 1, form.sides[k].size,
                 [&](std::size_t i) { return nodes_[form.sides[k].at[i]]; });
  add_collected();
}

/// Adds the sides of a polyhedron. Returns false if the node list of the cell is not a valid list
/// of faces.
bool BoundarySearch::add_polyhedron() {
  is_mirrored_ = false;
  collected_ = 0;
  std::uint32_t number = 0;
  const bool ok = for_each_face(nodes_, [&](std::size_t first, std::size_t size) {
    collect_side(++number, size, [&](std::size_t i) { return nodes_[first + i]; });
  });
  if (ok) add_collected();
  return ok;
}

/// Collects one side of the current cell. Consecutive corners at the same vertex count once. A side
/// with fewer than three remaining corners is ignored.
template <class SlotAt>
void BoundarySearch::collect_side(std::uint32_t number, std::size_t size, SlotAt&& slot_at) {
  if (collected_ == cycles_.size()) cycles_.emplace_back();
  Cycle& cycle = cycles_[collected_];
  cycle.slots.clear();
  for (std::size_t i = 0; i < size; ++i)
    if (cycle.slots.empty() || cycle.slots.back() != slot_at(i)) cycle.slots.push_back(slot_at(i));
  while (cycle.slots.size() > 1 && cycle.slots.back() == cycle.slots.front())
    cycle.slots.pop_back();
  if (cycle.slots.size() < 3) return;
  cycle.ordinals.clear();
  for (const std::uint32_t slot : cycle.slots) cycle.ordinals.push_back(vertices_[slot].ordinal);
  cycle.number = number;
  cycle.is_reversed = least_cycle(cycle.slots, cycle.ordinals);
  ++collected_;
}

/// Adds the collected sides. Two equal sides of the cell cancel each other.
void BoundarySearch::add_collected() {
  const auto sides = std::span(cycles_).first(collected_);
  std::vector<std::uint32_t> order(collected_);
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    if (sides[a].ordinals != sides[b].ordinals) return sides[a].ordinals < sides[b].ordinals;
    return a < b;
  });
  std::vector<std::uint32_t> once;
  for (std::size_t i = 0; i < order.size();) {
    std::size_t end = i + 1;
    while (end < order.size() && sides[order[end]].ordinals == sides[order[i]].ordinals) ++end;
    if ((end - i) % 2 == 1) once.push_back(order[i]);
    i = end;
  }
  std::sort(once.begin(), once.end());
  for (const std::uint32_t i : once) add_collected(sides[i]);
}

void BoundarySearch::add_collected(const Cycle& cycle) {
  const auto& slots = cycle.slots;
  auto sorted = cycle.ordinals;
  std::sort(sorted.begin(), sorted.end());
  const bool is_long =
      slots.size() > 4 || std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end();
  const SideTable::Rest rest =
      is_long ? SideTable::Rest{kNone, kNone, kNone}
              : SideTable::Rest{slots[1], slots[2], slots.size() == 4 ? slots[3] : kNone};
  SideTable::Side* const side =
      is_long ? sides_.find_long(slots) : sides_.find(slots.front(), rest);
  if (side != nullptr)
    side->is_shared = true;
  else
    hang(is_long ? sides_.add_long(slots) : sides_.add(slots.front(), rest), cycle.number,
         cycle.is_reversed, slots);
}

// --- sides and vertices that are complete

/// Finalizes a vertex. Called when no later cell uses the vertex. No further cell can then share
/// the sides that are stored under the vertex.
void BoundarySearch::finalize(std::uint32_t slot) {
  if (vertices_[slot].is_finalized) return;  // the vertex occurs twice in the cell
  vertices_[slot].is_finalized = true;
  slots_.erase(vertices_[slot].number);
  take_sides(slot);
  release(slot);
}

void BoundarySearch::take_sides(std::uint32_t slot) {
  sides_.take(slot, [&](const SideTable::Side& side, std::span<const std::uint32_t> cycle) {
    Cell& cell = cells_[side.cell];
    if (!side.is_shared) {
      found_.add_corner(place_of(cycle.front()));
      for (std::size_t i = 1; i < cycle.size(); ++i)
        found_.add_corner(place_of(cycle[side.is_reversed ? cycle.size() - i : i]));
      found_.add_face({cell.position, cell.number, cell.block,
                       cell_records_.data() + side.cell * record_.size()},
                      side.number);
    }
    if (--cell.sides == 0) push_tightly(free_cells_, side.cell);
    for (const std::uint32_t each : cycle) release(each);
  });
}

std::uint32_t BoundarySearch::place_of(std::uint32_t slot) {
  Vertex& vertex = vertices_[slot];
  if (vertex.place == kNone)
    vertex.place = found_.add_vertex(vertex.number, vertex.ordinal,
                                     records_.data() + slot * found_.vertex_layout().bytes);
  return vertex.place;
}

void BoundarySearch::release(std::uint32_t slot) {
  if (--vertices_[slot].holds == 0) push_tightly(free_vertices_, slot);
}

Result<void> BoundarySearch::end_mesh() {
  for (std::uint32_t slot = 0; slot < sides_.slots(); ++slot) take_sides(slot);
  if (auto status = check_memory(); !status) return status;
  found_.sort();
  number_sides();
  return {};
}

/// Replaces the numbers of facets by those of their sides.
void BoundarySearch::number_sides() {
  BoundarySurface& surface = found_.surface();
  for (std::size_t f = 0; f < surface.sides.size(); ++f) {
    const std::span<const Facet> facets = facets_[surface.blocks[f]];
    if (!facets.empty()) surface.sides[f] = facets[surface.sides[f] - 1].side;
  }
}

}  // namespace shm
