// JoinedArrays: adapts the arrays of a mesh to another format. Arrays v_x, v_y, v_z with one
// component become one array v with three components. Arrays whose role only their own format
// defines (maps, tags, attributes) become plain arrays; arrays that have no meaning in other
// formats are dropped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "interface/format.h"
#include "mesh/forwarding_mesh.h"

namespace shm::converters {

class JoinedArrays final : public ForwardingMesh {
 public:
  // `join`: true to join arrays of one component into vectors. `distinct`: true to give different
  // numbers to blocks with different names or dimensions. `maps`: number maps that keep their
  // roles; null if none exist.
  JoinedArrays(MeshSource& source, bool join, bool distinct, const NumberMaps* maps = nullptr);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  std::size_t run_of_columns(std::size_t first) const;
  void add(std::size_t first, std::size_t columns);
  void make_names_unique();
  void make_block_numbers_unique();

  const NumberMaps* maps_;
  // For each array of the result, the indices of its source arrays.
  std::vector<std::vector<std::size_t>> parts_;
  std::vector<std::byte> column_;
};

}  // namespace shm::converters
