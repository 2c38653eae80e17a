#include "mesh/blocks_by_id.h"

#include <algorithm>
#include <cstring>

namespace shm::converters {
namespace {

constexpr std::size_t kPieceCells = 16384;  // number of cells that are read together

// Maximum number of distinct values in an array of block numbers. An array with more distinct
// values is assumed not to contain block numbers.
constexpr std::size_t kMostBlocks = 4096;

}  // namespace

std::size_t BlocksById::array_of_ids(const MeshInfo& info) {
  const auto& arrays = info.schema.arrays;
  for (std::size_t a = 0; a < arrays.size(); ++a)
    if ((arrays[a].name == "BlockId" || arrays[a].name == "block_id") && !arrays[a].per_step &&
        arrays[a].location == Location::cell && arrays[a].components == 1 &&
        arrays[a].blocks.empty() && is_signed_integer(arrays[a].type))
      return a;
  return arrays.size();
}

BlocksById::BlocksById(MeshSource& source, std::size_t array,
                       const std::map<std::int64_t, std::string>& names,
                       const std::vector<Key>& first)
    : ForwardingMesh(source), array_(array) {
  info_ = source.info();
  find_blocks(names, first);
  info_.schema.arrays[array].role = kBlockIdRole;
}

void BlocksById::load_ids(std::size_t count) {
  const ScalarType type = source_.info().schema.arrays[array_].type;
  const std::size_t bytes = scalar_bytes(type);
  raw_.resize(count * bytes);
  ids_.resize(count);
  source_.read_array(array_, 0, next_cell_, count, raw_.data());
  const auto widen = [&](auto value) {
    for (std::size_t i = 0; i < count; ++i) {
      std::memcpy(&value, raw_.data() + i * bytes, bytes);
      ids_[i] = value;
    }
  };
  if (bytes == 1) widen(std::int8_t{});
  if (bytes == 2) widen(std::int16_t{});
  if (bytes == 4) widen(std::int32_t{});
  if (bytes == 8) widen(std::int64_t{});
}

auto BlocksById::keys() const -> std::vector<Key> {
  std::vector<Key> keys(blocks_.size());
  for (const auto& [key, block] : blocks_) keys[block] = key;
  keys.resize(std::min(keys.size(), kMostBlocks + 1));
  return keys;
}

void BlocksById::find_blocks(const std::map<std::int64_t, std::string>& names,
                             const std::vector<Key>& first) {
  std::vector<std::uint64_t> cells;
  for (const Key& key : first)
    if (blocks_.try_emplace(key, static_cast<std::uint32_t>(cells.size())).second)
      cells.push_back(0);
  useful_ = blocks_.size() <= kMostBlocks;
  CellBatch batch;
  source_.rewind_cells();
  while (useful_ && source_.next_cells(batch, kPieceCells)) {
    load_ids(batch.size());
    next_cell_ += batch.size();
    for (std::size_t i = 0; i < batch.size(); ++i) {
      const auto [entry, fresh] =
          blocks_.try_emplace({batch.blocks[i], ids_[i]}, static_cast<std::uint32_t>(cells.size()));
      if (fresh) cells.push_back(0);
      ++cells[entry->second];
    }
    useful_ = blocks_.size() <= kMostBlocks;
  }
  std::vector<BlockInfo> found(cells.size());
  for (const auto& [key, block] : blocks_) {
    found[block] = info_.schema.blocks[key.block];
    found[block].id = key.number;
    const auto name = names.find(key.number);
    found[block].name = name == names.end() ? std::string() : name->second;
  }
  info_.schema.blocks = std::move(found);
  info_.block_cells = std::move(cells);
}

void BlocksById::rewind_cells() {
  source_.rewind_cells();
  next_cell_ = 0;
}

bool BlocksById::next_cells(CellBatch& out, std::size_t max_cells) {
  if (!source_.next_cells(out, max_cells)) return false;
  load_ids(out.size());
  next_cell_ += out.size();
  for (std::size_t i = 0; i < out.size(); ++i) out.blocks[i] = blocks_.at({out.blocks[i], ids_[i]});
  return true;
}

}  // namespace shm::converters
