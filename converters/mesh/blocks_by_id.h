// BlocksById: divides a mesh into blocks by an integer that each cell has. Formats that have no
// blocks store blocks in this way.
#pragma once

#include <compare>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "mesh/forwarding_mesh.h"

namespace shm::converters {

// Role that the array of block numbers gets in the resulting mesh.
inline constexpr const char* kBlockIdRole = "block_id";

class BlocksById final : public ForwardingMesh {
 public:
  // Key of a resulting block: the block of the source, and the number that the cells of the
  // resulting block have.
  struct Key {
    std::uint32_t block = 0;
    std::int64_t number = 0;
    auto operator<=>(const Key&) const = default;
  };
  // `array` is a static integer array with one value per cell, on all blocks. `names` contains the
  // names of blocks by number. `first` lists distinct keys whose blocks come first, even if the
  // mesh has no such cells.
  BlocksById(MeshSource& source, std::size_t array,
             const std::map<std::int64_t, std::string>& names, const std::vector<Key>& first = {});
  bool next_cells(CellBatch& out, std::size_t max_cells) override;
  void rewind_cells() override;
  // Returns the index of the array of block numbers, which is named "BlockId" or "block_id".
  // Returns the number of arrays if no such array exists.
  static std::size_t array_of_ids(const MeshInfo& info);
  // Returns false if the array has too many different numbers to be block numbers.
  bool useful() const { return useful_; }
  // Returns the key of each block. If the mesh is not useful(), the list ends after one key more
  // than the maximum number of blocks.
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
