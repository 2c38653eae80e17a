// BoundarySearch: blocks of vertices and cells in, what only one cell has out. It keeps each vertex
// until it is finalized and no side uses it any more, and each side until the vertex at which it
// hangs, the oldest of its own, is finalized: memory follows the active surface and the boundary.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "boundary/cell_sides.h"
#include "boundary/side_table.h"
#include "boundary/surface_builder.h"
#include "shm/boundary_surface.h"
#include "shm/reader.h"
#include "shm/result.h"
#include "surface/number_map.h"

namespace shm {

class BoundarySearch {
 public:
  /// `schema` is borrowed. Must hold: it has all arrays that are asked for.
  BoundarySearch(const Schema& schema, const BoundaryOptions& options);

  /// The next block. After an error the search is over.
  Result<void> add(const MeshBlock& block);
  /// Behind the last block: what is left open is boundary, and all of it is sorted.
  Result<void> end_mesh();
  /// Sides that are kept, for others to be compared with, and vertices.
  std::size_t open_sides() const { return sides_.size(); }
  std::size_t kept_vertices() const { return vertices_.size() - free_vertices_.size(); }
  /// Cells of which no side is known.
  std::uint64_t left_out() const { return left_out_; }
  /// What was found, once end_mesh() was called.
  SurfaceBuilder& found() { return found_; }

 private:
  struct Vertex {
    std::uint64_t number = 0;
    std::uint64_t ordinal = 0;    // how many vertices came before it
    std::uint64_t holds = 1;      // places in cycles of sides, and 1 until it is finalized
    std::uint32_t place = kNone;  // in what was found
    bool is_finalized = false;
  };
  /// A cell of which there are sides.
  struct Cell {
    std::uint64_t position = 0, number = 0;
    std::uint32_t block = 0;
    std::uint32_t sides = 0;
  };
  /// An array of cells that is carried along, in the block at hand.
  struct CellColumn {
    std::vector<bool> covers;   // by block
    std::size_t taken = 0;      // elements of the block of the mesh that were taken
    std::uint64_t element = 0;  // of all: the next one
    std::vector<std::byte> nothing;
  };
  /// A side of the cell at hand.
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
  void add_quad(std::uint32_t number, const std::array<std::uint8_t, 4>& at);
  void add_triangle(std::uint32_t number, const std::array<std::uint8_t, 4>& at);
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
  std::vector<CellForm> forms_;           // by block, where cells have a fixed number of nodes
  std::vector<CellColumn> cell_columns_;  // of the cell layout
  std::uint64_t next_vertex_ = 0, next_cell_ = 0, left_out_ = 0;
  std::size_t unchecked_ = 0;  // nodes since memory was looked at

  NumberMap slots_;  // of live vertices, by number
  std::vector<Vertex> vertices_;
  std::vector<std::byte> records_;  // of vertices
  std::vector<std::uint32_t> free_vertices_;
  SideTable sides_;
  std::vector<Cell> cells_;
  std::vector<std::byte> cell_records_;
  std::vector<std::uint32_t> free_cells_;

  // the cell at hand
  Cell cell_;
  std::vector<std::byte> record_;
  std::uint32_t kept_as_ = kNone;            // in cells_, once one of its sides hangs
  std::vector<std::uint32_t> nodes_;         // slots
  std::array<std::uint64_t, 8> ordinals_{};  // of the corners of a solid
  bool is_mirrored_ = false;                 // its sides are seen from inside
  std::vector<Cycle> cycles_;                // its sides, as far as collected_ says
  std::size_t collected_ = 0;
};

}  // namespace shm
