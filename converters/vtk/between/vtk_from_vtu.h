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

// Skeleton of a binary legacy file (the file without its numbers), without the lists of cells. The
// version of the file is 5.1 if the node order of the cells requires version 5.1, otherwise 4.2.
struct LegacyParts {
  Skeleton skeleton;
  std::set<std::size_t> placed;  // indices of the mesh's arrays to which the skeleton refers
  MadeExtras made;
};
// Converts the skeleton of an XML file (the file without its numbers) to the skeleton of a legacy
// file. Adds descriptions of the data that the legacy file cannot store to `losses`, which may be
// null.
LegacyParts legacy_of_xml(const MeshInfo& info, LossList* losses);

// Returns descriptions of the data that is lost if a mesh from an XML file is written as a legacy
// file.
LossList losses_in_vtk(const MeshInfo& info);

}  // namespace shm::converters::vtk
