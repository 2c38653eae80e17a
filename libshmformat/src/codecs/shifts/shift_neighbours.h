// ShiftNeighbours: finds neighbourhoods in segments whose cells are coded as shifts. The near
// neighbours of a new vertex are in the same cell. Neighbours farther away, and the cells around a
// cell, are found by vertex numbers, which are assumed to continue as within the cell. Finding
// neighbours needs neither a surface nor a search, and takes almost no time.
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

/// Largest size of a ring, in bits. Vertices and cells are remembered by number modulo 2^bits,
/// which is also their slot. Frozen: part of the format.
inline constexpr std::uint32_t kMostRingBits = 18;
/// Largest number of places of a new ring per element of its first group. The limit keeps the time
/// to clear the ring, and the memory of columns, in proportion to the data.
inline constexpr std::uint64_t kRingPlacesForEach = 4;

/// Returns true if every group must have a ring because the file may have step values.
bool needs_ring(const Schema& schema);

/// Returns the size in bits of the largest ring that a group of `elements` elements may have.
constexpr std::uint32_t most_ring_bits(std::uint64_t elements) {
  const auto bits = std::bit_width(kRingPlacesForEach * std::max<std::uint64_t>(elements, 1));
  return std::min(static_cast<std::uint32_t>(bits) - 1, kMostRingBits);
}

class ShiftNeighbours {
 public:
  /// Finds the neighbourhoods of vertices, of cells, or of both. `schema` must outlive this object.
  ShiftNeighbours(const Schema& schema, bool of_vertices, bool of_cells);

  /// Begins a group of `elements` elements. `bits`: size of the ring; 0: the elements have no
  /// neighbourhoods. Returns false if the ring would be too large.
  bool begin_group(std::uint32_t bits, std::uint64_t elements);
  /// Returns the size of the current rings in bits; 0 if no rings exist yet.
  std::uint32_t ring_bits() const { return ring_bits_; }
  /// Returns an upper bound (exclusive) of all slots that can occur in a neighbourhood. A column
  /// may have no elements in some of these slots.
  std::uint32_t slots() const { return ring_bits_ == 0 ? 0 : 1u << ring_bits_; }

  /// Adds the next cells, which all have the same shift. Appends the neighbourhoods of their new
  /// vertices, in order of introduction, to `vertices`, and those of the cells to `cells`.
  void add_cells(const CellMarks& marks, std::span<const std::uint64_t> numbers, std::size_t count,
                 std::vector<Neighbourhood>& vertices, std::vector<Neighbourhood>& cells);
  /// Adds a vertex that no cell uses.
  void add_unused(std::uint64_t number, std::vector<Neighbourhood>& vertices);

 private:
  /// The remembered elements, stored by number modulo the number of places.
  struct Ring {
    std::vector<std::uint64_t> number;
    /// For each place: 1 if all neighbours in the element's own lattice were known.
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
  /// Returns the number of axes of the cells of a block: 3 for hexahedra, 2 for quadrilaterals, 0
  /// for other cells.
  std::uint32_t axes(std::uint32_t block) const { return axes_[block]; }
  void add_vertices(const CellMarks& marks, const std::uint64_t* numbers,
                    std::vector<Neighbourhood>& vertices);
  void look_around(Neighbourhood& item, std::uint32_t position, std::uint64_t introduced,
                   const std::uint64_t* numbers, std::uint32_t axes) const;
  void add_cell(std::uint32_t axes, const std::uint64_t* numbers,
                std::vector<Neighbourhood>& cells);

  bool of_vertices_, of_cells_;
  std::vector<std::uint8_t> axes_;  // number of axes of the cells, by block
  std::uint32_t ring_bits_ = 0;
  bool finds_ = false;
  Ring vertices_, cells_;  // cells are stored by the number of their last corner
  std::uint32_t last_cell_ = kNone;
};

}  // namespace shm
