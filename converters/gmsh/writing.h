// Internals of the Gmsh writer: the data that all parts of the writer share while they write a
// file.
#pragma once

#include <string>
#include <vector>

#include "base/failure.h"
#include "base/spool.h"
#include "gmsh/output.h"
#include "gmsh/plan.h"
#include "gmsh/types.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Number of vertices, cells or values that are read at a time.
inline constexpr std::size_t kGmshPiece = 16384;

// The tags of all nodes or of all elements. The tags are the values of an array of the mesh, or
// consecutive numbers if the mesh has no such array.
class GmshTagValues {
 public:
  GmshTagValues(Spool& spool, std::uint64_t count, std::int64_t first);
  void copy(MeshSource& mesh, std::size_t array);
  std::int64_t operator[](std::uint64_t place) {
    if (copy_.size() > 0) return copy_.get<std::int64_t>(place);
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(first_) + place);
  }
  std::int64_t lowest() const { return lowest_; }
  std::int64_t highest() const { return highest_; }

 private:
  std::uint64_t count_;
  std::int64_t first_;
  PagedArray copy_;
  std::int64_t lowest_, highest_;
};

struct GmshWriting {
  GmshWriting(MeshSource& source, const std::string& file);

  bool v41() const { return plan.version >= 41; }
  bool v4() const { return plan.version >= 40; }
  [[noreturn]] void fail(ErrorCode code, const std::string& detail) const;
  // Return the tag of the vertex or cell to which an extra refers. Throw Failure if no
  // such vertex or cell exists.
  std::int64_t node_tag(std::int64_t place);
  std::int64_t element_tag(std::int64_t place);

  MeshSource& mesh;
  const MeshInfo& info;
  const std::string path;
  const GmshPlan plan;
  const GmshExtras extras;
  Spool spool;
  GmshTagValues node_tags, element_tags;
  std::string section = "elements";  // section that error messages state

  // look_at_gmsh_cells() computes the following members:
  PagedArray cell_blocks;                  // uint32, block of each cell
  std::vector<GmshType> types;             // type of each group of the plan
  std::vector<std::uint64_t> group_cells;  // number of cells of each group
  bool cells_in_turn = true;  // true if the cells of the mesh are already sorted by group
  GmshOutput out;
};

// Counts and checks the cells. Must be called before anything is written.
void look_at_gmsh_cells(GmshWriting& writing);

// The next functions write the content of a section, without its start and end markers.
void write_gmsh_nodes(GmshWriting& writing, const std::string& section_name);
void write_gmsh_elements(GmshWriting& writing);
void write_gmsh_view(GmshWriting& writing, const GmshPlannedSection& section);
void write_gmsh_list(GmshWriting& writing, const GmshPlannedSection& section);
// Converts numbers of any type to doubles.
void widen_numbers(ScalarType type, const std::vector<std::byte>& in, std::vector<double>& out);

}  // namespace shm::converters
