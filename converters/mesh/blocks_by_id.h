// BlocksById: divides a mesh into blocks according to an array that contains the block number of
// each cell. Formats without blocks store block numbers in such an array.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

// Role of the array of block numbers in the resulting mesh.
inline constexpr const char* kBlockIdRole = "block_id";

class BlocksById final : public ForwardingMesh {
 public:
  // Identifies a block of the result. All cells of this block are in the same block of the source
  // (`block`) and have the same value in the array of block numbers (`number`).
  struct Key {
    std::uint32_t block = 0;
    std::int64_t number = 0;
    auto operator<=>(const Key&) const = default;
  };
  // `array` is the index of a static integer array that covers all blocks and has one value per
  // cell. `names` maps block numbers to block names. `first` lists the keys of the blocks that come
  // first in the result, even if these blocks have no cells. The keys in `first` are distinct.
  BlocksById(MeshSource& source, std::size_t array,
             const std::map<std::int64_t, std::string>& names, const std::vector<Key>& first = {});
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Returns the index of the array of block numbers, which is named "BlockId" or "block_id".
  // If no such array exists, returns the number of arrays in the mesh.
  static std::size_t array_of_ids(const MeshInfo& info);
  // Returns false if the array has too many distinct values to be an array of block numbers.
  bool useful() const { return useful_; }
  // Returns the key of each block. If useful() is false, the list is incomplete: it contains one
  // key more than the maximum number of blocks.
  std::vector<Key> keys() const;

 private:
  void find_blocks(const std::map<std::int64_t, std::string>& names, const std::vector<Key>& first);
  void load_ids(std::size_t count);

  const std::size_t array_;
  std::map<Key, std::uint32_t> blocks_;
  std::vector<std::int64_t> ids_;  // block numbers of the current batch
  std::vector<std::byte> raw_;
  std::uint64_t next_cell_ = 0;
  bool useful_ = true;
};

}  // namespace shm::converters
