// ForeignSteps: a mesh whose time steps are read from another file, which may have a different
// format or contain a single step. Vertices and cells must have the same ids in both files. Fields
// with equal names are paired; a vector in one file may be separate component arrays in the other.
// A file without steps counts as one step.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/spool.h"
#include "compare/field_pairs.h"
#include "mesh/forwarding_mesh.h"

namespace shm::converters {

class ForeignSteps final : public ForwardingMesh {
 public:
  // The resulting mesh is `mesh` with the step times and step values of `source`. If `source` has
  // neither steps nor a time, `time` is used as its time. Throws Failure (misuse) if `time` is
  // needed but not set.
  ForeignSteps(MeshSource& mesh, MeshSource& source, std::optional<double> time, Spool& spool);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Returns descriptions of the differences between the source and the mesh; step values are not
  // compared. If the result is not empty, the source has a different mesh or different arrays.
  std::vector<std::string> differences(const Progress& progress);

 private:
  void pair_arrays();
  // The values of one component of an array are read from the source: from component `component` of
  // the pair of fields `pair`.
  struct Part {
    std::size_t pair = 0;
    std::uint32_t component = 0;  // component of the field pair
  };
  FieldReader& reader(std::size_t pair, bool of_mesh);

  MeshSource& other_;
  Spool& spool_;
  FieldPairs fields_;
  // For each array that changes with time: the field component from which each component of the
  // array is read.
  std::vector<std::vector<Part>> parts_;
  std::vector<std::string> missing_;
  std::vector<std::unique_ptr<FieldReader>> mesh_readers_,
      other_readers_;  // one reader for each pair of fields
};

}  // namespace shm::converters
