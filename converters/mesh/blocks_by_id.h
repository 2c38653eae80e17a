// BlocksById: a mesh whose blocks are those of an integer of each cell, as formats without blocks
// of their own keep them, split into these blocks.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

// Role of the array of numbers in the result, which its blocks have.
inline constexpr const char* kBlockIdRole = "block_id";

class BlocksById final : public ForwardingMesh {
 public:
  // A block of the source, and a number of its cells.
  struct Key {
    std::uint32_t block = 0;
    std::int64_t number = 0;
    auto operator<=>(const Key&) const = default;
  };
  // `array`: of integers, one for each cell, static, on all blocks. `names` of blocks by number.
  // `first`: keys whose blocks come first, whether the mesh has such cells or not; distinct.
  BlocksById(MeshSource& source, std::size_t array,
             const std::map<std::int64_t, std::string>& names, const std::vector<Key>& first = {});
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Index of the array of blocks: "BlockId" or "block_id"; none: the number of arrays.
  static std::size_t array_of_ids(const MeshInfo& info);
  bool useful() const { return useful_; }  // false: too many numbers to be those of blocks
  // Of each block. Where it is not useful: one more than there may be.
  std::vector<Key> keys() const;

 private:
  void find_blocks(const std::map<std::int64_t, std::string>& names, const std::vector<Key>& first);
  void load_ids(std::size_t count);

  const std::size_t array_;
  std::map<Key, std::uint32_t> blocks_;
  std::vector<std::int64_t> ids_;  // of the batch
  std::vector<std::byte> raw_;
  std::uint64_t next_cell_ = 0;
  bool useful_ = true;
};

}  // namespace shm::converters
