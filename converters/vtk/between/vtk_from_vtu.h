// Converts a mesh from an XML file to the contents of a legacy file.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

// Skeleton of a binary file without its cells, in the version that the cells need.
struct LegacyParts {
  Skeleton skeleton;
  std::set<std::size_t> placed;  // arrays that have a place in the skeleton
  MadeExtras made;
};
// `losses` may be null. Adds everything that the legacy file lacks to it.
LegacyParts legacy_of_xml(const MeshInfo& info, LossList* losses);

// Returns everything that a legacy file lacks of a mesh from an XML file.
LossList losses_in_vtk(const MeshInfo& info);

}  // namespace shm::converters::vtk
