// OwnSteps: some time steps of a mesh, for a writer of the same format or of .shm files. The extras
// of the mesh are adapted to these steps.
#pragma once

#include <memory>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

class OwnSteps final : public ChosenSteps {
 public:
  // Returns null if the format cannot determine which of its extras belong to which step.
  static std::unique_ptr<OwnSteps> of(MeshSource& source, StepRange steps);

 private:
  OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras);
};

}  // namespace shm::converters
