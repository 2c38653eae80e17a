#include "compression/set_sides.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>

#include "compression/piece_mesh.h"
#include "sets/cell_sides.h"

namespace shm::converters {
namespace {

constexpr const char* kSideNumbers = "shm_side";

// Gathers the elements with the indices `wanted`: stores them one after another in `out`. Each
// element has `stride` bytes. Calls read(first, count, out) for each run of consecutive indices.
template <class Read>
void gather(std::span<const std::uint64_t> wanted, std::size_t stride, std::byte* out,
            Read&& read) {
  for (std::size_t i = 0; i < wanted.size();) {
    std::size_t run = 1;
    while (i + run < wanted.size() && wanted[i + run] == wanted[i] + run) ++run;
    read(wanted[i], run, out + i * stride);
    i += run;
  }
}

}  // namespace

SetSides::SetSides(MeshSource& source, const MeshSet& set, bool flat,
                   const std::vector<std::uint64_t>& cell_numbers)
    : ForwardingMesh(source) {
  const MeshInfo& from = source.info();
  info_.schema.coordinate_type = from.schema.coordinate_type;
  info_.schema.source_format = from.schema.source_format;
  info_.step_times = from.step_times;
  info_.extras = from.extras;
  std::erase_if(info_.extras, [](const Extra& extra) { return extra.key.starts_with("mesh/"); });
  find_sides(set, flat, cell_numbers);
  number_vertices();
  for (std::size_t a = 0; a < from.schema.arrays.size(); ++a) {
    if (from.schema.arrays[a].location != Location::point) continue;
    info_.schema.arrays.push_back(from.schema.arrays[a]);
    arrays_.push_back(a);
  }
  for (const char* name : {kCellNumbers, kSideNumbers}) {
    ArrayInfo array;
    array.name = name;
    array.location = Location::cell;
    array.type = ScalarType::int64;
    info_.schema.arrays.push_back(std::move(array));
  }
}

void SetSides::find_sides(const MeshSet& set, bool flat,
                          const std::vector<std::uint64_t>& cell_numbers) {
  std::vector<std::size_t> order(set.members.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return set.members[a] < set.members[b]; });
  SideFinder finder;
  std::map<CellKind, std::uint32_t> blocks;
  std::size_t next = 0;
  std::uint64_t cell = 0;
  CellBatch batch;
  source_.rewind_cells();
  while (next < order.size() && source_.next_cells(batch, kCellsAtOnce)) {
    for (std::size_t i = 0; i < batch.size(); ++i, ++cell) {
      for (; next < order.size() && set.members[order[next]] == cell; ++next) {
        const std::int32_t side = set.sides[order[next]];
        CellSide found = finder.side_of_cell(source_.info().schema.blocks[batch.blocks[i]],
                                             batch.cell(i), static_cast<std::uint64_t>(side), flat);
        if (found.nodes.empty()) {
          ++left_out_;
          continue;
        }
        const auto fresh = static_cast<std::uint32_t>(blocks.size());
        const auto [entry, is_new] = blocks.try_emplace(found.kind, fresh);
        if (is_new) {
          const auto id = static_cast<std::int64_t>(static_cast<std::uint64_t>(set.id) + fresh);
          info_.schema.blocks.push_back(
              {id, short_name_of(set), found.kind.shape, found.kind.nodes, found.kind.scheme});
          info_.block_cells.push_back(0);
        }
        ++info_.block_cells[entry->second];
        const std::uint64_t number = cell_numbers[cell];
        sides_.push_back(
            {entry->second, static_cast<std::int64_t>(number), side, std::move(found.nodes)});
      }
    }
  }
}

void SetSides::number_vertices() {
  for (const Side& side : sides_)
    vertices_.insert(vertices_.end(), side.nodes.begin(), side.nodes.end());
  std::sort(vertices_.begin(), vertices_.end());
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
  for (Side& side : sides_)
    for (std::uint64_t& node : side.nodes) node = rank_of(vertices_, node).value();
  info_.vertices = vertices_.size();
}

void SetSides::read_points(std::uint64_t first, std::uint64_t count, std::byte* out) {
  gather(std::span(vertices_).subspan(first, count), 3 * scalar_bytes(info_.schema.coordinate_type),
         out, [&](std::uint64_t from, std::uint64_t run, std::byte* to) {
           source_.read_points(from, run, to);
         });
}

bool SetSides::next_cells(CellBatch& out, std::size_t max_cells) {
  out.clear();
  for (; out.size() < max_cells && next_side_ < sides_.size(); ++next_side_) {
    const Side& side = sides_[next_side_];
    out.blocks.push_back(side.block);
    out.corners.insert(out.corners.end(), side.nodes.begin(), side.nodes.end());
    out.corner_begin.push_back(out.corners.size());
  }
  return out.size() > 0;
}

void SetSides::read_array(std::size_t array, std::uint64_t step, std::uint64_t first,
                          std::uint64_t count, std::byte* out) {
  if (array < arrays_.size())
    return gather(std::span(vertices_).subspan(first, count), info_.array_stride(array), out,
                  [&](std::uint64_t from, std::uint64_t run, std::byte* to) {
                    source_.read_array(arrays_[array], step, from, run, to);
                  });
  for (std::uint64_t i = 0; i < count; ++i) {
    const Side& side = sides_[first + i];
    const std::int64_t value = array == arrays_.size() ? side.cell : side.side;
    std::memcpy(out + i * sizeof value, &value, sizeof value);
  }
}

}  // namespace shm::converters
