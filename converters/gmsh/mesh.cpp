#include "gmsh/mesh.h"

#include <algorithm>

namespace shm::converters {

GmshMesh::GmshMesh(Spool& spool)
    : points_(spool, 3 * sizeof(double)),
      cell_blocks_(spool, sizeof(std::uint32_t)),
      cell_sizes_(spool, sizeof(std::uint32_t)),
      corners_(spool, sizeof(std::uint64_t)) {
  info_.schema.source_format = "gmsh";
  info_.schema.coordinate_type = ScalarType::float64;
}

void GmshMesh::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  points_.read(first, count, out);
}

void GmshMesh::rewind_cells() { next_cell_ = next_size_ = next_corner_ = 0; }

bool GmshMesh::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  const std::uint64_t count = std::min<std::uint64_t>(cell_blocks_.size() - next_cell_, max_cells);
  if (count == 0) return false;
  out.blocks.resize(count);
  cell_blocks_.read(next_cell_, count, reinterpret_cast<std::byte*>(out.blocks.data()));
  next_cell_ += count;
  out.corner_begin.reserve(count + 1);
  std::uint64_t corners = 0;
  for (const std::uint32_t block : out.blocks) {
    const std::uint32_t nodes = info_.schema.blocks[block].nodes_per_cell;
    corners += nodes != 0 ? nodes : cell_sizes_.get<std::uint32_t>(next_size_++);
    out.corner_begin.push_back(corners);
  }
  out.corners.resize(corners);
  corners_.read(next_corner_, corners, reinterpret_cast<std::byte*>(out.corners.data()));
  next_corner_ += corners;
  return true;
}

void GmshMesh::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                          std::uint64_t count, std::byte* out) {
  const std::uint64_t components = info_.schema.arrays[array].components;
  values_[array][step].read(first * components, count * components, out);
}

void GmshTags::append(std::int64_t tag) {
  if (size_ == 0) {
    first_ = lowest_ = highest_ = tag;
  } else if (run_ && tag != static_cast<std::int64_t>(static_cast<std::uint64_t>(first_) + size_)) {
    run_ = false;
    for (std::uint64_t i = 0; i < size_; ++i) tags_.set(i, first_ + static_cast<std::int64_t>(i));
  }
  lowest_ = std::min(lowest_, tag);
  highest_ = std::max(highest_, tag);
  if (!run_) tags_.set(size_, tag);
  ++size_;
}

void GmshTags::finish() {
  if (run_) return;
  const std::uint64_t span =
      static_cast<std::uint64_t>(highest_) - static_cast<std::uint64_t>(lowest_);
  dense_ = span / 8 <= size_ + 512;
  if (!dense_) sparse_.reserve(size_);
  for (std::uint64_t i = 0; i < size_; ++i) {
    const auto tag = tags_.get<std::int64_t>(i);
    if (!dense_) {
      sparse_.emplace_back(tag, i);
      continue;
    }
    const std::uint64_t index =
        static_cast<std::uint64_t>(tag) - static_cast<std::uint64_t>(lowest_);
    if (index >= places_.size() || places_.get<std::uint64_t>(index) == 0)
      places_.set<std::uint64_t>(index, i + 1);
  }
  std::sort(sparse_.begin(), sparse_.end());  // entries with equal tags are sorted by index
}

PagedArray GmshTags::take_listed() {
  for (std::uint64_t i = 0; run_ && i < size_; ++i)
    tags_.set(i, static_cast<std::int64_t>(static_cast<std::uint64_t>(first_) + i));
  return std::move(tags_);
}

std::optional<std::uint64_t> GmshTags::find(std::int64_t tag) {
  if (size_ == 0 || tag < lowest_ || tag > highest_) return std::nullopt;
  const std::uint64_t index = static_cast<std::uint64_t>(tag) - static_cast<std::uint64_t>(lowest_);
  if (run_) return index;
  if (dense_) {
    const auto place = places_.get<std::uint64_t>(index);
    return place != 0 ? std::optional(place - 1) : std::nullopt;
  }
  const auto found =
      std::lower_bound(sparse_.begin(), sparse_.end(), std::pair(tag, std::uint64_t{0}));
  if (found == sparse_.end() || found->first != tag) return std::nullopt;
  return found->second;
}

void GmshReading::add_extra(std::string key, ScalarType type, std::vector<std::uint64_t> shape,
                            const void* data, Reference refers) {
  std::uint64_t values = 1;
  for (const std::uint64_t n : shape) values *= n;
  Extra extra{std::move(key), type, refers, std::move(shape), {}};
  const auto* bytes = static_cast<const std::byte*>(data);
  if (values > 0) extra.data.assign(bytes, bytes + values * scalar_bytes(type));
  mesh->info_.extras.push_back(std::move(extra));
}

void GmshReading::add_text(std::string key, std::string_view text) {
  add_extra(std::move(key), ScalarType::uint8, {text.size()}, text.data());
}

void GmshReading::add_role_array(const std::string& role, Location location, ScalarType type,
                                 std::uint32_t components, PagedArray values,
                                 std::vector<std::uint32_t> blocks) {
  ArrayInfo info;
  info.name = info.role = role;
  info.location = location;
  info.type = type;
  info.components = components;
  info.blocks = std::move(blocks);
  mesh->info_.schema.arrays.push_back(std::move(info));
  mesh->values_.emplace_back().push_back(std::move(values));
}

}  // namespace shm::converters
