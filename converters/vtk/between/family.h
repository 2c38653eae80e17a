// Code that VTK's two formats, legacy and XML, share. Both formats store nearly the same
// information in different forms. If a mesh of one format is written in the other, all data that
// both formats can express is kept: field data, strings and bits, roles of arrays (scalars,
// vectors, ...), names of components, information keys, faces of polyhedra.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "interface/losses.h"
#include "mesh/mesh_source.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

// A role of a point or cell array: the keyword for the role in legacy files (`kind`) and the
// attribute in XML files (`name`).
struct Attribute {
  EntryKind kind;
  std::string_view name;
  std::uint64_t least, most;  // smallest and largest number of components that the role allows
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
// Names of roles that exist only in XML files.
inline constexpr std::string_view kXmlOnlyAttributes[] = {"Tangents", "RationalWeights",
                                                          "HigherOrderDegrees", "ProcessIds"};

// Names of field data with a special meaning: the time in a legacy file, the time in an XML file,
// and the title in an XML file that was converted from a legacy file.
inline constexpr std::string_view kLegacyTime = "TIME", kXmlTime = "TimeValue", kXmlTitle = "Title";

// Extras that are derived from the extras of a mesh, because the other format needs the values in
// another form. The skeleton of the new file (the file without its numbers) refers to them.
struct MadeExtras {
  std::deque<Extra> data;     // values of arrays, which the skeleton calls x0, x1, ...
  std::deque<Extra> strings;  // lists of strings of arrays
  void register_in(std::map<std::string, const Extra*>& extras) const {
    for (const auto* made : {&data, &strings})
      for (const Extra& extra : *made) extras[extra.key] = &extra;
  }
};

// Returns the line of a legacy file's skeleton (see vtk.h) that lists an array of the mesh in a
// FIELD.
Entry entry_of_array(const MeshInfo& info, std::size_t array);

// Component names are kept only for arrays with at most this number of components. An array of
// field data may have more components; all its component names are then dropped.
inline constexpr std::uint64_t kMostNamedComponents = 4096;
std::string quoted_array(std::string_view name);  // returns "array 'T'"

// Returns true for information keys that contain ranges of values. Such ranges can be computed from
// the values, and are wrong if the values were rounded.
inline bool is_range_key(std::string_view name) {
  return name.find("_RANGE") != std::string_view::npos;
}

// Versions of legacy and XML files that changed the node order of Lagrange and Bezier hexahedra.
inline constexpr const char *kNewNumberingInLegacy = "5.1", *kNewNumberingInXml = "2.1";
// Returns true if the mesh has Lagrange or Bezier hexahedra.
bool has_renumbered_cells(const MeshInfo& info);
// Returns the blocks that SourceFormat::blocks_with_own_nodes() describes: Bezier cells above order
// 1, whose nodes are control points, and Lagrange cells whose order differs by axis.
std::vector<std::size_t> blocks_with_own_nodes(MeshSource& mesh);
// Key of an extra that marks a piece of a mesh as using the newer node order. A whole mesh does not
// need this extra, because its skeleton (the file without its numbers) contains the file version. A
// piece has no skeleton.
inline constexpr const char* kNewNumbering = "vtk/new_numbering";

}  // namespace shm::converters::vtk
