#include "transfer/own_steps.h"

#include <utility>

#include "transfer/format.h"

namespace shm::converters {

std::unique_ptr<OwnSteps> OwnSteps::of(MeshSource& source, StepRange steps) {
  auto extras = source_format(source.info()).extras_of_steps(source.info(), steps);
  if (!extras) return nullptr;
  return std::unique_ptr<OwnSteps>(new OwnSteps(source, steps, std::move(*extras)));
}

OwnSteps::OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras)
    : ChosenSteps(source, steps) {
  info_.extras = std::move(extras);
  // A file that holds one step has arrays that do not change with time.
  if (steps.size() == 1 && !source_format(source.info()).describes_steps(source.info()))
    for (ArrayInfo& array : info_.schema.arrays) array.per_step = false;
}

}  // namespace shm::converters
