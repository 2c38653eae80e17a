// ShiftNeighbours: neighbourhoods in a segment whose cells are shifts. What is around a new vertex
// is in its own cell; what is beyond that, and which cells lie around a cell, follows from numbers,
// which go on as they do within the cell. No surface, no search: they cost next to
// nothing. spec: "Neighbourhoods by number"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shifts/shifts.h"
#include "shm/schema.h"
#include "values/neighbourhood.h"

namespace shm {

/// Vertices and cells are remembered by number, and have slots, modulo 2^bits. Frozen: part of the
/// format.
inline constexpr std::uint32_t kMostRingBits = 18;
/// A ring that is new has no more places than so many for each element of the group that it comes
/// with, so that what is cleared, and what columns hold, has been paid for.
inline constexpr std::uint64_t kRingPlacesForEach = 4;

/// Whether each group must have a ring: steps may need it.
bool needs_ring(const Schema& schema);

/// The largest ring for a group of so many elements.
constexpr std::uint32_t most_ring_bits(std::uint64_t elements) {
  const auto bits = std::bit_width(kRingPlacesForEach * std::max<std::uint64_t>(elements, 1));
  return std::min(static_cast<std::uint32_t>(bits) - 1, kMostRingBits);
}

class ShiftNeighbours {
 public:
  /// `schema` is borrowed. Finds those of vertices, of cells, or both.
  ShiftNeighbours(const Schema& schema, bool of_vertices, bool of_cells);

  /// Before a group of so many elements. 0 bits: its elements have no neighbourhoods. False where
  /// the ring would be too large.
  bool begin_group(std::uint32_t bits, std::uint64_t elements);
  /// Of the rings that there are; 0: none yet.
  std::uint32_t ring_bits() const { return ring_bits_; }
  /// Above every slot that an item names; columns may not have met all that do.
  std::uint32_t slots() const { return ring_bits_ == 0 ? 0 : 1u << ring_bits_; }

  /// The next cells, which all have the same shift: adds the items of their new vertices, as they
  /// are introduced, and of the cells themselves.
  void add_cells(const CellMarks& marks, std::span<const std::uint64_t> numbers, std::size_t count,
                 std::vector<Neighbourhood>& vertices, std::vector<Neighbourhood>& cells);
  /// A vertex that no cell uses.
  void add_unused(std::uint64_t number, std::vector<Neighbourhood>& vertices);

 private:
  /// What is remembered, by number modulo the places.
  struct Ring {
    std::vector<std::uint64_t> number;
    std::vector<std::uint8_t> full;  // whether the lattice was known

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
  /// Of the cells of a block: how many axes the corners of a cell span. 0: they are none that are
  /// looked at.
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
