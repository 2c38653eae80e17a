// Code shared by the two formats of VTK, legacy and XML. They store nearly the same information in
// different forms. If a mesh of one format is written in the other, everything that both can
// express is kept: field data, strings and bits, which array is the scalars, vectors, ..., names of
// components, information keys, faces of polyhedra.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

// A role that an array of points or cells may have, with its names in both formats.
struct Attribute {
  EntryKind kind;
  std::string_view name;
  std::uint64_t least, most;  // smallest and largest number of components
};
inline constexpr std::uint64_t kAnyComponents = 65535;
inline constexpr Attribute kAttributes[] = {
    {EntryKind::scalars, "Scalars", 1, kAnyComponents},
    {EntryKind::color_scalars, "Scalars", 1, kAnyComponents},
    {EntryKind::vectors, "Vectors", 3, 3},
    {EntryKind::normals, "Normals", 3, 3},
    {EntryKind::tensors, "Tensors", 9, 9},
    {EntryKind::tensors6, "Tensors", 6, 6},
    {EntryKind::texture_coordinates, "TCoords", 1, 3},
    {EntryKind::global_ids, "GlobalIds", 1, 1},
    {EntryKind::pedigree_ids, "PedigreeIds", 1, 1},
    {EntryKind::edge_flags, "EdgeFlag", 1, 1},
};
// Roles that only XML files have.
inline constexpr std::string_view kXmlOnlyAttributes[] = {"Tangents", "RationalWeights",
                                                          "HigherOrderDegrees", "ProcessIds"};

// Names of field data with a special meaning in the other format: the time of the mesh, and the
// title of a legacy file.
inline constexpr std::string_view kLegacyTime = "TIME", kXmlTime = "TimeValue", kXmlTitle = "Title";

// Extras that a plan derives from the extras of its mesh, in the form of its own format.
struct MadeExtras {
  std::deque<Extra> data;     // values that the plan calls x0, x1, ...
  std::deque<Extra> strings;  // lists of strings of arrays
  void register_in(std::map<std::string, const Extra*>& extras) const {
    for (const auto* made : {&data, &strings})
      for (const Extra& extra : *made) extras[extra.key] = &extra;
  }
};

// Returns the FIELD entry of a legacy file for an array of the mesh.
Entry entry_of_array(const MeshInfo& info, std::size_t array);

// Largest number of components of an array whose component names are kept. Field data may have any
// number of components.
inline constexpr std::uint64_t kMostNamedComponents = 4096;
std::string quoted_array(std::string_view name);  // returns "array 'T'"

// Returns true for keys of ranges. Ranges can be computed from the values, and are wrong if the
// values were rounded.
inline bool is_range_key(std::string_view name) {
  return name.find("_RANGE") != std::string_view::npos;
}

// Legacy files from version 5.1 on and XML files from version 2.1 on use another node order for
// some cells. Returns true if the mesh may have such cells in that order.
bool has_renumbered_cells(const MeshInfo& info);
// Key of an extra of a piece of a file. A piece has no skeleton, so this extra states that its
// cells have the newer node order.
inline constexpr const char* kNewNumbering = "vtk/new_numbering";

}  // namespace shm::converters::vtk
