// BoundarySearch: receives blocks of vertices and cells, and finds the sides that belong to only
// one cell. It stores each vertex until the vertex is finalized and no stored side uses it. It
// stores each side until the oldest vertex of the side is finalized; SideTable stores the side
// under this vertex. The memory is therefore proportional to the size of the active surface and of
// the boundary.
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
  /// Creates a search. `schema` is borrowed. Precondition: the schema has all requested arrays.
  BoundarySearch(const Schema& schema, const BoundaryOptions& options);

  /// Adds the next block. After an error, do not call any function of the object.
  Result<void> add(const MeshBlock& block);
  /// Ends the mesh. Must be called after the last block. Adds to the boundary the sides that only
  /// one cell has, then sorts the surface.
  Result<void> end_mesh();
  /// Return the number of sides that are stored for comparison with later cells, and the number of
  /// stored vertices.
  std::size_t open_sides() const { return sides_.size(); }
  std::size_t kept_vertices() const { return vertices_.size() - free_vertices_.size(); }
  /// Returns the number of cells that were skipped because their sides cannot be determined.
  std::uint64_t left_out() const { return left_out_; }
  /// Returns the surface, which is complete after end_mesh().
  SurfaceBuilder& found() { return found_; }

 private:
  struct Vertex {
    std::uint64_t number = 0;
    // Number of vertices of the mesh that were introduced before this vertex.
    std::uint64_t ordinal = 0;
    // Reference count: number of occurrences of the vertex in the cycles of stored sides, plus 1
    // until the vertex is finalized.
    std::uint64_t holds = 1;
    // Index of the vertex in found_; kNone if found_ does not contain it yet.
    std::uint32_t place = kNone;
    bool is_finalized = false;
  };
  /// A cell with stored sides.
  struct Cell {
    std::uint64_t position = 0, number = 0;
    std::uint32_t block = 0;
    std::uint32_t sides = 0;
  };
  /// State of a requested cell array.
  struct CellColumn {
    std::vector<bool> covers;   // true for each block that the array covers
    std::size_t taken = 0;      // number of elements of the current block that have been read
    std::uint64_t element = 0;  // index, in the whole mesh, of the next element of the array
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
  void add_flat_facets(std::span<const Facet> facets);
  void add_facets(std::span<const Facet> facets, bool has_two_orders);
  template <class Position>
  void add_quad(std::uint32_t number, const std::array<Position, 4>& corners);
  template <class Position>
  void add_triangle(std::uint32_t number, const std::array<Position, 4>& corners);
  void add_odd_solid(const CellForm& form);
  bool add_polyhedron();
  template <class SlotAt>
  void collect_side(std::uint32_t number, std::size_t size, SlotAt&& slot_at);
  void add_collected();
  void add_collected(const Cycle& cycle);
  bool are_distinct(std::uint32_t corners) const;
  bool all_distinct();
  bool is_mirrored_wedge() const;
  void number_sides();

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
  // Form of the cells of each block (face, or solid with sides). Used for blocks whose cells have a
  // fixed number of nodes.
  std::vector<CellForm> forms_;
  // Facets of the cells of each block; empty if the sides of its cells are not divided. While the
  // surface is being built, the number of a face is that of its facet, counted from 1.
  std::vector<std::span<const Facet>> facets_;
  struct Divided {
    CellShape shape = CellShape::other;
    NodeScheme scheme = NodeScheme::lagrange;
    std::uint32_t nodes = 0;
    std::vector<Facet> facets;
  };
  std::vector<Divided> divided_;          // kinds of cells that have facets
  std::vector<CellColumn> cell_columns_;  // state of each requested cell array
  std::uint64_t next_vertex_ = 0, next_cell_ = 0, left_out_ = 0;
  std::size_t others_seen_ =
      0;                       // number of other_last_uses of the current block that have been seen
  std::size_t unchecked_ = 0;  // number of nodes processed since the memory use was last checked

  NumberMap slots_;  // slots of live vertices, by vertex number
  std::vector<Vertex> vertices_;
  std::vector<std::byte> records_;  // one record for each vertex
  std::vector<std::uint32_t> free_vertices_;
  SideTable sides_;
  std::vector<Cell> cells_;
  std::vector<std::byte> cell_records_;
  std::vector<std::uint32_t> free_cells_;

  // Data of the current cell.
  Cell cell_;
  std::vector<std::byte> record_;
  // Index of the current cell in cells_; kNone until a side of the cell is stored.
  std::uint32_t kept_as_ = kNone;
  std::vector<std::uint32_t> nodes_;     // vertex slots of the cell's nodes
  std::vector<std::uint64_t> ordinals_;  // ordinals of the nodes of a solid
  std::vector<std::uint32_t> sorted_;    // vertex slots of the nodes, sorted
  bool is_mirrored_ = false;   // true if the corners of each side are in counter-clockwise order as
                               // seen from inside the cell
  std::vector<Cycle> cycles_;  // sides of the cell; only the first collected_ entries are valid
  std::size_t collected_ = 0;
};

}  // namespace shm
