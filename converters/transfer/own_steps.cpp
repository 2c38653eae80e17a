#include "transfer/own_steps.h"

#include <utility>

#include "formats/formats.h"
#include "interface/format.h"

namespace shm::converters {

std::unique_ptr<OwnSteps> OwnSteps::of(MeshSource& source, StepRange steps) {
  auto extras = source_format(source.info()).extras_of_steps(source.info(), steps);
  if (!extras) return nullptr;
  return std::unique_ptr<OwnSteps>(new OwnSteps(source, steps, std::move(*extras)));
}

OwnSteps::OwnSteps(MeshSource& source, StepRange steps, std::vector<Extra> extras)
    : ChosenSteps(source, steps) {
  info_.extras = std::move(extras);
  const SourceFormat& format = source_format(source.info());
  if (steps.size() > 1 || format.describes_steps(source.info())) return;
  // This mesh corresponds to one file of a series, so it has no arrays that change with time. If
  // the source format does not store a time and the step times are 0, 1, 2, ..., they are only step
  // numbers and are removed.
  for (ArrayInfo& array : info_.schema.arrays) array.per_step = !is_on_mesh(array.location);
  Keys used;
  const std::vector<double>& times = source.info().step_times;
  bool numbered = !format.time(source.info(), used);
  for (std::size_t step = 0; step < times.size() && numbered; ++step)
    numbered = times[step] == static_cast<double>(step);
  if (numbered) info_.step_times.clear();
}

}  // namespace shm::converters
