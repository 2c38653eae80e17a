// JoinedArrays: a mesh as another format sees its arrays. Columns v_x, v_y, v_z become one array v;
// arrays that only their own format has a word for (maps, tags, attributes) become plain ones.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

class JoinedArrays final : public ForwardingMesh {
 public:
  // `join`: the source has columns where the target has vectors. `distinct`: blocks of different
  // names or dimensions get different numbers. `exodus_maps`: number maps of Exodus stay what they
  // are.
  JoinedArrays(MeshSource& source, bool join, bool distinct, bool exodus_maps = false);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;
  // Without these arrays of the source: not in the result at all.
  static bool is_only_for_its_format(const ArrayInfo& array);

 private:
  std::size_t run_of_columns(std::size_t first) const;
  void add(std::size_t first, std::size_t columns);
  void name_apart();
  void number_blocks_apart();

  const bool exodus_maps_;
  std::vector<std::vector<std::size_t>> parts_;  // of each array: arrays of the source
  std::vector<std::byte> column_;
};

}  // namespace shm::converters
