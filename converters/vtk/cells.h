// The cells of a VTK legacy file, stored as rows (up to version 4.x) or as offsets and connectivity
// (5.x), with their types, and the blocks of the model that they are divided into.
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
  CellTable(const CellTable&) = delete;  // the cursors point into it
  CellTable& operator=(const CellTable&) = delete;
  // Classic rows: for each cell the number of nodes, then the nodes.
  void set_rows(std::uint64_t cells, Values rows);
  // Version 5.x. `offsets` has one entry more than there are cells, or none.
  void set_offsets(Values offsets, Values connectivity);
  void set_types(Values types);
  // For polygonal data: the cell type follows from the list and the number of nodes.
  void set_list(EntryKind list) { list_ = list; }

  std::uint64_t cells() const { return cells_; }

  // Walks all cells once, checks every number, finds the blocks, and adds the blocks and the faces
  // of polyhedra to `info`. Call it after the setters. Throws Failure with `path`.
  void find_blocks(MeshInfo& info, const std::string& path);

  void rewind();
  // Adds at most `max_cells` cells to the end of `out`.
  void next_cells(CellBatch& out, std::size_t max_cells);

 private:
  // Different cell sizes of one type. With more, the type has one block of varying size.
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
  bool next_cell();  // fills type_ and nodes_ as stored in the file
  void read_type(std::uint64_t nodes);
  void unpack_faces();
  bool close_faces();
  // Adds blocks after the first `others` blocks. Returns false if the caller must start again: a
  // type now has blocks of varying size, or polyhedra cannot have the shape `faces`.
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
  Values rows_, offsets_, types_;  // rows_ is the connectivity if has_offsets_
  IntegerCursor row_{rows_}, offset_{offsets_}, type_cursor_{types_};
  std::int64_t begin_ = 0;  // offset of the current cell
  std::uint8_t type_ = 0;
  std::vector<std::uint64_t> nodes_;
  std::vector<std::int64_t> face_sizes_;  // face sizes of the current polyhedron
  bool closed_faces_ = true;              // true while all polyhedra can have the shape `faces`
  std::array<TypeBlocks, 256> by_type_;
};

// The extra vtk/cell_types for the blocks that CellTables found.
Extra cell_types_extra(const MeshInfo& info);

}  // namespace shm::converters::vtk
