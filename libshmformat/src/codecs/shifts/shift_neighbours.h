// ShiftNeighbours: neighbourhoods in segments whose cells are shifts. The near neighbours of a new
// vertex are in its own cell. Neighbours beyond, and the cells around a cell, follow from vertex
// numbers, which are assumed to continue as within the cell. This needs neither a surface nor a
// search, and takes almost no time.
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

/// Vertices and cells are remembered by number modulo 2^bits, which is also their slot. Frozen:
/// part of the format.
inline constexpr std::uint32_t kMostRingBits = 18;
/// A new ring has at most this number of places per element of its first group, so that clearing
/// it, and the memory of columns, stay in proportion to the data.
inline constexpr std::uint64_t kRingPlacesForEach = 4;

/// Returns true if every group must have a ring, since the file may have step values.
bool needs_ring(const Schema& schema);

/// Returns the largest ring for a group of `elements` elements, in bits.
constexpr std::uint32_t most_ring_bits(std::uint64_t elements) {
  const auto bits = std::bit_width(kRingPlacesForEach * std::max<std::uint64_t>(elements, 1));
  return std::min(static_cast<std::uint32_t>(bits) - 1, kMostRingBits);
}

class ShiftNeighbours {
 public:
  /// `schema` is borrowed. Finds the neighbourhoods of vertices, of cells, or of both.
  ShiftNeighbours(const Schema& schema, bool of_vertices, bool of_cells);

  /// Begins a group of `elements` elements. If `bits` is 0, they have no neighbourhoods. Returns
  /// false if the ring would be too large.
  bool begin_group(std::uint32_t bits, std::uint64_t elements);
  /// Returns the size of the current rings, in bits; 0: none yet.
  std::uint32_t ring_bits() const { return ring_bits_; }
  /// Returns a number above every slot that an item can name. A column may not have elements in all
  /// of these slots.
  std::uint32_t slots() const { return ring_bits_ == 0 ? 0 : 1u << ring_bits_; }

  /// Adds the next cells, which all have the same shift: appends the neighbourhoods of their new
  /// vertices, in order of introduction, and of the cells themselves.
  void add_cells(const CellMarks& marks, std::span<const std::uint64_t> numbers, std::size_t count,
                 std::vector<Neighbourhood>& vertices, std::vector<Neighbourhood>& cells);
  /// Adds a vertex that no cell uses.
  void add_unused(std::uint64_t number, std::vector<Neighbourhood>& vertices);

 private:
  /// The remembered elements, by number modulo the number of places.
  struct Ring {
    std::vector<std::uint64_t> number;
    std::vector<std::uint8_t> full;  // whether its own lattice was known

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
  std::vector<std::uint8_t> axes_;  // by block
  std::uint32_t ring_bits_ = 0;
  bool finds_ = false;
  Ring vertices_, cells_;  // cells by the number of their last corner
  std::uint32_t last_cell_ = kNone;
};

}  // namespace shm
