// CellTable: the cells of a VTK legacy file with their types. Divides the cells into blocks of the
// mesh. A file stores cells as rows (up to version 4.x) or as offsets and connectivity (5.x).
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "mesh/mesh_source.h"
#include "vtk/values.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

class CellTable {
 public:
  CellTable() = default;
  CellTable(const CellTable&) = delete;  // not copyable, because the cursors point into this object
  CellTable& operator=(const CellTable&) = delete;
  // Sets the cells of a file of version 4.x or earlier. `rows` contains the number of nodes of each
  // cell, followed by its nodes.
  void set_rows(std::uint64_t cells, Values rows);
  // Sets the cells of a file of version 5.x. The number of `offsets` is the number of cells plus 1,
  // or 0 if the mesh has no cells.
  void set_offsets(Values offsets, Values connectivity);
  void set_types(Values types);
  // Must be called if the cells come from a list of polygonal data (e.g. POLYGONS). The kind of
  // list and the number of nodes then determine the type of each cell.
  void set_list(EntryKind list) { list_ = list; }
  // Sets whether the file has the old numbering of Lagrange and Bezier hexahedra (permute_nodes()).
  void set_old_numbering(bool old) { old_numbering_ = old; }

  std::uint64_t cells() const { return cells_; }

  // Reads all cells once, checks all node numbers, cell types and sizes, and divides the cells into
  // blocks. Adds the blocks and the faces of polyhedra to `info`. Must be called after the set_*()
  // functions. Throws Failure with the file name `path`.
  void find_blocks(MeshInfo& info, const std::string& path);

  void rewind();
  // Appends the next cells to `out`, at most `max_cells`.
  void next_cells(CellBatch& out, std::size_t max_cells);

 private:
  // The cells of a type are normally divided into one block for each number of nodes. If this would
  // create more than kMostSizes blocks, all cells of the type are in a single block, in which the
  // number of nodes varies from cell to cell.
  static constexpr std::size_t kMostSizes = 64;
  struct Block {
    std::uint32_t nodes, index;
  };
  struct TypeBlocks {
    bool varying = false;  // all cells of the type are in one block, whatever their number of nodes
    std::vector<Block> blocks;
  };
  struct Faces {
    std::vector<std::int64_t> cells, counts, sizes;
  };
  bool next_cell();  // reads the next cell into type_ and nodes_ as stored in the file
  void read_type(std::uint64_t nodes);
  void unpack_faces();
  bool close_faces();
  // Reads the cells and divides them into blocks, which replace the blocks of `info` after the
  // first `others`. Returns false if the caller must call this function again, because the cells of
  // some type must now be in a single block, or because polyhedra cannot have the shape `faces`.
  bool collect_blocks(MeshInfo& info, std::size_t others, Faces& faces);
  void count_cell(MeshInfo& info);
  std::uint32_t block_of_cell() const;
  static void add_faces(MeshInfo& info, const Faces& faces);
  [[noreturn]] void fail(const Values& values, std::string detail) const;
  [[noreturn]] void fail_size(std::uint64_t nodes) const;

  std::string path_;
  std::uint64_t cells_ = 0, cell_ = 0, vertices_ = 0;
  bool has_offsets_ = false, old_numbering_ = false;
  EntryKind list_ = EntryKind::cells;
  Values rows_, offsets_, types_;  // rows_ contains the connectivity if has_offsets_
  IntegerCursor row_{rows_}, offset_{offsets_}, type_cursor_{types_};
  std::int64_t begin_ = 0;  // position in the connectivity at which the current cell begins
  std::uint8_t type_ = 0;
  std::vector<std::uint64_t> nodes_;
  std::vector<std::int64_t> face_sizes_;  // face sizes of the current polyhedron
  bool closed_faces_ = true;              // false if a polyhedron cannot have the shape `faces`
  std::array<TypeBlocks, 256> by_type_;
};

// Returns the extra vtk/cell_types, which contains the VTK cell type of each block.
Extra cell_types_extra(const MeshInfo& info);

}  // namespace shm::converters::vtk
