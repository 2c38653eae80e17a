// PartFiles: the part files of a decomposed Exodus mesh that this rank reads, and the numbers of
// their nodes and elements in the whole mesh. A rank needs 16 bytes of memory for each node and
// element of its parts. If there are n ranks, it also needs 16 bytes for each node and element of
// 1/n of the whole mesh.
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
// If `name` has the form NAME.COUNT and refers to a decomposed mesh, returns the number of parts.
// For example, returns 4 for rotor.e.4, whose parts are rotor.e.4.0 to rotor.e.4.3. Returns 0 if a
// file called `name` exists, or if the file of the first part does not exist.
std::size_t count_of_parts(const std::string& name);
// Returns the names of the `count` part files of the decomposed mesh `name`.
std::vector<std::string> part_files(const std::string& name, std::size_t count);

struct PartFile {
  std::size_t part = 0;
  std::string file;
  std::unique_ptr<exodus::ExodusMesh> mesh;
  // Index in the whole mesh of each vertex and cell of the part. In the whole mesh, cells are
  // sorted by block, and within a block by their numbers in the files.
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
  // Returns the number that vertex 0 of the mesh has in the files: normally 1, in some files 0.
  std::uint64_t first_node() const { return first_node_; }
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }

  // Collective. Finds the indices of all nodes and elements of the parts in the whole mesh. Throws
  // SharedFailure if two elements have the same number, or if a number is missing.
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
