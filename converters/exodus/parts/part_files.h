// PartFiles: the files of a decomposed Exodus mesh that a rank reads, with the numbers that their
// nodes and elements have in the whole mesh. A rank needs 16 bytes of memory for each node and
// element of its parts, and 16 bytes for each node and element of its equal share of the whole
// mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "exodus/mesh.h"
#include "exodus/parts/ranks.h"

namespace shm::converters {

// Consecutive cells that are assigned to a rank.
struct CellRange {
  std::uint64_t first = 0, end = 0;
  bool empty() const { return first == end; }
};

// Returns the name that decomp and nem_spread give to a part, e.g. "out.e.16.03" for part 3 of 16
// parts of "out.e".
std::string part_name(const std::string& whole, std::size_t parts, std::size_t part);
// Returns the number of parts if `name` means a decomposed mesh, i.e. has the form NAME.COUNT:
// 4 for rotor.e.4 if its parts are rotor.e.4.0 to rotor.e.4.3. Returns 0 if a file of that name
// exists, or if the first part does not exist.
std::size_t count_of_parts(const std::string& name);
// Returns the names of the part files of a decomposed mesh.
std::vector<std::string> part_files(const std::string& name, std::size_t count);

struct PartFile {
  std::size_t part = 0;
  std::string file;
  std::unique_ptr<exodus::ExodusMesh> mesh;
  // Numbers of the part's vertices and cells in the whole mesh, from 0. Cells are numbered block by
  // block, and within a block in the order of their numbers in the files.
  std::vector<std::uint64_t> vertices, cells;
};

class PartFiles {
 public:
  // Collective. Distributes the files to the ranks; each rank reads consecutive files. Borrows
  // `ranks`. Throws SharedFailure.
  PartFiles(Ranks& ranks, const std::vector<std::string>& files);

  Ranks& ranks() const { return *ranks_; }
  const std::vector<std::string>& names() const { return names_; }
  std::vector<PartFile>& mine() { return mine_; }
  std::uint64_t vertices() const { return vertices_; }
  // Number that vertex 0 of the mesh has in the files.
  std::uint64_t first_node() const { return first_node_; }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }

  // Collective. Finds the numbers of nodes and elements in the whole mesh. No two elements may have
  // the same number, and every number must be used. Throws SharedFailure.
  void find_numbers();

 private:
  void count();
  void find_vertices();
  void find_cells();

  Ranks* ranks_;
  std::vector<std::string> names_;
  std::vector<PartFile> mine_;
  std::uint64_t vertices_ = 0, first_node_ = 1;
  // For each block, its total number of cells in all parts.
  std::vector<std::uint64_t> block_cells_;
};

}  // namespace shm::converters
