// Member functions of Mesh that return its properties and values, and functions that construct a
// Mesh from arrays.
#include <algorithm>
#include <cmath>
#include <limits>

#include "shm/mesh.h"

namespace shm {
std::array<double, 6> Mesh::bounds() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  std::array<double, 6> box{kInfinity, kInfinity, kInfinity, -kInfinity, -kInfinity, -kInfinity};
  const auto points = points_as<double>();
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i])) continue;
    box[i % 3] = std::min(box[i % 3], points[i]);
    box[3 + i % 3] = std::max(box[3 + i % 3], points[i]);
  }
  return box;
}

std::vector<std::array<std::uint64_t, 8>> Mesh::hexahedra(std::uint32_t block) const {
  std::vector<std::array<std::uint64_t, 8>> cells;
  if (block >= schema.blocks.size() || schema.blocks[block].shape != CellShape::hexahedron)
    return cells;
  for (std::size_t c = 0; c < cell_blocks.size(); ++c) {
    if (cell_blocks[c] != block || corner_begin[c + 1] - corner_begin[c] != 8) continue;
    const auto first = corners.begin() + static_cast<std::ptrdiff_t>(corner_begin[c]);
    std::copy(first, first + 8, cells.emplace_back().begin());
  }
  return cells;
}

std::optional<std::size_t> Mesh::find_array(Location location, std::string_view name) const {
  for (std::size_t a = 0; a < schema.arrays.size(); ++a)
    if (schema.arrays[a].location == location && schema.arrays[a].name == name) return a;
  return std::nullopt;
}

std::span<const std::byte> Mesh::values(std::size_t array, std::size_t step) const {
  if (array >= schema.arrays.size()) return {};
  if (!schema.arrays[array].per_step)
    return array < arrays.size() ? arrays[array] : std::span<const std::byte>();
  if (array >= steps.size() || step >= steps[array].size()) return {};
  return steps[array][step];
}

Mesh Mesh::of_hexahedra(std::span<const std::array<double, 3>> points,
                        std::span<const std::array<std::uint64_t, 8>> hexahedra) {
  Mesh mesh;
  mesh.schema.blocks.resize(1);  // the default block: hexahedra with 8 nodes
  const auto bytes = std::as_bytes(points);
  mesh.xyz.assign(bytes.begin(), bytes.end());
  mesh.cell_blocks.resize(hexahedra.size());
  for (const auto& corners : hexahedra) {
    mesh.corners.insert(mesh.corners.end(), corners.begin(), corners.end());
    mesh.corner_begin.push_back(mesh.corners.size());
  }
  return mesh;
}

std::size_t Mesh::add(std::string name, Location location, ScalarType type,
                      std::uint32_t components, std::span<const std::byte> values) {
  ArrayInfo info;
  info.name = std::move(name);
  info.location = location;
  info.type = type;
  info.components = components;
  schema.arrays.push_back(std::move(info));
  arrays.emplace_back(values.begin(), values.end());
  steps.resize(schema.arrays.size());
  return schema.arrays.size() - 1;
}

void Mesh::add_at(const std::string& name, Location location, ScalarType type,
                  std::uint32_t components, std::size_t step, std::span<const std::byte> values) {
  const auto fits = [&](const ArrayInfo& info) {
    return info.per_step && info.location == location && info.name == name && info.type == type &&
           info.components == components;
  };
  const auto found = std::find_if(schema.arrays.begin(), schema.arrays.end(), fits);
  std::size_t array = static_cast<std::size_t>(found - schema.arrays.begin());
  if (found == schema.arrays.end()) {
    array = add(name, location, type, components, {});
    schema.arrays[array].per_step = true;
    if (!is_on_mesh(location))
      schema.arrays[array].elements = values.size() / (scalar_bytes(type) * components);
  }
  auto& of_array = steps[array];
  if (of_array.size() <= step) of_array.resize(step + 1);
  of_array[step].assign(values.begin(), values.end());
}

}  // namespace shm
