// Converts a mesh that came from a legacy file to the contents of an XML file.
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
  std::string version = "1.0";   // version of the XML file that the cells need
  std::set<std::size_t> placed;  // indices of the mesh's arrays to which the tree refers
  vtk::MadeExtras made;
};

// Converts the skeleton of a legacy file to the tree of an XML file. `format` is the encoding of
// arrays. Adds the data that the XML file will lack to `losses`, which may be null.
XmlParts xml_of_legacy(const MeshInfo& info, const std::string& format, LossList* losses);

// Returns an array of field data that contains strings and has one component. In `values`, each
// string is terminated by a zero byte.
Node strings_element(const std::string& name, std::string values, const std::string& format,
                     vtk::MadeExtras& made);

// Returns the data of a mesh from a legacy file that cannot be stored in a VTU file.
LossList losses_in_vtu(const MeshInfo& info);

}  // namespace shm::converters::vtu
