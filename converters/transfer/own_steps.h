// OwnSteps: a mesh reduced to some of its time steps, for a writer of its source format or of .shm
// files. Its extras describe only these steps.
#pragma once

#include <memory>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

class OwnSteps final : public ChosenSteps {
 public:
  // Returns null if the source format cannot determine which of its extras belong to which step.
  static std::unique_ptr<OwnSteps> of(MeshSource& source, StepRange steps);

 private:
  OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras);
};

}  // namespace shm::converters
