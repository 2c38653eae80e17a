#include "codecs/shifts/shift_neighbours.h"

#include <algorithm>
#include <bit>

#include "mesh/cell_topology.h"
#include "mesh/hexahedron.h"

namespace shm {
namespace {

/// For each neighbour in the order of Neighbourhood::at: the axes along which the neighbour is one
/// step away, as a bit mask (1: x, 2: y, 4: z).
constexpr std::array<std::uint32_t, 7> kLatticeBits = {1, 2, 4, 3, 5, 6, 7};

}  // namespace

bool needs_ring(const Schema& schema) {
  return std::any_of(schema.arrays.begin(), schema.arrays.end(),
                     [](const ArrayInfo& array) { return array.per_step; });
}

void ShiftNeighbours::Ring::clear(std::size_t places) {
  number.resize(places);
  // Mark each slot as empty: store the number i ^ 1 in slot i. The element with this number never
  // belongs in slot i.
  for (std::size_t i = 0; i < places; ++i) number[i] = i ^ 1;
  full.assign(places, 0);
}

void ShiftNeighbours::Ring::look_for_thirds(Neighbourhood& item) const {
  std::uint32_t known = item.known;
  for (std::uint32_t a = 0; a < 3; ++a)
    if ((known >> a & 1) != 0 && full[item.at[a]] != 0) known |= Neighbourhood::kThird << a;
  item.known = static_cast<std::uint16_t>(known);
}

ShiftNeighbours::ShiftNeighbours(const Schema& schema, bool of_vertices, bool of_cells)
    : of_vertices_(of_vertices), of_cells_(of_cells) {
  for (const BlockInfo& block : schema.blocks) {
    const bool solid = is_hexahedral(block);
    const bool flat = block.shape == CellShape::quad && block.nodes_per_cell >= 4;
    axes_.push_back(solid ? 3 : flat ? 2 : 0);
  }
}

bool ShiftNeighbours::begin_group(std::uint32_t bits, std::uint64_t elements) {
  finds_ = bits > 0;
  if (!finds_ || bits == ring_bits_) return true;
  if (bits > most_ring_bits(elements)) return false;
  ring_bits_ = bits;
  if (of_vertices_) vertices_.clear(std::size_t{1} << bits);
  if (of_cells_) cells_.clear(std::size_t{1} << bits);
  last_cell_ = kNone;
  return true;
}

void ShiftNeighbours::add_cells(const CellMarks& marks, std::span<const std::uint64_t> numbers,
                                std::size_t count, std::vector<Neighbourhood>& vertices,
                                std::vector<Neighbourhood>& cells) {
  if (!finds_) return;
  const std::size_t nodes = numbers.size() / count;
  for (std::size_t c = 0; c < count; ++c) {
    if (of_vertices_) add_vertices(marks, numbers.data() + c * nodes, vertices);
    if (of_cells_) add_cell(axes(marks.block), numbers.data() + c * nodes, cells);
  }
}

void ShiftNeighbours::add_unused(std::uint64_t number, std::vector<Neighbourhood>& vertices) {
  if (!finds_ || !of_vertices_) return;
  Neighbourhood& item = vertices.emplace_back();
  item.self = vertices_.place(number);
  vertices_.add(item, number);
}

void ShiftNeighbours::add_vertices(const CellMarks& marks, const std::uint64_t* numbers,
                                   std::vector<Neighbourhood>& vertices) {
  const std::uint32_t axes = this->axes(marks.block);
  for (std::uint64_t left = marks.introduced; left != 0; left &= left - 1) {
    const auto position = static_cast<std::uint32_t>(std::countr_zero(left));
    Neighbourhood& item = vertices.emplace_back();
    item.self = vertices_.place(numbers[position]);
    if (position < 1u << axes && axes > 0) {
      look_around(item, position, left, numbers, axes);
    } else if (position > 0) {
      item.at[0] = vertices_.place(numbers[position - 1]);
      item.known = Neighbourhood::kNear;
    }
    vertices_.add(item, numbers[position]);
  }
}

/// Finds the neighbours of the vertex at `position`. `introduced`: bit mask of the positions whose
/// vertices are not known yet, including `position`.
void ShiftNeighbours::look_around(Neighbourhood& item, std::uint32_t position,
                                  std::uint64_t introduced, const std::uint64_t* numbers,
                                  std::uint32_t axes) const {
  const std::uint64_t self = numbers[position];
  const std::uint32_t bits = kCornerBits[position];
  item.kind = axes == 3 ? Neighbourhood::lattice : Neighbourhood::flat;
  item.corner = static_cast<std::uint8_t>(bits);
  std::uint32_t known = 0;
  for (std::uint32_t i = 0; i < kLatticeBits.size(); ++i) {
    if (kLatticeBits[i] >> axes != 0) continue;
    const std::uint32_t other = kCornerBits[bits ^ kLatticeBits[i]];
    if ((introduced >> other & 1) != 0) continue;
    item.at[i] = vertices_.place(numbers[other]);
    known |= 1u << i;
    if (i >= axes) continue;
    const std::uint64_t by = self - numbers[other];
    if (!vertices_.has(numbers[other] - by)) continue;
    item.at[kAtBeyond + i] = vertices_.place(numbers[other] - by);
    known |= Neighbourhood::kBeyond << i;
    if (!vertices_.has(numbers[other] - 2 * by)) continue;
    item.at[kAtFarther + i] = vertices_.place(numbers[other] - 2 * by);
    known |= Neighbourhood::kFarther << i;
  }
  item.known = static_cast<std::uint16_t>(known);
  vertices_.look_for_thirds(item);
}

/// Finds the neighbours of a cell. A cell is identified by the vertex number of its final corner.
/// If neighbouring cells list their corners in the same order, the final corner of an earlier
/// neighbour is also a corner of this cell. The neighbour can then be looked up by that vertex
/// number.
void ShiftNeighbours::add_cell(std::uint32_t axes, const std::uint64_t* numbers,
                               std::vector<Neighbourhood>& cells) {
  Neighbourhood& item = cells.emplace_back();
  const std::uint32_t last = (1u << axes) - 1;
  const auto corner = [&](std::uint32_t bits) { return numbers[kCornerBits[bits]]; };
  const std::uint64_t self = corner(last);
  item.self = cells_.place(self);
  std::uint32_t known = 0;
  const auto take = [&](std::uint32_t i, std::uint64_t number) {
    if (!cells_.has(number)) return false;
    item.at[i] = cells_.place(number);
    known |= 1u << i;
    return true;
  };
  for (std::uint32_t i = 0; i < kLatticeBits.size(); ++i) {
    if (kLatticeBits[i] >> axes != 0) continue;
    const std::uint64_t number = corner(last ^ kLatticeBits[i]);
    std::uint64_t by = number - self;
    if (!take(i, number)) {
      by = 0 - by;
      if (i >= axes || !take(i, self + by)) continue;
    }
    if (i < axes && take(kAtBeyond + i, self + 2 * by)) take(kAtFarther + i, self + 3 * by);
  }
  if (axes > 0) item.kind = axes == 3 ? Neighbourhood::lattice : Neighbourhood::flat;
  if (axes == 0 && last_cell_ != kNone) {
    item.at[0] = last_cell_;
    known = Neighbourhood::kNear;
  }
  item.known = static_cast<std::uint16_t>(known);
  cells_.look_for_thirds(item);
  cells_.add(item, self);
  last_cell_ = item.self;
}

}  // namespace shm
