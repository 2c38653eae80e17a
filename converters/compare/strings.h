// Converts the values of two string arrays. These values are indices into two different lists of
// strings. They are converted to indices into one common list.
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
  // Converts `count` indices (uint32) into the list of mesh A or B to indices into the common list.
  // Equal strings have the same common index.
  void translate(bool of_a, std::byte* places, std::uint64_t count) const;
  // Returns text such as "'steel'" for an index into the common list.
  std::string text(std::uint32_t place) const;

 private:
  std::vector<std::string> strings_;
  std::vector<std::uint32_t> from_a_, from_b_;
};

}  // namespace shm::converters
