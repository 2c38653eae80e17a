// ForeignSteps: a mesh whose time steps are read from a file of another format, or from a file that
// holds one step. Vertices and cells must have the same numbers in both files. Fields are paired by
// name; a vector may also be stored as separate components. A file without steps counts as one
// step.
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
  // The resulting mesh is `mesh` with the step times and step values of `source`. `time`: time of a
  // source that has neither steps nor a time. Throws Failure (misuse) if no time is known.
  ForeignSteps(MeshSource& mesh, MeshSource& source, std::optional<double> time, Spool& spool);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // Describes each difference that proves that the source is not the same mesh with the same
  // arrays.
  std::vector<std::string> differences(const Progress& progress);

 private:
  void pair_arrays();
  // The place from which the values of one component of an array are read.
  struct Part {
    std::size_t pair = 0;
    std::uint32_t component = 0;  // component of the field pair
  };
  FieldReader& reader(std::size_t pair, bool of_mesh);

  MeshSource& other_;
  Spool& spool_;
  FieldPairs fields_;
  std::vector<std::vector<Part>> parts_;  // source of each component of each stepped array
  std::vector<std::string> missing_;
  std::vector<std::unique_ptr<FieldReader>> mesh_readers_,
      other_readers_;  // one reader for each pair of fields
};

}  // namespace shm::converters
