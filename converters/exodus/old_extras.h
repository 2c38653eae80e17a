// Extras of Exodus meshes as files before 0.10 have them.
#pragma once

#include "mesh/mesh_source.h"

namespace shm::converters::exodus {

// Sets get the keys of shm/sets.h, "exodus/side_set/3/cells" those of "mesh/side_set/3/members",
// and what follows from them and the blocks goes, so that the extras are those that an Exodus file
// gives now. Others stay as they are, all of them where the mesh has none of the old keys. The
// skeleton names its dimensions, so that the same mesh has the same one whatever file it is in.
void translate_old_extras(MeshInfo& info);

}  // namespace shm::converters::exodus
