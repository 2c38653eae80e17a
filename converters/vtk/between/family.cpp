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

namespace {

// Marks the blocks of quads, hexahedra and wedges for which an array of VTK states different orders
// along the axes of a cell.
void mark_uneven_orders(MeshSource& mesh, std::vector<bool>& marked) {
  constexpr std::size_t kBatch = 4096;
  const MeshInfo& info = mesh.info();
  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    const ArrayInfo& array = info.schema.arrays[a];
    if (array.name != "HigherOrderDegrees" || array.location != Location::cell || array.per_step ||
        array.components != 3 || !array.blocks.empty())
      continue;
    const std::size_t stride = info.array_stride(a), each = stride / 3;
    std::vector<std::byte> orders(kBatch * stride);
    CellBatch batch;
    std::uint64_t next = 0;
    for (mesh.rewind_cells(); mesh.next_cells(batch, kBatch); next += batch.size()) {
      mesh.read_array(a, 0, next, batch.size(), orders.data());
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const std::uint32_t block = batch.blocks[i];
        const CellShape shape = info.schema.blocks[block].shape;
        const bool is_solid = shape == CellShape::hexahedron || shape == CellShape::wedge;
        if (!is_solid && shape != CellShape::quad) continue;
        const std::byte* const of_cell = orders.data() + i * stride;
        const bool is_even = std::equal(of_cell, of_cell + each, of_cell + each) &&
                             (!is_solid || std::equal(of_cell, of_cell + each, of_cell + 2 * each));
        if (!is_even) marked[block] = true;
      }
    }
  }
}

}  // namespace

std::vector<std::size_t> blocks_with_own_nodes(MeshSource& mesh) {
  const std::vector<BlockInfo>& blocks = mesh.info().schema.blocks;
  std::vector<bool> marked(blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) marked[b] = !has_model_nodes(blocks[b]);
  mark_uneven_orders(mesh, marked);
  std::vector<std::size_t> found;
  for (std::size_t b = 0; b < blocks.size(); ++b)
    if (marked[b]) found.push_back(b);
  return found;
}

}  // namespace shm::converters::vtk
