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
  std::set<std::size_t> placed;  // arrays of the mesh that have a place in the tree
  vtk::MadeExtras made;
};

// Converts the skeleton of a legacy file. `format`: encoding of arrays. Adds everything that the
// XML file lacks to `losses`, which may be null.
XmlParts xml_of_legacy(const MeshInfo& info, const std::string& format, LossList* losses);

// Returns strings as field data with one component. `values`: the strings, each terminated by a
// zero byte.
Node strings_element(const std::string& name, std::string values, const std::string& format,
                     vtk::MadeExtras& made);

// Returns the data of a mesh from a legacy file that a VTU file cannot store.
LossList losses_in_vtu(const MeshInfo& info);

}  // namespace shm::converters::vtu
