// Converts a mesh from a legacy file to the contents of an XML file.
#pragma once

#include <map>
#include <set>
#include <string>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/xml_document.h"

namespace shm::converters::vtu {

struct XmlParts {
  Node field = element("FieldData"), point_data = element("PointData"),
       cell_data = element("CellData"), points = element("Points");
  std::string version = "1.0";   // file version that the cells need
  std::set<std::size_t> placed;  // arrays that have a place in the tree
  vtk::MadeExtras made;
};

// `format`: encoding of arrays. `losses` may be null. Adds everything that the XML file lacks to
// it.
XmlParts xml_of_legacy(const MeshInfo& info, const std::string& format, LossList* losses);

// Strings as field data with one component. `values`: the strings, each ended by a 0.
Node strings_element(const std::string& name, std::string values, const std::string& format,
                     vtk::MadeExtras& made);

// Returns everything that a VTU file lacks of a mesh from a legacy file.
LossList losses_in_vtu(const MeshInfo& info);

}  // namespace shm::converters::vtu
