// The cell types of UCD, and the conversion between UCD's order of nodes and that of the model. The
// two orders differ only for pyramids.
#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

#include "shm/schema.h"

namespace shm::converters::ucd {

struct CellType {
  std::string_view name;
  CellShape shape;
  std::uint32_t nodes;
};
inline constexpr std::array<CellType, 8> kCellTypes = {{
    {"pt", CellShape::vertex, 1},
    {"line", CellShape::line, 2},
    {"tri", CellShape::triangle, 3},
    {"quad", CellShape::quad, 4},
    {"tet", CellShape::tetrahedron, 4},
    {"pyr", CellShape::pyramid, 5},
    {"prism", CellShape::wedge, 6},
    {"hex", CellShape::hexahedron, 8},
}};

// Moves the apex of a pyramid from the first position (UCD's order) to the last position (the
// model's order).
inline void to_model_order(const CellType& type, std::span<std::uint64_t> nodes) {
  if (type.shape == CellShape::pyramid) std::rotate(nodes.begin(), nodes.begin() + 1, nodes.end());
}
inline void to_file_order(const CellType& type, std::span<std::uint64_t> nodes) {
  if (type.shape == CellShape::pyramid) std::rotate(nodes.begin(), nodes.end() - 1, nodes.end());
}

}  // namespace shm::converters::ucd
