// BlocksById: a mesh whose blocks are told by an integer of each cell, as formats without blocks of
// their own keep them, split into these blocks.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "forwarding_mesh.h"

namespace shm::converters {

class BlocksById final : public ForwardingMesh {
 public:
  // `array`: of integers, one for each cell, static, on all blocks. `names` of blocks by number.
  BlocksById(MeshSource& source, std::size_t array,
             const std::map<std::int64_t, std::string>& names);
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Index of the array that tells blocks: "BlockId" or "block_id"; none: the number of arrays.
  static std::size_t array_of_ids(const MeshInfo& info);
  bool useful() const { return useful_; }  // false: too many numbers to be those of blocks

 private:
  void find_blocks(const std::map<std::int64_t, std::string>& names);
  void load_ids(std::size_t count);

  const std::size_t array_;
  std::map<std::pair<std::uint32_t, std::int64_t>, std::uint32_t> blocks_;
  std::vector<std::int64_t> ids_;  // of the batch
  std::vector<std::byte> raw_;
  std::uint64_t next_cell_ = 0;
  bool useful_ = true;
};

}  // namespace shm::converters
