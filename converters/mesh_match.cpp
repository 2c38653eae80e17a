#include "mesh_match.h"
namespace shm::converters {
MeshMatch match_meshes(MeshSource&, MeshSource&, const MatchRules&, const Progress&) { return {}; }
}
