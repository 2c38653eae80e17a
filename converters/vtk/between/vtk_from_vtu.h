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

// Skeleton of a binary legacy file without its cells. Its version is the version that the cells
// need.
struct LegacyParts {
  Skeleton skeleton;
  std::set<std::size_t> placed;  // arrays of the mesh that have a place in the skeleton
  MadeExtras made;
};
// Converts the skeleton of an XML file. Adds everything that the legacy file lacks to `losses`,
// which may be null.
LegacyParts legacy_of_xml(const MeshInfo& info, LossList* losses);

// Returns the data of a mesh from an XML file that a legacy file cannot store.
LossList losses_in_vtk(const MeshInfo& info);

}  // namespace shm::converters::vtk
