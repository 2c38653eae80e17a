// ShiftNeighbours: finds neighbourhoods in segments that are coded as shifts. The near neighbours
// of a new vertex are in the same cell. Neighbours farther away are found by extrapolating vertex
// numbers: along each axis, the number is assumed to change by the same amount from vertex to
// vertex as within the cell. The neighbours of cells are also found by vertex numbers. No active
// surface and no search are needed, so this takes almost no time.
// spec: "Neighbourhoods by number"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shared/neighbourhood.h"
#include "codecs/shifts/shifts.h"
#include "shm/schema.h"

namespace shm {

/// Binary logarithm of the largest size of a ring of elements. A ring has 2^bits places. An element
/// (vertex or cell) is stored in the place with the index number modulo 2^bits; this index is also
/// the slot of the element. Frozen: part of the format.
inline constexpr std::uint32_t kMostRingBits = 18;
/// A new ring has at most this number of places for each element of the group. The limit keeps the
/// time for clearing the ring, and the memory that columns need, in proportion to the size of the
/// data.
inline constexpr std::uint64_t kRingPlacesForEach = 4;

/// Returns true if every group must have a ring. This is the case if the file has stepped arrays
/// (arrays with time steps).
bool needs_ring(const Schema& schema);

/// Returns the binary logarithm of the largest allowed ring size for a group of `elements`
/// elements.
constexpr std::uint32_t most_ring_bits(std::uint64_t elements) {
  const auto bits = std::bit_width(kRingPlacesForEach * std::max<std::uint64_t>(elements, 1));
  return std::min(static_cast<std::uint32_t>(bits) - 1, kMostRingBits);
}

class ShiftNeighbours {
 public:
  /// `of_vertices`: true if the neighbourhoods of vertices are needed. `of_cells`: true if those of
  /// cells are needed. `schema` must outlive this object.
  ShiftNeighbours(const Schema& schema, bool of_vertices, bool of_cells);

  /// Begins a group of `elements` elements. `bits`: the ring has 2^bits places; if `bits` is 0, the
  /// group has no neighbourhoods. Returns false if the ring would be too large.
  bool begin_group(std::uint32_t bits, std::uint64_t elements);
  /// Returns the binary logarithm of the current ring size, or 0 if no ring exists yet.
  std::uint32_t ring_bits() const { return ring_bits_; }
  /// Returns an upper bound on the slots in neighbourhoods: each slot is less than this number. A
  /// column need not use all slots.
  std::uint32_t slots() const { return ring_bits_ == 0 ? 0 : 1u << ring_bits_; }

  /// Adds the next cells, which all have the same shift. Appends the neighbourhoods of the vertices
  /// that the cells introduce, in order of introduction, to `vertices`, and the neighbourhoods of
  /// the cells to `cells`.
  void add_cells(const CellMarks& marks, std::span<const std::uint64_t> numbers, std::size_t count,
                 std::vector<Neighbourhood>& vertices, std::vector<Neighbourhood>& cells);
  /// Adds a vertex that no cell uses.
  void add_unused(std::uint64_t number, std::vector<Neighbourhood>& vertices);

 private:
  /// A ring of the elements whose neighbourhoods can be looked up. The place of an element is its
  /// number modulo the number of places.
  struct Ring {
    std::vector<std::uint64_t> number;
    /// For each place: 1 if the near, diagonal and opposite neighbours of the element were all
    /// known.
    std::vector<std::uint8_t> full;

    void clear(std::size_t places);
    std::uint32_t place(std::uint64_t n) const {
      return static_cast<std::uint32_t>(n & (number.size() - 1));
    }
    bool has(std::uint64_t n) const { return number[place(n)] == n; }
    void add(const Neighbourhood& item, std::uint64_t n) {
      number[item.self] = n;
      full[item.self] = item.has_rule() ? 1 : 0;
    }
    void look_for_thirds(Neighbourhood& item) const;
  };
  /// Returns the number of axes along which cells of the block have neighbours: 3 for hexahedra, 2
  /// for quadrilaterals, 0 for other cells.
  std::uint32_t axes(std::uint32_t block) const { return axes_[block]; }
  void add_vertices(const CellMarks& marks, const std::uint64_t* numbers,
                    std::vector<Neighbourhood>& vertices);
  void look_around(Neighbourhood& item, std::uint32_t position, std::uint64_t introduced,
                   const std::uint64_t* numbers, std::uint32_t axes) const;
  void add_cell(std::uint32_t axes, const std::uint64_t* numbers,
                std::vector<Neighbourhood>& cells);

  bool of_vertices_, of_cells_;
  std::vector<std::uint8_t> axes_;  // for each block: result of axes()
  std::uint32_t ring_bits_ = 0;
  bool finds_ = false;
  Ring vertices_, cells_;  // ring of vertices by number, and ring of cells by the number of their
                           // last corner
  std::uint32_t last_cell_ = kNone;
};

}  // namespace shm
