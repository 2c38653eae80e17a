// The two formats of VTK, legacy and XML, hold nearly the same of a mesh, in other words. A mesh of
// one goes into a file of the other with all that both have words for: field data, strings and
// bits, which array is the scalars, vectors, ..., names of components, information keys, faces of
// polyhedra.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "mesh/mesh_source.h"
#include "transfer/losses.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

// What each format calls the role that an array of points or cells may have.
struct Attribute {
  EntryKind kind;
  std::string_view name;
  std::uint64_t least, most;  // components
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
// Roles that XML files have alone.
inline constexpr std::string_view kXmlOnlyAttributes[] = {"Tangents", "RationalWeights",
                                                          "HigherOrderDegrees", "ProcessIds"};

// Field data that stand for something else in the other format: the time of the mesh, and the
// title of a legacy file.
inline constexpr std::string_view kLegacyTime = "TIME", kXmlTime = "TimeValue", kXmlTitle = "Title";

// Extras that a plan makes of those that its mesh has, for the words of its own format.
struct MadeExtras {
  std::deque<Extra> data;     // x0, x1, ...
  std::deque<Extra> strings;  // lists of arrays
  void register_in(std::map<std::string, const Extra*>& extras) const {
    for (const auto* made : {&data, &strings})
      for (const Extra& extra : *made) extras[extra.key] = &extra;
  }
};

// An array of the mesh as one of a FIELD of a legacy file.
Entry entry_of_array(const MeshInfo& info, std::size_t array);

// Names are taken of no more components: of field data they may be any number.
inline constexpr std::uint64_t kMostNamedComponents = 4096;
std::string quoted_array(std::string_view name);  // "array 'T'"

// Keys of ranges follow from the values, and are wrong where these were rounded.
inline bool is_range_key(std::string_view name) {
  return name.find("_RANGE") != std::string_view::npos;
}

// Legacy files from 5.1 on and XML files from 2.1 on number the nodes of some cells anew.
bool has_renumbered_cells(const MeshInfo& info);
// An extra of a piece of a file, which has no skeleton: its cells are numbered the newer way.
inline constexpr const char* kNewNumbering = "vtk/new_numbering";

}  // namespace shm::converters::vtk
