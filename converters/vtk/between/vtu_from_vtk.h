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
  std::string version = "1.0";   // version of the XML file, which determines the node order
  std::set<std::size_t> placed;  // indices of the mesh's arrays to which the elements refer
  vtk::MadeExtras made;
};

// Converts the skeleton of a legacy file (the file without its numbers) to elements of an XML file.
// `format` is the encoding of the arrays, such as "appended". Adds descriptions of the data that
// the XML file cannot store to `losses`, which may be null.
XmlParts xml_of_legacy(const MeshInfo& info, const std::string& format, LossList* losses);

// Returns the XML element of a field data array that contains strings and has one component.
// `values` contains the strings, each terminated by a zero byte. strings_element() adds `values` to
// `made` as an extra, to which the element refers.
Node strings_element(const std::string& name, std::string values, const std::string& format,
                     vtk::MadeExtras& made);

// Returns descriptions of the data that is lost if a mesh from a legacy file is written as a VTU
// file.
LossList losses_in_vtu(const MeshInfo& info);

}  // namespace shm::converters::vtu
