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
  CellTable(const CellTable&) = delete;  // not copied, because the cursors point into this object
  CellTable& operator=(const CellTable&) = delete;
  // Sets cells in the form of classic rows: the number of nodes of each cell, followed by the
  // nodes.
  void set_rows(std::uint64_t cells, Values rows);
  // Sets cells in the form of version 5.x. `offsets` is empty, or has one entry more than there are
  // cells.
  void set_offsets(Values offsets, Values connectivity);
  void set_types(Values types);
  // States that the cells come from a list of polygonal data. The kind of list and the number of
  // nodes determine the type of each cell.
  void set_list(EntryKind list) { list_ = list; }

  std::uint64_t cells() const { return cells_; }

  // Reads all cells once, checks every number, and finds the blocks. Adds the blocks and the faces
  // of polyhedra to `info`. Must be called after the setters. Throws Failure, which names the file
  // `path`.
  void find_blocks(MeshInfo& info, const std::string& path);

  void rewind();
  // Appends the next cells to `out`, at most `max_cells`.
  void next_cells(CellBatch& out, std::size_t max_cells);

 private:
  // Largest number of blocks for cells of one type with different numbers of nodes. If more blocks
  // would be needed, all cells of the type are in one block of varying size.
  static constexpr std::size_t kMostSizes = 64;
  struct Block {
    std::uint32_t nodes, index;
  };
  struct TypeBlocks {
    bool varying = false;  // all cells of the type are in one block
    std::vector<Block> blocks;
  };
  struct Faces {
    std::vector<std::int64_t> cells, counts, sizes;
  };
  bool next_cell();  // reads the next cell into type_ and nodes_ as stored in the file
  void read_type(std::uint64_t nodes);
  void unpack_faces();
  bool close_faces();
  // Creates blocks after the first `others` blocks. Returns false if the caller must start again: a
  // type now has a block of varying size, or polyhedra cannot have the shape `faces`.
  bool collect_blocks(MeshInfo& info, std::size_t others, Faces& faces);
  void count_cell(MeshInfo& info);
  std::uint32_t block_of_cell() const;
  static void add_faces(MeshInfo& info, const Faces& faces);
  [[noreturn]] void fail(const Values& values, std::string detail) const;
  [[noreturn]] void fail_size(std::uint64_t nodes) const;

  std::string path_;
  std::uint64_t cells_ = 0, cell_ = 0, vertices_ = 0;
  bool has_offsets_ = false;
  EntryKind list_ = EntryKind::cells;
  Values rows_, offsets_, types_;  // rows_ contains the connectivity if has_offsets_
  IntegerCursor row_{rows_}, offset_{offsets_}, type_cursor_{types_};
  std::int64_t begin_ = 0;  // position in the connectivity at which the current cell begins
  std::uint8_t type_ = 0;
  std::vector<std::uint64_t> nodes_;
  std::vector<std::int64_t> face_sizes_;  // face sizes of the current polyhedron
  bool closed_faces_ = true;              // true while all polyhedra can have the shape `faces`
  std::array<TypeBlocks, 256> by_type_;
};

// Returns the extra vtk/cell_types, which contains the cell type of each block that CellTables
// found.
Extra cell_types_extra(const MeshInfo& info);

}  // namespace shm::converters::vtk
