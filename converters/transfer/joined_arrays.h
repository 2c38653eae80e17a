// JoinedArrays: the arrays of a mesh as another format needs them. Columns v_x, v_y, v_z become one
// array v. Arrays whose role is known only to their own format (maps, tags, attributes) become
// plain arrays, or are dropped if they have no meaning in other formats.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "interface/format.h"
#include "mesh/forwarding_mesh.h"

namespace shm::converters {

class JoinedArrays final : public ForwardingMesh {
 public:
  // `join`: join columns into vectors. `distinct`: blocks of different names or dimensions get
  // different numbers. Arrays of `maps` keep their roles; null: no such arrays.
  JoinedArrays(MeshSource& source, bool join, bool distinct, const NumberMaps* maps = nullptr);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  std::size_t run_of_columns(std::size_t first) const;
  void add(std::size_t first, std::size_t columns);
  void make_names_unique();
  void make_block_numbers_unique();

  const NumberMaps* maps_;
  std::vector<std::vector<std::size_t>> parts_;  // for each array: the arrays of the source
  std::vector<std::byte> column_;
};

}  // namespace shm::converters
