// Of a mesh that came from a legacy file: what an XML file has of it.
#pragma once

#include <map>
#include <set>
#include <string>

#include "mesh/mesh_source.h"
#include "transfer/losses.h"
#include "vtk/between/family.h"
#include "vtk/xml_document.h"

namespace shm::converters::vtu {

struct XmlParts {
  Node field = element("FieldData"), point_data = element("PointData"),
       cell_data = element("CellData"), points = element("Points");
  std::string version = "1.0";   // of the file, as its cells need it
  std::set<std::size_t> placed;  // arrays that have got their place
  vtk::MadeExtras made;
};

// `format`: of arrays. `losses`, which may be null, gets what is left behind.
XmlParts xml_of_legacy(const MeshInfo& info, const std::string& format, LossList* losses);

// Strings as field data of one component: name, and values ended by a 0.
Node strings_element(const std::string& name, std::string values, const std::string& format,
                     vtk::MadeExtras& made);

// What a VTU file lacks of a mesh from a legacy file.
LossList losses_in_vtu(const MeshInfo& info);

}  // namespace shm::converters::vtu
