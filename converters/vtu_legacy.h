// Between VTK's legacy files and its XML files: what both can say is carried over. That is field
// data, texts and bits, which array is the scalars, vectors, ..., names of components, and
// information keys. Lookup tables and variants are not in the XML format.
#pragma once

#include <deque>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "mesh_source.h"
#include "vtk_words.h"
#include "vtu_document.h"

namespace shm::converters::vtu {

using ExtraMap = std::map<std::string, const Extra*>;

// Where to put what a legacy file said.
struct LegacyParts {
  Node& field;
  Node& point_data;
  Node& cell_data;
  std::string format;             // of arrays
  std::set<std::size_t>& placed;  // arrays that have got their place
  std::deque<Extra>& made;        // values of x0, x1, ...; keys are the caller's
};
// For a mesh that came from a legacy file. Returns the file version that its cells need.
std::string add_legacy_parts(const MeshInfo& info, const ExtraMap& extras, LegacyParts& parts);

// Field data "BlockNames" (vtk_field_data.h) as strings of an XML file; empty where no block has a
// name.
Extra block_names(const MeshInfo& info);

// Field data, attributes and arrays of a mesh that came from a VTU file, for a binary file of the
// version that its cells need.
struct LegacyFile {
  std::string version;
  std::vector<vtk::Entry> entries;
};
LegacyFile legacy_file(const MeshInfo& info, const ExtraMap& extras, std::set<std::size_t>& placed,
                       std::deque<Extra>& made);

}  // namespace shm::converters::vtu
