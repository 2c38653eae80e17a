// Of a mesh that came from an XML file: what a legacy file has of it.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "mesh/mesh_source.h"
#include "transfer/losses.h"
#include "vtk/between/family.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

// The skeleton of a binary file, of the version that the cells need, but for its cells.
struct LegacyParts {
  Skeleton skeleton;
  std::set<std::size_t> placed;  // arrays that have got their place
  MadeExtras made;
};
// `losses`, which may be null, gets what is left behind.
LegacyParts legacy_of_xml(const MeshInfo& info, LossList* losses);

// What a legacy file lacks of a mesh from an XML file.
LossList losses_in_vtk(const MeshInfo& info);

}  // namespace shm::converters::vtk
