// OneStep: a mesh at one of its time steps. PointsOfStep: its points there, where they move.
#pragma once

#include <cstddef>
#include <cstdint>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

class OneStep final : public ForwardingMesh {
 public:
  OneStep(MeshSource& source, std::uint64_t step) : ForwardingMesh(source), step_(step) {
    info_ = source.info();
    info_.step_times = {info_.step_times[step]};
  }
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override {
    const bool stepped = info_.schema.arrays[array].per_step;
    source_.read_array(array, stepped ? step_ : step, first, count, out);
  }

 private:
  const std::uint64_t step_;
};

class PointsOfStep final : public ForwardingMesh {
 public:
  // `array`: of three components for each vertex, of the type of the coordinates.
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
