// The cells of a VTK legacy file: rows (to 4.x) or offsets and connectivity (5.x), their types,
// and the blocks that the model makes of them.
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
  CellTable(const CellTable&) = delete;  // its cursors point into it
  CellTable& operator=(const CellTable&) = delete;
  // Classic rows: number of nodes and nodes, cell by cell.
  void set_rows(std::uint64_t cells, Values rows);
  // 5.x: `offsets` has one entry more than there are cells, or none.
  void set_offsets(Values offsets, Values connectivity);
  void set_types(Values types);
  // Of polygonal data: the type follows from the list and the number of nodes.
  void set_list(EntryKind list) { list_ = list; }

  std::uint64_t cells() const { return cells_; }

  // Walks all cells once: checks every number, finds the blocks, and adds them and the faces of
  // polyhedra to `info`. Call once everything is set. Throws Failure naming `path`.
  void find_blocks(MeshInfo& info, const std::string& path);

  void rewind();
  // Adds at most `max_cells` cells to the end of `out`.
  void next_cells(CellBatch& out, std::size_t max_cells);

 private:
  static constexpr std::size_t kMostSizes = 64;  // of one type; with more, one varying block
  struct Block {
    std::uint32_t nodes, index;
  };
  struct TypeBlocks {
    bool varying = false;  // all cells of the type in one block
    std::vector<Block> blocks;
  };
  struct Faces {
    std::vector<std::int64_t> cells, counts, sizes;
  };
  bool next_cell();  // fills type_ and nodes_ with what stands in the file
  void read_type(std::uint64_t nodes);
  void unpack_faces();
  bool close_faces();
  // Adds blocks behind the first `others`. False: start again, a type got varying, or polyhedra
  // other words.
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
  Values rows_, offsets_, types_;  // rows_ is the connectivity when has_offsets_
  IntegerCursor row_{rows_}, offset_{offsets_}, type_cursor_{types_};
  std::int64_t begin_ = 0;  // offset of the current cell
  std::uint8_t type_ = 0;
  std::vector<std::uint64_t> nodes_;
  std::vector<std::int64_t> face_sizes_;  // of the current polyhedron
  bool closed_faces_ = true;              // whether polyhedra have the shape `faces`
  std::array<TypeBlocks, 256> by_type_;
};

// vtk/cell_types of the blocks that CellTables found.
Extra cell_types_extra(const MeshInfo& info);

}  // namespace shm::converters::vtk
