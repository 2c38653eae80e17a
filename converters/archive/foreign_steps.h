// ForeignSteps: time steps of a mesh out of a file of another format, or of one that holds one
// step. Vertices and cells have the same numbers in both. Fields belong together by name, a vector
// also with its components apart. A file without steps stands for one.
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
  // The mesh is `mesh`, with the times and the values at steps of `source`. `time`: of a source
  // without steps, where it has none of its own. Throws Failure (misuse) where there is none.
  ForeignSteps(MeshSource& mesh, MeshSource& source, std::optional<double> time, Spool& spool);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

  // What keeps the source from being the same mesh with the same arrays, in words.
  std::vector<std::string> differences(const Progress& progress);

 private:
  void pair_arrays();
  // Where the values of a component come from.
  struct Part {
    std::size_t pair = 0;
    std::uint32_t component = 0;  // of the pair
  };
  FieldReader& reader(std::size_t pair, bool of_mesh);

  MeshSource& other_;
  Spool& spool_;
  FieldPairs fields_;
  std::vector<std::vector<Part>> parts_;  // of each stepped array, by component
  std::vector<std::string> missing_;
  std::vector<std::unique_ptr<FieldReader>> mesh_readers_, other_readers_;  // by pair
};

}  // namespace shm::converters
