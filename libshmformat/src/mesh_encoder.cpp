#include "mesh_encoder.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "bytes/checksum.h"
#include "scalar_value.h"

namespace shm {
namespace {

Error misuse(std::string detail) {
  return Error{ErrorCode::misuse, std::move(detail), "mesh", kNoOffset, {}};
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<double, 6> kEmptyBox = {kInfinity,  kInfinity,  kInfinity,
                                             -kInfinity, -kInfinity, -kInfinity};

}  // namespace

MeshEncoder::MeshEncoder(const Schema& schema, const WriteOptions& options, GroupSink sink)
    : schema_(&schema),
      options_(options),
      sink_(std::move(sink)),
      streams_(schema),
      xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)),
      values_bytes_(xyz_bytes_ + streams_.point_data_bytes()) {
  for (std::uint32_t b = 0; b < schema.blocks.size(); ++b) {
    std::size_t bytes = 0;
    for (std::uint32_t a : streams_.cell_arrays())
      if (schema.array_covers(a, b))
        bytes += scalar_bytes(schema.arrays[a].type) * schema.arrays[a].components;
    cell_data_bytes_.push_back(bytes);
    has_edge_nodes_ |=
        schema.blocks[b].shape == CellShape::hexahedron && schema.blocks[b].nodes_per_cell >= 20;
  }
  totals_.block_cells.resize(schema.blocks.size());
  range_of_array_.resize(schema.arrays.size());
  for (std::uint32_t a = 0; a < schema.arrays.size(); ++a) {
    if (schema.arrays[a].per_step) continue;
    range_of_array_[a] = totals_.ranges.size();
    const std::size_t n = schema.arrays[a].components;
    totals_.ranges.push_back(
        {a, std::vector<double>(n, kInfinity), std::vector<double>(n, -kInfinity)});
  }
  pointers_.resize(std::max(streams_.point_arrays().size(), streams_.cell_arrays().size()));
  group_.box = kEmptyBox;
  if (options.connectivity == ConnectivityCodec::paper)
    streams_.connectivity().set_codec(HexahedronCodec::paper);
}

Result<void> MeshEncoder::add_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                     std::span<const std::byte> data) {
  if (xyz.size() != xyz_bytes_ || data.size() != values_bytes_ - xyz_bytes_)
    return misuse("vertex " + std::to_string(number) + " has " +
                  std::to_string(xyz.size() + data.size()) + " bytes of values, the schema says " +
                  std::to_string(values_bytes_));
  if (by_number_.find(number) != kNone)
    return misuse("vertex " + std::to_string(number) + " is added twice");
  std::uint32_t entry = static_cast<std::uint32_t>(entries_.size());
  if (free_entries_.empty()) {
    entries_.emplace_back();
    values_.resize(values_.size() + values_bytes_);
  } else {
    entry = free_entries_.back();
    free_entries_.pop_back();
  }
  entries_[entry] = Entry{};
  entries_[entry].number = number;
  std::byte* values = values_.data() + entry * values_bytes_;
  std::copy(xyz.begin(), xyz.end(), values);
  std::copy(data.begin(), data.end(), values + xyz_bytes_);
  by_number_.insert(number, entry);
  return {};
}

Result<void> MeshEncoder::add_unused_vertex(std::uint64_t number, std::span<const std::byte> xyz,
                                            std::span<const std::byte> data) {
  if (auto good = add_vertex(number, xyz, data); !good) return good;
  return code_loose(by_number_.find(number));
}

Result<void> MeshEncoder::add_cell(std::uint32_t block, std::span<const std::uint64_t> corners,
                                   std::uint64_t last_use, std::span<const std::byte> data) {
  if (block >= schema_->blocks.size()) return misuse("cell of an unknown block");
  const BlockInfo& info = schema_->blocks[block];
  if (info.nodes_per_cell != 0 ? corners.size() != info.nodes_per_cell
                               : corners.size() > kMaxNodesPerCell)
    return misuse("cell with " + std::to_string(corners.size()) + " corners in a block of " +
                  std::to_string(info.nodes_per_cell));
  if (data.size() != cell_data_bytes_[block])
    return misuse("cell with " + std::to_string(data.size()) + " bytes of data, the schema says " +
                  std::to_string(cell_data_bytes_[block]));
  std::uint32_t handle = static_cast<std::uint32_t>(cells_.size());
  if (free_cells_.empty()) {
    cells_.emplace_back();
  } else {
    handle = free_cells_.back();
    free_cells_.pop_back();
  }
  WaitingCell& cell = cells_[handle];
  cell.block = block;
  cell.number = totals_.cells++;
  cell.data.assign(data.begin(), data.end());
  cell.entries.clear();
  for (std::uint64_t corner : corners) {
    const std::uint32_t entry = by_number_.find(corner);
    if (entry == kNone)
      return misuse("cell uses vertex " + std::to_string(corner) +
                    ", which was never added or is finalized");
    cell.entries.push_back(entry);
  }
  for (std::size_t i = 0; i < corners.size(); ++i) {
    Entry& entry = entries_[cell.entries[i]];
    ++entry.waiting;
    if (i >= kMaxLastUse || (last_use >> i & 1) == 0 || entry.ends) continue;
    entry.ends = true;  // its number is free from here on, though it may wait for its last cell
    by_number_.erase(entry.number);
  }
  if (schema_->delay == 0) return code(handle);
  if (info.shape == CellShape::hexahedron && info.nodes_per_cell >= 8) {
    SpiralReorderer::Corners eight{};
    std::copy_n(cell.entries.begin(), 8, eight.begin());
    reorderer_.push_hexahedron(handle, eight);
  } else {
    reorderer_.push_other(handle);
  }
  if (reorderer_.waiting() <= schema_->delay) return {};
  return code(reorderer_.pop());
}

Result<void> MeshEncoder::end() {
  while (reorderer_.waiting() > 0)
    if (auto good = code(reorderer_.pop()); !good) return good;
  // What is left has never been used: say it in ascending order.
  std::vector<std::uint32_t> loose;
  for (std::uint32_t e = 0; e < entries_.size(); ++e)
    if (entries_[e].slot == kNone && by_number_.find(entries_[e].number) == e) loose.push_back(e);
  std::sort(loose.begin(), loose.end(), [&](std::uint32_t a, std::uint32_t b) {
    return entries_[a].number < entries_[b].number;
  });
  for (std::uint32_t entry : loose)
    if (auto good = code_loose(entry); !good) return good;
  return group_.cells + group_.vertices > 0 ? flush_group() : Result<void>();
}

Result<void> MeshEncoder::code(std::uint32_t handle) {
  if (group_.loose_vertices > 0)  // they stand last in their group
    if (auto good = flush_group(); !good) return good;
  WaitingCell& cell = cells_[handle];
  topology_.block = cell.block;
  topology_.slots.clear();
  topology_.numbers.clear();
  topology_.last_use.clear();
  for (std::uint32_t e : cell.entries) --entries_[e].waiting;
  for (std::uint32_t e : cell.entries) {
    const Entry& entry = entries_[e];
    topology_.slots.push_back(entry.slot);
    topology_.numbers.push_back(e);  // unlike numbers, never the same for two that wait
    const bool marked = topology_.last_use.size() < kMaxLastUse && entry.ends && entry.waiting == 0;
    topology_.last_use.push_back(marked ? 1 : 0);
  }
  if (!streams_.code_cell(topology_)) return misuse("a cell cannot be coded");
  take_vertices(cell, topology_);
  streams_.code_cell_number(cell.number);
  code_cell_data(cell, topology_);
  if (options_.coding_order != nullptr) options_.coding_order->cell(cell.number);

  const std::uint64_t active = streams_.connectivity().surface().active_vertices();
  group_.max_active_vertices = std::max(group_.max_active_vertices, active);
  group_.decoded_bytes += cell.data.size() + 8 * cell.entries.size();
  ++group_.cells;
  ++totals_.block_cells[cell.block];
  totals_.hexahedra += topology_.hexahedral ? 1 : 0;
  streams_.finish_cell(topology_);
  for (std::uint32_t i = 0; i < topology_.slots.size(); ++i)
    if (topology_.last_use[i] != 0) free_entry(cell.entries[topology_.stored_position(i)]);
  free_cells_.push_back(handle);
  const bool full = group_.cells >= options_.group_cells || group_.decoded_bytes >= kFullGroupBytes;
  return full ? flush_group() : Result<void>();
}

void MeshEncoder::take_vertices(const WaitingCell& cell, const CellTopology& topology) {
  streams_.code_vertex_numbers(topology, [&](std::uint32_t position) -> std::uint64_t& {
    return entries_[entry_at(cell, topology, position)].number;
  });
  for_each_new_vertex(
      topology, topology.new_positions, [&](std::uint32_t position, const Stencil& stencil) {
        code_vertex(stencil, topology.slots[position], entry_at(cell, topology, position));
      });
}

void MeshEncoder::code_vertex(const Stencil& stencil, std::uint32_t slot, std::uint32_t e) {
  entries_[e].slot = slot;
  std::byte* values = values_.data() + e * values_bytes_;
  MeshStreams<RangeEncoder>::VertexValues vertex;
  vertex.xyz = values;
  std::byte* at = values + xyz_bytes_;
  for (std::size_t i = 0; i < streams_.point_arrays().size(); ++i) {
    const std::uint32_t a = streams_.point_arrays()[i];
    const ArrayInfo& info = schema_->arrays[a];
    pointers_[i] = at;
    widen_range(range_of_array_[a], info, at);
    at += scalar_bytes(info.type) * info.components;
  }
  vertex.data = pointers_;
  streams_.code_vertex(stencil, slot, vertex);
  for (std::size_t c = 0; c < 3; ++c) {
    const double v = scalar_value(schema_->coordinate_type, values, c);
    if (!std::isfinite(v)) continue;
    group_.box[c] = std::min(group_.box[c], v);
    group_.box[3 + c] = std::max(group_.box[3 + c], v);
  }
  ++group_.vertices;
  ++totals_.vertices;
  group_.decoded_bytes += values_bytes_;
  if (options_.coding_order != nullptr) options_.coding_order->vertex(entries_[e].number);
}

void MeshEncoder::code_cell_data(WaitingCell& cell, const CellTopology& topology) {
  std::byte* at = cell.data.data();
  for (std::size_t i = 0; i < streams_.cell_arrays().size(); ++i) {
    const std::uint32_t a = streams_.cell_arrays()[i];
    pointers_[i] = nullptr;
    if (!schema_->array_covers(a, cell.block)) continue;
    const ArrayInfo& info = schema_->arrays[a];
    pointers_[i] = at;
    widen_range(range_of_array_[a], info, at);
    at += scalar_bytes(info.type) * info.components;
  }
  streams_.code_cell_values(topology, pointers_);
}

Result<void> MeshEncoder::code_loose(std::uint32_t entry) {
  const std::uint32_t slot = streams_.connectivity().add_loose_vertex();
  streams_.code_loose_number(slot, entries_[entry].number);
  code_vertex(Stencil{}, slot, entry);
  ++group_.loose_vertices;
  const std::uint64_t active = streams_.connectivity().surface().active_vertices();
  group_.max_active_vertices = std::max(group_.max_active_vertices, active);
  streams_.connectivity().remove_loose_vertex(slot);
  free_entry(entry);
  const bool full =
      group_.vertices >= kFullGroupVertices || group_.decoded_bytes >= kFullGroupBytes;
  return full ? flush_group() : Result<void>();
}

void MeshEncoder::free_entry(std::uint32_t entry) {
  if (!entries_[entry].ends) by_number_.erase(entries_[entry].number);
  free_entries_.push_back(entry);
}

void MeshEncoder::widen_range(std::size_t range, const ArrayInfo& info, const std::byte* element) {
  auto& [array, minimum, maximum] = totals_.ranges[range];
  for (std::size_t c = 0; c < info.components; ++c) {
    const double v = scalar_value(info.type, element, c);
    if (!std::isfinite(v)) continue;
    minimum[c] = std::min(minimum[c], v);
    maximum[c] = std::max(maximum[c], v);
  }
}

Result<void> MeshEncoder::flush_group() {
  const auto names = MeshStreams<RangeEncoder>::list(*schema_);
  std::vector<std::vector<std::byte>> payloads;
  for (std::size_t s = 0; s < names.size(); ++s) {
    std::vector<std::byte> bytes = streams_.coders()[s].finish();
    container::StreamEntry entry;
    entry.kind = names[s].kind;
    entry.array = names[s].array;
    // An absent stream reads as zeros; connectivity is there to tell its codec.
    if (bytes.empty() && (entry.kind != container::StreamKind::connectivity || group_.cells == 0))
      continue;
    const bool values = entry.kind >= container::StreamKind::vertex_numbers;
    const bool paper = options_.connectivity == ConnectivityCodec::paper;
    entry.codec = values  ? container::Codec::predictive
                  : paper ? container::Codec::paper
                          : container::Codec::rows;
    const auto needs = [&](container::StreamKind kind) {
      entry.needs |= 1u << static_cast<unsigned>(kind);
    };
    if (entry.kind != container::StreamKind::connectivity)
      needs(container::StreamKind::connectivity);
    const bool by_corner = entry.kind == container::StreamKind::vertex_numbers;
    if (by_corner || (values && has_edge_nodes_))  // numbers in stored order; midpoints of edges
      needs(container::StreamKind::corner_order);
    entry.bytes = bytes.size();
    entry.checksum = checksum(bytes);
    group_.streams.push_back(entry);
    payloads.push_back(std::move(bytes));
  }
  totals_.max_active_vertices = std::max(totals_.max_active_vertices, group_.max_active_vertices);
  container::GroupHeader done = std::exchange(group_, {});
  group_.box = kEmptyBox;
  group_.first_cell = done.first_cell + done.cells;
  group_.first_vertex = done.first_vertex + done.vertices;
  return sink_(done, payloads);
}

}  // namespace shm
