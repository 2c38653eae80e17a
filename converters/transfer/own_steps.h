// OwnSteps: a mesh that contains only some time steps of another mesh. It is written in the source
// format or as a .shm file, so it keeps the extras of the source format, except that they describe
// only the chosen steps.
#pragma once

#include <memory>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

class OwnSteps final : public ChosenSteps {
 public:
  // Returns the mesh with the given steps, or null if the source format cannot determine the extras
  // of such a mesh.
  static std::unique_ptr<OwnSteps> of(MeshSource& source, StepRange steps);

 private:
  OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras);
};

}  // namespace shm::converters
