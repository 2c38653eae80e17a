// OneStep: a mesh at one of its time steps.
#pragma once

#include <cstdint>

#include "forwarding_mesh.h"

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

}  // namespace shm::converters
