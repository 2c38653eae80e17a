// ChosenSteps: a mesh reduced to a range of its time steps. PointsOfStep: a mesh with moving
// points, reduced to the positions of the points at one time step.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

// The steps from `first` to `end` - 1.
struct StepRange {
  std::uint64_t first = 0, end = 0;
  std::uint64_t size() const { return end - first; }
};

class ChosenSteps : public ForwardingMesh {
 public:
  ChosenSteps(MeshSource& source, StepRange steps) : ForwardingMesh(source), first_(steps.first) {
    info_ = source.info();
    const auto begin = source.info().step_times.begin();
    info_.step_times.assign(begin + static_cast<std::ptrdiff_t>(steps.first),
                            begin + static_cast<std::ptrdiff_t>(steps.end));
  }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    const bool stepped = source_.info().schema.arrays[array].per_step;
    source_.read_array(array, stepped ? first_ + step : step, first, count, out);
  }

 private:
  const std::uint64_t first_;
};

class PointsOfStep final : public ForwardingMesh {
 public:
  // `array` is the index of the array that contains the positions: three components per vertex, of
  // the same type as the coordinates.
  PointsOfStep(MeshSource& source, std::size_t array) : ForwardingMesh(source), array_(array) {
    info_ = source.info();
  }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    source_.read_array(array_, 0, first, count, out);
  }

 private:
  const std::size_t array_;
};

}  // namespace shm::converters
