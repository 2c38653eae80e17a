// JoinedArrays: adapts the arrays of a mesh to another format. Three arrays v_x, v_y, v_z with one
// component each become one array v with three components. If an array has a role that only its
// source format defines (such as number map, tag or attribute), the role is removed, and the array
// becomes a plain array. Arrays that have no meaning in other formats are dropped.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "interface/format.h"
#include "mesh/forwarding_mesh.h"

namespace shm::converters {

class JoinedArrays final : public ForwardingMesh {
 public:
  // If `join` is true, arrays with one component are joined into vectors. If the target format has
  // no block numbers, blocks with the same number but different names or dimensions get different
  // numbers. The number maps of the target keep their roles.
  JoinedArrays(MeshSource& source, bool join, const Capabilities& target);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  std::size_t run_of_columns(std::size_t first) const;
  void add(std::size_t first, std::size_t columns);
  void make_names_unique();
  void make_block_numbers_unique();

  const NumberMaps* maps_;
  // For each array of the result, the indices of the source arrays from which it is made.
  std::vector<std::vector<std::size_t>> parts_;
  std::vector<std::byte> column_;
};

}  // namespace shm::converters
