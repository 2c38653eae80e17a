// OwnSteps: a mesh at some of its time steps, for a writer of its own format or of .shm files: its
// extras are adapted to these steps.
#pragma once

#include <memory>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

class OwnSteps final : public ChosenSteps {
 public:
  // Returns null if the format does not know which of its extras belong to which step.
  static std::unique_ptr<OwnSteps> of(MeshSource& source, StepRange steps);

 private:
  OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras);
};

}  // namespace shm::converters
