// The two formats of VTK, legacy and XML, store nearly the same information in different forms. A
// file of one format written from a mesh of the other keeps everything that both can express: field
// data, strings and bits, which array is the scalars, vectors, ..., names of components,
// information keys, faces of polyhedra.
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

// Names in both formats of a role that an array of points or cells may have.
struct Attribute {
  EntryKind kind;
  std::string_view name;
  std::uint64_t least, most;  // number of components
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

// Field data with a special meaning in the other format: the time of the mesh, and the title of a
// legacy file.
inline constexpr std::string_view kLegacyTime = "TIME", kXmlTime = "TimeValue", kXmlTitle = "Title";

// Extras that a plan derives from the extras of its mesh, in the form of its own format.
struct MadeExtras {
  std::deque<Extra> data;     // x0, x1, ...
  std::deque<Extra> strings;  // string lists of arrays
  void register_in(std::map<std::string, const Extra*>& extras) const {
    for (const auto* made : {&data, &strings})
      for (const Extra& extra : *made) extras[extra.key] = &extra;
  }
};

// Returns the FIELD entry of a legacy file for an array of the mesh.
Entry entry_of_array(const MeshInfo& info, std::size_t array);

// Component names are kept for arrays with at most this number of components. Field data may have
// any number of components.
inline constexpr std::uint64_t kMostNamedComponents = 4096;
std::string quoted_array(std::string_view name);  // "array 'T'"

// Keys of ranges follow from the values and are wrong if the values were rounded.
inline bool is_range_key(std::string_view name) {
  return name.find("_RANGE") != std::string_view::npos;
}

// Legacy files from version 5.1 on and XML files from version 2.1 on use another node order for
// some cells. Returns true if the mesh may have such cells in that order.
bool has_renumbered_cells(const MeshInfo& info);
// Extra of a piece of a file. The piece has no skeleton; the extra says that its cells have the
// newer node order.
inline constexpr const char* kNewNumbering = "vtk/new_numbering";

}  // namespace shm::converters::vtk
