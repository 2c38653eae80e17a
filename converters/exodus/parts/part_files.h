// PartFiles: the files of a decomposed Exodus mesh that a rank reads, and what its nodes and
// elements are called in the whole mesh. Memory is 16 bytes for each node and element of the rank's
// parts, and of its equal share of all.
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

// Consecutive cells, of which a rank takes care.
struct CellRange {
  std::uint64_t first = 0, end = 0;
  bool empty() const { return first == end; }
};

// The name of a part, as decomp and nem_spread give it: "out.e", 16, 3: "out.e.16.03".
std::string part_name(const std::string& whole, std::size_t parts, std::size_t part);
// Of how many parts a mesh consists that is called NAME.COUNT, as rotor.e.4 of rotor.e.4.0 to
// rotor.e.4.3; 0 where a file has that name itself, or there is no first part.
std::size_t count_of_parts(const std::string& name);
// The names of the parts.
std::vector<std::string> part_files(const std::string& name, std::size_t count);

struct PartFile {
  std::size_t part = 0;
  std::string file;
  std::unique_ptr<exodus::ExodusMesh> mesh;
  // In the whole mesh, from 0: numbers of vertices, and places of cells, block by block and in each
  // block in the order of their numbers.
  std::vector<std::uint64_t> vertices, cells;
};

class PartFiles {
 public:
  // Collective. Consecutive parts for each rank. `ranks` is borrowed. Throws SharedFailure.
  PartFiles(Ranks& ranks, const std::vector<std::string>& files);

  Ranks& ranks() const { return *ranks_; }
  const std::vector<std::string>& names() const { return names_; }
  std::vector<PartFile>& mine() { return mine_; }
  std::uint64_t vertices() const { return vertices_; }
  std::uint64_t first_node() const { return first_node_; }  // what the files call vertex 0
  const std::vector<std::uint64_t>& block_cells() const { return block_cells_; }

  // Collective. Finds the numbers that nodes and elements have; each must have one of its own, each
  // number somebody. Throws SharedFailure.
  void find_numbers();

 private:
  void count();
  void find_vertices();
  void find_cells();

  Ranks* ranks_;
  std::vector<std::string> names_;
  std::vector<PartFile> mine_;
  std::uint64_t vertices_ = 0, first_node_ = 1;
  std::vector<std::uint64_t> block_cells_;  // of all parts
};

}  // namespace shm::converters
