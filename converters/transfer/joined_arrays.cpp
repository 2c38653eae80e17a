#include "transfer/joined_arrays.h"

#include <algorithm>
#include <cctype>
#include <cstring>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "formats/formats.h"
#include "mesh/blocks_by_id.h"
#include "mesh/unique_names.h"

namespace shm::converters {
namespace {

// Returns the lower-case suffix in the name of the array for component `c` of a vector: "_x", "_y"
// or "_z" if `numbered` is false, and "_1", "_2", ... if `numbered` is true. Vectors with more than
// three components have numbered suffixes.
std::string suffix(std::size_t c, bool numbered) {
  return numbered ? "_" + std::to_string(c + 1) : std::string("_") + "xyz"[c];
}

bool ends_with(std::string_view name, std::string_view end) {
  if (name.size() <= end.size()) return false;
  for (std::size_t i = 0; i < end.size(); ++i) {
    const auto c = static_cast<unsigned char>(name[name.size() - end.size() + i]);
    if (std::tolower(c) != end[i]) return false;
  }
  return true;
}

int dimension_of(CellShape shape) {
  switch (shape) {
    case CellShape::vertex: return 0;
    case CellShape::line: return 1;
    case CellShape::triangle:
    case CellShape::quad:
    case CellShape::polygon: return 2;
    default: return 3;
  }
}

// Returns true if the properties of two arrays are equal, except for their names.
bool alike(const ArrayInfo& a, const ArrayInfo& b) {
  ArrayInfo renamed = b;
  renamed.name = a.name;
  return a == renamed;
}

bool is_left_out(const ArrayInfo& array, const Capabilities& target) {
  return array.role == kBlockIdRole || role_of(array).is_private ||
         !target.has_arrays_at(array.location);
}

}  // namespace

JoinedArrays::JoinedArrays(MeshSource& source, bool join, const Capabilities& target)
    : ForwardingMesh(source), maps_(target.maps) {
  const MeshInfo& from = source.info();
  info_.schema = from.schema;
  info_.schema.arrays.clear();
  info_.vertices = from.vertices;
  info_.block_cells = from.block_cells;
  info_.step_times = from.step_times;
  for (std::size_t a = 0; a < from.schema.arrays.size();) {
    const std::size_t columns = join ? run_of_columns(a) : 1;
    if (!is_left_out(from.schema.arrays[a], target)) add(a, columns);
    a += columns;
  }
  make_names_unique();
  if (!target.block_numbers) make_block_numbers_unique();
}

void JoinedArrays::make_block_numbers_unique() {
  auto& blocks = info_.schema.blocks;
  std::int64_t highest = 0;
  for (const BlockInfo& block : blocks) highest = std::max(highest, block.id);
  std::map<std::int64_t, std::map<std::pair<int, std::string>, std::int64_t>> by_id;
  for (BlockInfo& block : blocks) {
    auto& same = by_id[block.id];
    const auto [entry, fresh] = same.try_emplace({dimension_of(block.shape), block.name}, block.id);
    if (fresh && same.size() > 1) entry->second = ++highest;
    block.id = entry->second;
  }
}

// Returns the number of consecutive arrays, starting at array `first`, that are the components of
// one vector: 2 or 3 arrays with the suffixes _x, _y, _z, or at least 4 arrays with the suffixes
// _1, _2, ... Returns 1 if no vector starts at array `first`.
std::size_t JoinedArrays::run_of_columns(std::size_t first) const {
  const auto& arrays = source_.info().schema.arrays;
  const ArrayInfo& head = arrays[first];
  if (head.components != 1 || !head.role.empty()) return 1;
  for (const bool numbered : {false, true}) {
    if (!ends_with(head.name, suffix(0, numbered))) continue;
    const std::string_view stem = std::string_view(head.name).substr(0, head.name.size() - 2);
    std::size_t columns = 1;
    while (first + columns < arrays.size() && (numbered || columns < 3)) {
      const ArrayInfo& next = arrays[first + columns];
      const std::string end = suffix(columns, numbered);
      if (!ends_with(next.name, end) || next.name.size() != stem.size() + end.size() ||
          next.name.substr(0, stem.size()) != stem || !alike(head, next))
        break;
      ++columns;
    }
    if (columns >= (numbered ? 4u : 2u)) return columns;
  }
  return 1;
}

void JoinedArrays::add(std::size_t first, std::size_t columns) {
  ArrayInfo info = source_.info().schema.arrays[first];
  const bool is_map =
      maps_ != nullptr && (info.role == maps_->vertices_role || info.role == maps_->cells_role ||
                           info.role == maps_->original_role);
  if (!is_map) info.role.clear();
  info.quantization = {};
  if (columns > 1) {
    info.components = static_cast<std::uint32_t>(columns);
    info.name.resize(info.name.size() - 2);
  }
  std::vector<std::size_t> parts;
  for (std::size_t c = 0; c < columns; ++c) parts.push_back(first + c);
  info_.schema.arrays.push_back(std::move(info));
  parts_.push_back(std::move(parts));
}

// Makes array names unique. Names may be equal because some formats distinguish arrays by their
// roles (e.g. number map or attribute) in addition to their names.
void JoinedArrays::make_names_unique() {
  UniqueNames names;
  for (ArrayInfo& array : info_.schema.arrays) array.name = names.take(array.location, array.name);
}

void JoinedArrays::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                              std::uint64_t count, std::byte* out) {
  const auto& parts = parts_[array];
  if (parts.size() == 1) return source_.read_array(parts[0], step, first, count, out);
  const std::size_t bytes = scalar_bytes(info_.schema.arrays[array].type);
  column_.resize(count * bytes);
  for (std::size_t c = 0; c < parts.size(); ++c) {
    source_.read_array(parts[c], step, first, count, column_.data());
    for (std::uint64_t i = 0; i < count; ++i)
      std::memcpy(out + (i * parts.size() + c) * bytes, column_.data() + i * bytes, bytes);
  }
}

}  // namespace shm::converters
