#include "vtk/between/family.h"

namespace shm::converters::vtk {

Entry entry_of_array(const MeshInfo& info, std::size_t array) {
  const ArrayInfo& of = info.schema.arrays[array];
  return {.kind = EntryKind::array,
          .origin = Origin::array,
          .index = array,
          .name = encode_name(of.name),
          .type = std::string(word_of_scalar(of.type)),
          .components = of.components,
          .tuples = of.location == Location::cell    ? info.cells()
                    : of.location == Location::point ? info.vertices
                                                     : of.elements};
}

std::string quoted_array(std::string_view name) { return "array '" + std::string(name) + "'"; }

bool has_renumbered_cells(const MeshInfo& info) {
  return std::any_of(info.schema.blocks.begin(), info.schema.blocks.end(),
                     [](const BlockInfo& block) {
                       return block.id == kLagrangeHexahedron || block.id == kBezierHexahedron;
                     });
}

}  // namespace shm::converters::vtk
