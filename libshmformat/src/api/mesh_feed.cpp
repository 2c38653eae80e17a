#include "api/mesh_feed.h"

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "api/mesh_parts.h"
#include "base/errors.h"
#include "base/lists.h"

namespace shm {
namespace {

class MeshFeed {
 public:
  MeshFeed(MeshEncoder& encoder, const Schema& schema, const MeshArrays& mesh)
      : encoder_(&encoder),
        schema_(&schema),
        mesh_(&mesh),
        xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)),
        next_element_(schema.arrays.size()) {}

  Result<void> run() {
    if (auto status = check_cells(); !status) return status;
    if (auto status = check_arrays(); !status) return status;
    return add_cells();
  }

 private:
  std::uint32_t block_of(std::size_t cell) const {
    return mesh_->cell_blocks.empty() ? 0 : mesh_->cell_blocks[cell];
  }
  Result<void> check_cells();
  [[gnu::cold]] Result<void> check_arrays() const;
  /// Calls visit(values, bytes) with the values of each static point array for a vertex.
  template <class Visit>
  void for_each_value(std::size_t v, Visit&& visit) const;
  std::span<const std::byte> data_of_vertex(std::size_t v);
  std::span<const std::byte> data_of_cell(std::uint32_t block);
  Result<void> add_vertex(std::size_t v);
  Result<void> add_cell(std::uint32_t block, std::span<const std::uint64_t> corners);
  Result<void> add_cells();

  MeshEncoder* encoder_;
  const Schema* schema_;
  const MeshArrays* mesh_;
  std::size_t xyz_bytes_;
  std::vector<std::uint64_t> block_cells_;
  std::vector<FedVertex> vertices_;
  std::vector<std::size_t> next_element_;  // index of the next element of each cell array
  std::vector<std::uint64_t> corners_;     // corners of the current cell
  std::vector<std::byte> data_;
  std::vector<std::uint64_t> other_last_uses_;  // see Writer::add_cell()
};

/// Checks the cells of the mesh, and counts how often each vertex is used.
Result<void> MeshFeed::check_cells() {
  const auto cells = static_cast<std::size_t>(mesh_->cells);
  const NumberSpan& begin = mesh_->corner_begin;
  if (mesh_->xyz.size() % xyz_bytes_ != 0)
    return misuse("the number of coordinates is not a multiple of three", "mesh");
  if (!mesh_->cell_blocks.empty() && mesh_->cell_blocks.size() != cells)
    return misuse("cell_blocks does not match the number of cells", "mesh");
  if (!begin.empty() &&
      (begin.size() != cells + 1 || begin[0] != 0 || begin[cells] != mesh_->corners.size()))
    return misuse("corner_begin does not match cells and corners", "mesh");
  block_cells_.assign(schema_->blocks.size(), 0);
  vertices_.resize(mesh_->xyz.size() / xyz_bytes_);
  std::size_t corner = 0;
  for (std::size_t c = 0; c < cells; ++c) {
    const std::uint32_t block = block_of(c);
    if (block >= schema_->blocks.size())
      return misuse("a cell belongs to an unknown block: " + std::to_string(block), "mesh");
    ++block_cells_[block];
    std::uint64_t nodes = schema_->blocks[block].nodes_per_cell;
    if (begin.empty() && nodes == 0)
      return misuse("corner_begin is missing: a block has no fixed number of corners", "mesh");
    if (!begin.empty()) {
      if (begin[c] > begin[c + 1])
        return misuse("corner_begin does not match cells and corners", "mesh");
      if (nodes != 0 && begin[c + 1] - begin[c] != nodes)
        return misuse("cell " + std::to_string(c) +
                          " does not have the number of corners that its block states",
                      "mesh");
      nodes = begin[c + 1] - begin[c];
    }
    if (nodes > mesh_->corners.size() - corner) return misuse("corners are missing", "mesh");
    if (nodes > kMaxNodesPerCell)
      return misuse("a cell with " + std::to_string(nodes) + " corners", "mesh");
    for (const std::uint64_t v :
         mesh_->corners.part(corner, static_cast<std::size_t>(nodes), corners_)) {
      if (v >= vertices_.size())
        return misuse("a cell uses a vertex that does not exist: " + std::to_string(v), "mesh");
      std::uint32_t& uses = vertices_[static_cast<std::size_t>(v)].uses;
      uses += uses == FedVertex::kEndless ? 0 : 1;
    }
    corner += static_cast<std::size_t>(nodes);
  }
  return corner == mesh_->corners.size() ? Result<void>()
                                         : misuse("there are more corners than cells use", "mesh");
}

Result<void> MeshFeed::check_arrays() const {
  if (mesh_->arrays.size() != schema_->arrays.size())
    return misuse("arrays do not match the schema", "mesh");
  for (std::size_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.per_step) continue;
    std::uint64_t elements = info.location == Location::point ? vertices_.size() : 0;
    for (std::uint32_t b = 0; b < block_cells_.size() && info.location == Location::cell; ++b)
      if (schema_->array_covers(a, b)) elements += block_cells_[b];
    const std::uint64_t bytes = elements * stride_of(info);
    if (mesh_->arrays[a].size() != bytes)
      return misuse("array '" + info.name + "' does not have " + std::to_string(bytes) + " bytes",
                    "mesh");
  }
  return {};
}

template <class Visit>
void MeshFeed::for_each_value(std::size_t v, Visit&& visit) const {
  for (std::size_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.location != Location::point || info.per_step) continue;
    visit(mesh_->arrays[a].data() + v * stride_of(info), stride_of(info));
  }
}

/// Returns the values of the static point arrays for a vertex, one array after the other.
std::span<const std::byte> MeshFeed::data_of_vertex(std::size_t v) {
  data_.clear();
  for_each_value(v, [&](const std::byte* values, std::size_t bytes) {
    data_.insert(data_.end(), values, values + bytes);
  });
  return data_;
}
/// Returns the values of the static cell arrays for the next cell of the block.
std::span<const std::byte> MeshFeed::data_of_cell(std::uint32_t block) {
  data_.clear();
  for (std::size_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.location != Location::cell || info.per_step || !schema_->array_covers(a, block))
      continue;
    const std::byte* from = mesh_->arrays[a].data() + next_element_[a]++ * stride_of(info);
    data_.insert(data_.end(), from, from + stride_of(info));
  }
  return data_;
}

Result<void> MeshFeed::add_vertex(std::size_t v) {
  return encoder_->add_vertex(v, mesh_->xyz.subspan(v * xyz_bytes_, xyz_bytes_), data_of_vertex(v));
}

/// Adds a cell to an encoder that delays cells.
Result<void> MeshFeed::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners) {
  std::uint64_t last_use = 0;
  other_last_uses_.clear();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto v = static_cast<std::size_t>(corners[i]);
    FedVertex& vertex = vertices_[v];
    if (vertex.segment == kNone) {
      vertex.segment = 0;  // some segment
      if (auto status = add_vertex(v); !status) return status;
    }
    if (vertex.uses == FedVertex::kEndless || --vertex.uses > 0) continue;
    std::uint64_t marks = 0;
    for (std::size_t j = 0; j < std::min<std::size_t>(i + 1, kMaxLastUse); ++j)
      marks |= std::uint64_t{corners[j] == corners[i]} << j;
    if (marks == 0) other_last_uses_.push_back(corners[i]);
    last_use |= marks;
  }
  return encoder_->add_cell(block, corners, last_use, data_of_cell(block), other_last_uses_);
}

Result<void> MeshFeed::add_cells() {
  const auto put_values = [this](ShortRuns<std::byte>& runs, std::size_t v) {
    runs.append(mesh_->xyz.data() + v * xyz_bytes_, xyz_bytes_);
    for_each_value(v,
                   [&](const std::byte* values, std::size_t bytes) { runs.append(values, bytes); });
  };
  const NumberSpan& begin = mesh_->corner_begin;
  std::size_t next_corner = 0;
  for (std::size_t c = 0; c < static_cast<std::size_t>(mesh_->cells); ++c) {
    const std::uint32_t block = block_of(c);
    const std::size_t nodes = begin.empty() ? schema_->blocks[block].nodes_per_cell
                                            : static_cast<std::size_t>(begin[c + 1] - begin[c]);
    const auto corners = mesh_->corners.part(next_corner, nodes, corners_);
    next_corner += nodes;
    const auto status =
        encoder_->takes_fed_cells()
            ? encoder_->feed_cell(block, corners, vertices_, data_of_cell(block), put_values)
            : add_cell(block, corners);
    if (!status) return status;
  }
  for (std::size_t v = 0; v < vertices_.size(); ++v)
    if (vertices_[v].segment == kNone)
      if (auto status = add_vertex(v); !status) return status;
  return {};
}

}  // namespace

Result<void> feed_mesh(MeshEncoder& encoder, const Schema& schema, const MeshArrays& mesh) {
  return MeshFeed(encoder, schema, mesh).run();
}

}  // namespace shm
