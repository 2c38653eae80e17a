#include "mesh/mesh_source.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

template <class T>
Extra extra_of(std::string key, ScalarType type, Reference refers, std::span<const T> values) {
  const auto bytes = std::as_bytes(values);
  Extra extra{std::move(key), type, refers, {values.size()}, {}};
  extra.data.assign(bytes.begin(), bytes.end());
  return extra;
}

// Returns `count` times `each`, or the largest 64-bit number if the product is larger.
std::uint64_t times(std::uint64_t count, std::uint64_t each) {
  return each > 0 && count > ~std::uint64_t{0} / each ? ~std::uint64_t{0} : count * each;
}

}  // namespace

void require_within(const MeshLimits& limits, std::uint64_t vertices, std::uint64_t cells,
                    std::uint64_t bytes, const std::string& name) {
  const auto require = [&](std::uint64_t count, std::uint64_t limit, const std::string& what) {
    if (count > limit)
      throw Failure(ErrorCode::over_limit,
                    "has more " + what + " than the limit of " + std::to_string(limit), name);
  };
  require(vertices, limits.most, "vertices");
  require(cells, limits.most, "cells");
  require(bytes, limits.bytes, "bytes of numbers");
}

void require_within(const MeshLimits& limits, const MeshInfo& info, const std::string& name) {
  std::uint64_t bytes = times(info.vertices, 3 * scalar_bytes(info.schema.coordinate_type));
  const auto add = [&](std::uint64_t more) { bytes += std::min(more, ~bytes); };
  std::uint64_t cells = 0;
  for (std::size_t b = 0; b < info.schema.blocks.size(); ++b) {
    cells += info.block_cells[b];
    add(times(info.block_cells[b], 8 * std::uint64_t{info.schema.blocks[b].nodes_per_cell}));
  }
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    const std::uint64_t steps = info.schema.arrays[a].per_step ? info.step_times.size() : 1;
    add(times(times(info.array_elements(a), info.array_stride(a)), steps));
  }
  require_within(limits, info.vertices, cells, bytes, name);
}

std::string kind_of_cells(const BlockInfo& block) {
  const std::string shape(shape_name(block.shape));
  return block.scheme == NodeScheme::lagrange
             ? shape
             : std::string(scheme_name(block.scheme)) + " " + shape;
}

const Extra* find_extra(const MeshInfo& info, std::string_view key) {
  for (const Extra& extra : info.extras)
    if (extra.key == key) return &extra;
  return nullptr;
}

std::string text_of_extra(const Extra& extra) {
  if (extra.type != ScalarType::uint8 || extra.data.empty()) return {};
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

std::vector<std::int64_t> integers_of_extra(const Extra& extra) {
  std::vector<std::int64_t> values;
  const auto read = [&](auto value) {
    for (std::size_t offset = 0; offset + sizeof value <= extra.data.size();
         offset += sizeof value) {
      std::memcpy(&value, extra.data.data() + offset, sizeof value);
      values.push_back(value);
    }
  };
  if (extra.type == ScalarType::int32) read(std::int32_t{});
  if (extra.type == ScalarType::int64) read(std::int64_t{});
  return values;
}

Extra text_extra(std::string key, std::string_view text) {
  return extra_of(std::move(key), ScalarType::uint8, Reference::nothing, std::span(text));
}

Extra integers_extra(std::string key, const std::vector<std::int64_t>& values, Reference refers) {
  return extra_of(std::move(key), ScalarType::int64, refers, std::span(values));
}

Extra integers_extra(std::string key, const std::vector<std::int32_t>& values, Reference refers) {
  return extra_of(std::move(key), ScalarType::int32, refers, std::span(values));
}

}  // namespace shm::converters
