#include "transfer/piece_output.h"

#include "formats/formats.h"
#include "interface/format.h"
#include "transfer/mesh_sets.h"

namespace shm::converters {

std::vector<MeshSet> take_sets(MeshInfo& whole) {
  Keys used;
  std::vector<MeshSet> sets = transfer_sets(whole, used);
  const SourceFormat& format = source_format(whole);
  std::erase_if(whole.extras, [&](const Extra& extra) {
    return (used.contains(extra.key) && extra.key != "mesh/title") ||
           format.follows_from_blocks(extra);
  });
  erase_set_folders(whole.extras);
  return sets;
}

FromElsewhere::FromElsewhere(MeshSource& source, const MeshInfo& whole) : ForwardingMesh(source) {
  info_ = source.info();
  source_format(whole).mark_piece(whole, info_);
  // Remove the name of the source format, unless the block numbers of that format are cell types.
  // In that case, writers need the name, because it tells them the meaning of the numbers.
  if (!format_of(info_).capabilities.blocks_by_type) info_.schema.source_format.clear();
}

}  // namespace shm::converters
