#include "transfer/piece_output.h"

#include <set>
#include <string>

#include "mesh/extra_index.h"
#include "vtk/between/vtk_family.h"

namespace shm::converters {
namespace {

bool shm_holds_block(const BlockInfo& block) { return block.shape != CellShape::polyhedron; }

}  // namespace

const Holds kShmHolds = {.sets = Holds::Sets::sets,
                         .every_step = true,
                         .partial_arrays = true,
                         .block_numbers = true,
                         .block = shm_holds_block};

std::vector<TransferSet> take_sets(MeshInfo& whole) {
  std::set<std::string> told;
  std::vector<TransferSet> sets = transfer_sets(whole, told);
  std::erase_if(whole.extras, [&](const Extra& extra) {
    return (told.contains(extra.key) && extra.key != "mesh/title") ||
           extra.key == "gmsh/elements/blocks";
  });
  return sets;
}

FromElsewhere::FromElsewhere(MeshSource& source, const MeshInfo& whole) : ForwardingMesh(source) {
  info_ = source.info();
  if (vtk::is_numbered_anew(whole) && ExtraIndex(info_.extras).find(vtk::kNewNumbering) == nullptr)
    info_.extras.push_back({vtk::kNewNumbering, ScalarType::uint8, Reference::nothing, {0}, {}});
  // VTK's blocks are types of cells, which its writers know by the format.
  if (!info_.schema.source_format.starts_with("vt")) info_.schema.source_format.clear();
}

}  // namespace shm::converters
