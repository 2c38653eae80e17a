// OwnSteps: a mesh at some of its time steps, as its own format and .shm files take it: its extras
// are those of these steps.
#pragma once

#include <memory>
#include <vector>

#include "mesh/chosen_steps.h"

namespace shm::converters {

class OwnSteps final : public ChosenSteps {
 public:
  // Null where its format cannot say what of its extras belongs to which step.
  static std::unique_ptr<OwnSteps> of(MeshSource& source, StepRange steps);

 private:
  OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras);
};

}  // namespace shm::converters
