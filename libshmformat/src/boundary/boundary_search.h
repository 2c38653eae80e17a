// BoundarySearch: takes blocks of vertices and cells, and finds the sides that only one cell has.
// It keeps each vertex until it is finalized and no kept side uses it. It keeps each side until its
// oldest vertex, at which the side hangs (SideTable), is finalized. Memory therefore follows the
// active surface and the boundary.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/number_map.h"
#include "boundary/cell_sides.h"
#include "boundary/side_table.h"
#include "boundary/surface_builder.h"
#include "shm/blocks.h"
#include "shm/result.h"
#include "shm/surface.h"

namespace shm {

class BoundarySearch {
 public:
  /// `schema` is borrowed. Must hold: it has all requested arrays.
  BoundarySearch(const Schema& schema, const BoundaryOptions& options);

  /// Adds the next block. After an error no other call is allowed.
  Result<void> add(const MeshBlock& block);
  /// Call it after the last block. Sides that are still open are boundary; then the surface is
  /// sorted.
  Result<void> end_mesh();
  /// Number of sides that are kept for comparison with later cells, and of vertices that are kept.
  std::size_t open_sides() const { return sides_.size(); }
  std::size_t kept_vertices() const { return vertices_.size() - free_vertices_.size(); }
  /// Number of cells whose sides are unknown.
  std::uint64_t left_out() const { return left_out_; }
  /// The surface, complete after end_mesh().
  SurfaceBuilder& found() { return found_; }

 private:
  struct Vertex {
    std::uint64_t number = 0;
    std::uint64_t ordinal = 0;  // number of vertices that came before it
    std::uint64_t holds = 1;    // occurrences in cycles of kept sides, plus 1 until it is finalized
    std::uint32_t place = kNone;  // index in found_, once it is there
    bool is_finalized = false;
  };
  /// A cell with kept sides.
  struct Cell {
    std::uint64_t position = 0, number = 0;
    std::uint32_t block = 0;
    std::uint32_t sides = 0;
  };
  /// State of a requested cell array.
  struct CellColumn {
    std::vector<bool> covers;   // by block
    std::size_t taken = 0;      // elements of the current block of the mesh that have been passed
    std::uint64_t element = 0;  // index in the whole mesh of the next element
    std::vector<std::byte> nothing;
  };
  /// A side of the current cell.
  struct Cycle {
    std::vector<std::uint32_t> slots;
    std::vector<std::uint64_t> ordinals;
    std::uint32_t number = 0;
    bool is_reversed = false;
  };

  Result<void> check(const MeshBlock& block) const;
  Result<void> check_memory();

  Result<void> add_vertex(const MeshBlock& block, std::size_t v);
  Result<void> add_cell(const MeshBlock& block, std::size_t c);
  Result<void> find_slots(std::span<const std::uint64_t> corners, std::uint64_t cell);
  void add_itself(std::uint32_t corners);
  void add_solid(const CellForm& form);
  void add_quad(std::uint32_t number, const std::array<std::uint8_t, 4>& corners);
  void add_triangle(std::uint32_t number, const std::array<std::uint8_t, 4>& corners);
  void add_odd_solid(const CellForm& form);
  bool add_polyhedron();
  template <class SlotAt>
  void collect_side(std::uint32_t number, std::size_t size, SlotAt&& slot_at);
  void add_collected();
  void add_collected(const Cycle& cycle);
  bool are_distinct(std::uint32_t corners) const;
  bool is_mirrored_wedge() const;

  void hang(SideTable::Side& side, std::uint32_t number, bool is_reversed,
            std::span<const std::uint32_t> cycle);
  void read_cell_record(const MeshBlock& block, std::size_t c);
  std::uint32_t cell_record();
  void finalize(std::uint32_t slot);
  void take_sides(std::uint32_t slot);
  std::uint32_t place_of(std::uint32_t slot);
  void release(std::uint32_t slot);

  const Schema* schema_;
  std::uint64_t max_bytes_;
  SurfaceBuilder found_;
  std::vector<CellForm> forms_;           // by block, for cells with a fixed number of nodes
  std::vector<CellColumn> cell_columns_;  // by column of the cell layout
  std::uint64_t next_vertex_ = 0, next_cell_ = 0, left_out_ = 0;
  std::size_t unchecked_ = 0;  // nodes since the last check of memory

  NumberMap slots_;  // live vertices, by number
  std::vector<Vertex> vertices_;
  std::vector<std::byte> records_;  // one for each vertex
  std::vector<std::uint32_t> free_vertices_;
  SideTable sides_;
  std::vector<Cell> cells_;
  std::vector<std::byte> cell_records_;
  std::vector<std::uint32_t> free_cells_;

  // The current cell.
  Cell cell_;
  std::vector<std::byte> record_;
  std::uint32_t kept_as_ = kNone;            // index in cells_, once one of its sides hangs
  std::vector<std::uint32_t> nodes_;         // slots
  std::array<std::uint64_t, 8> ordinals_{};  // of the corners of a solid
  bool is_mirrored_ = false;                 // its sides are seen from inside
  std::vector<Cycle> cycles_;                // its sides; only the first collected_ are valid
  std::size_t collected_ = 0;
};

}  // namespace shm
