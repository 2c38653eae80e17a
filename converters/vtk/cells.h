// The cells of a VTK legacy file with their types, and the blocks of the model into which they are
// divided. The file stores cells as rows (up to version 4.x) or as offsets and connectivity (5.x).
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
  // Sets classic rows: for each cell the number of nodes, followed by the nodes.
  void set_rows(std::uint64_t cells, Values rows);
  // Sets offsets and connectivity of version 5.x. `offsets` has one entry more than there are
  // cells, or no entry.
  void set_offsets(Values offsets, Values connectivity);
  void set_types(Values types);
  // Sets the list of polygonal data that contains the cells. The list and the number of nodes
  // determine the type of each cell.
  void set_list(EntryKind list) { list_ = list; }

  std::uint64_t cells() const { return cells_; }

  // Reads all cells once, checks every number, finds the blocks, and adds the blocks and the faces
  // of polyhedra to `info`. Call it after the setters. Throws Failure, which names the file `path`.
  void find_blocks(MeshInfo& info, const std::string& path);

  void rewind();
  // Appends at most `max_cells` cells to `out`.
  void next_cells(CellBatch& out, std::size_t max_cells);

 private:
  // Largest number of different cell sizes of one type that get separate blocks. If there are more,
  // the cells of the type are one block of varying size.
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
  // Adds blocks after the first `others` blocks. Returns false if the caller must start again,
  // because a type now has a block of varying size, or because polyhedra cannot have the shape
  // `faces`.
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
  std::int64_t begin_ = 0;  // begin of the current cell, from the offsets
  std::uint8_t type_ = 0;
  std::vector<std::uint64_t> nodes_;
  std::vector<std::int64_t> face_sizes_;  // face sizes of the current polyhedron
  bool closed_faces_ = true;              // true while all polyhedra can have the shape `faces`
  std::array<TypeBlocks, 256> by_type_;
};

// Returns the extra vtk/cell_types for the blocks that CellTables found.
Extra cell_types_extra(const MeshInfo& info);

}  // namespace shm::converters::vtk
