// Converts a mesh that came from an XML file to the contents of a legacy file.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

// Skeleton of a binary legacy file without its cells. Its version is the version that the cells of
// the mesh need.
struct LegacyParts {
  Skeleton skeleton;
  std::set<std::size_t> placed;  // indices of the mesh's arrays to which the skeleton refers
  MadeExtras made;
};
// Converts the skeleton of an XML file to that of a legacy file. Adds the data that the legacy file
// will lack to `losses`, which may be null.
LegacyParts legacy_of_xml(const MeshInfo& info, LossList* losses);

// Returns the data of a mesh from an XML file that cannot be stored in a legacy file.
LossList losses_in_vtk(const MeshInfo& info);

}  // namespace shm::converters::vtk
