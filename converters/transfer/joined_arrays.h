// JoinedArrays: a mesh as another format sees its arrays. Columns v_x, v_y, v_z become one array v;
// arrays whose role only their own format knows (maps, tags, attributes) become plain ones, or go
// where no other format can make something of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/forwarding_mesh.h"
#include "transfer/format.h"

namespace shm::converters {

class JoinedArrays final : public ForwardingMesh {
 public:
  // `join`: the source has columns where the target has vectors. `distinct`: blocks of different
  // names or dimensions get different numbers. `maps`: stay what they are;
  // null: none.
  JoinedArrays(MeshSource& source, bool join, bool distinct, const NumberMaps* maps = nullptr);
  void read_array(std::size_t array, std::uint64_t step, std::uint64_t first, std::uint64_t count,
                  std::byte* out) override;

 private:
  std::size_t run_of_columns(std::size_t first) const;
  void add(std::size_t first, std::size_t columns);
  void make_names_unique();
  void make_block_numbers_unique();

  const NumberMaps* maps_;
  std::vector<std::vector<std::size_t>> parts_;  // of each array: arrays of the source
  std::vector<std::byte> column_;
};

}  // namespace shm::converters
