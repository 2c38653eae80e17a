// Two arrays of strings, whose values are places in two lists, as places in one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"

namespace shm::converters {

class CommonStrings {
 public:
  CommonStrings(const MeshInfo& a, std::size_t array_a, const MeshInfo& b, std::size_t array_b);
  // Makes `count` places (uint32) in the list of A or B those in the common one, where the same
  // string has the same place.
  void translate(bool of_a, std::byte* places, std::uint64_t count) const;
  // "'steel'", of a place in the common list.
  std::string text(std::uint32_t place) const;

 private:
  std::vector<std::string> strings_;
  std::vector<std::uint32_t> from_a_, from_b_;
};

}  // namespace shm::converters
