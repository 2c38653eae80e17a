// Reads and writes Exodus II files as meshes. Supports versions 2.02 to 9, in netCDF classic,
// 64-bit offset, CDF-5 and netCDF-4 files.
//
// Each element block becomes one block of the mesh, in file order. The nodes of common element
// types (hexahedra, wedges and so on) are converted to VTK's order. Elements with unusual node
// counts (HEX9, TETRA14 ...) keep the node order of the file, in which the corners come first.
// Other elements (BEX_HEX, SUPER ...) also keep the node order of the file, and have the shape
// `other`. NSIDED blocks become polygons.
// NFACED blocks have the shape `faces` if all faces are used and no two faces are equal; otherwise
// they have the shape `polyhedron`, and their faces are extras. Missing coordinates become 0.
//
// A variable of numbers or characters becomes an array of its stored type if one of its dimensions
// counts all nodes, all elements, or all elements of a block. If other dimensions precede this
// dimension, each index into them becomes a separate array. The arrays have these roles:
//   role ""                  nodal and element variables, and variables of the whole mesh (global),
//                            of node sets, side sets and element sets, per step
//   "exodus:attribute"       attrib<b>, on one block; the components are the attributes
//   "exodus:node_attribute"  nattrb
//   "exodus:connectivity"    the columns of a connectivity that are not nodes (BEX_HEX ...), on one
//                            block
//   "exodus:polyhedron"      on a block of polyhedra: index of each polyhedron in the file, from 0
//   "exodus:<variable>"      node_num_map, elem_num_map, elem_map, node_map<i>, elem_map<i> and
//                            any other variable of that shape; the array has the variable's name,
//                            followed by #1, #2, ... for the index into preceding dimensions
//
// Extras:
//   exodus/skeleton              text: the netCDF structure in file order (see below)
//   mesh/node_set/<i>/..., mesh/side_set/<i>/..., mesh/element_set/<i>/...
//                                as in shm/sets.h and spec/registry.md; each list has the type that
//                                it has in the file (members: int32, or int64 if the type is wider)
//   exodus/edge_set/<i>/..., exodus/face_set/<i>/...    i counts from 0
//     id                         integer [1]
//     name                       text; exists only if the set has a name
//     edges, faces               members with the numbers that the file contains (from 1)
//     sides                      orientation of each edge or face
//     factors                    distribution factors
//   exodus/shared_faces_first    int32[1], and
//   exodus/face_numbers          int32 or int64: the numbers of the faces of polyhedra, in an order
//                                that is derived from the cells (polyhedra.h); if this extra is
//                                missing, the numbers are 1, 2, 3, ...
//   exodus/variable/<name>       any other netCDF variable, row-major, in its own type: QA and info
//                                records, coordinate names, properties, attribute names, variables
//                                of edge and face sets, edge and face blocks, assemblies, blobs,
//                                Nemesis data; global and set variables of a mesh without nodes and
//                                elements. Text is stored as uint8; netCDF strings as uint8, each
//                                terminated by a zero. References to vertices or cells count from 0
//   .../1, .../2, ...            further rows of a variable of more than 16 MiB; the extra without
//                                a number contains the first rows
//
// A variable is not stored as an extra if its values can be derived from the rest of the mesh. This
// is possible for ids and names of blocks and sets, flags that state whether blocks and sets have
// members (eb_status ...), distribution factors that are all 1, names of variables, truth tables,
// times, node counts of polygons, and faces of polyhedra. .shm files from versions before 0.10
// store sets under keys that begin with exodus/, and store some of the derivable variables
// (old_extras.cpp). If the members of a set are not numbers of existing
// vertices or cells, they are stored as exodus/variable/<name>. README.md lists the features that
// are kept.
//
// The skeleton (exodus/skeleton) is text with one line for each dimension, variable, attribute etc.
// The first field of a line is the kind of the line. Fields are separated by tabs; names and text
// are %-encoded:
//   K  kind                      classic, 64-bit-offset, cdf5, netcdf4 or netcdf4-classic
//   D  name  length  [unlimited]
//   A  name  type  value...      attribute of the variable in the preceding V line. An A line
//                                before the first V line is an attribute of the file. Text is one
//                                value; floats are shortest decimals, or x followed by their bits
//   V  name  type  dimension...  variable; its dimensions are names of D lines
// In netCDF-4 files, a V line is followed by lines for the storage of the variable:
//   S  level  shuffle  checksum  chunk...   only if the variable is chunked
//   F  filter  parameter...      another filter of HDF5
//   O  word...                   compact, big-endian, filled (before values are written)
//
// In names, a '#' replaces a number if the number can be predicted. Files with different numbers of
// items then have the same lines, which compress well with the dictionary. A number is a maximal
// run of digits of the %-encoded name; a '#' in the name itself is encoded as %23. A '#' means:
//   in a name of a D or V line   the corresponding number in the previous name that differs only in
//                                numbers, plus 1; or 1 if no such name exists
//   in a dimension of a V line   the last number of the variable's name
// The writer uses '#' whenever possible, except for a last number of more than 20 digits. Example:
//   D  num_side_ss#  9        means num_side_ss1
//   D  num_side_ss#  6        means num_side_ss2
//   V  elem_ss#  int  num_side_ss#
// Skeletons in .shm files from versions before 0.10 (and from drafts of 0.10) begin with N instead
// of K. Their names contain no '#' for numbers, and V lines refer to D lines by index, from 0.
// These skeletons can still be read.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns true if a file is a netCDF or HDF5 file, which may be an Exodus file. `head` contains the
// first bytes of the file, up to 4096. open_exodus() checks whether the file really is an Exodus
// file.
bool looks_like_exodus(std::span<const std::byte> head);

// Opens an Exodus file. Reads extras immediately; arrays and cells stay in the file, which must not
// change. `spool` must outlive the mesh. Throws Failure.
std::unique_ptr<MeshSource> open_exodus(const std::string& path, Spool& spool);

// The number maps of Exodus, whose numbers start at 1. Arrays with the role `original_role` (number
// maps that a mesh had before it was decomposed) are written to its parts as maps called
// original_global_id_map, as nem_spread does. Each map has one integer per vertex or cell.
inline constexpr NumberMaps kExodusMaps = {.vertices = "node_num_map",
                                           .cells = "elem_num_map",
                                           .vertices_role = "exodus:node_num_map",
                                           .cells_role = "exodus:elem_num_map",
                                           .original_role = "exodus:original_map"};

// Writes a mesh.
// - If the mesh came from Exodus, the file has the netCDF structure of its source.
// - Any other mesh becomes a 64-bit offset file, or netCDF-4 if a variable is too large for that.
//   Each block becomes an element block; if the cells of a block have different node counts, there
//   is one element block per node count. Polygons become NSIDED blocks. Real numbers have 32 bits
//   if this is sufficient for all values, otherwise 64.
// - Arrays without a role become variables, one per component (name_x, name_y, name_z or name_1,
// ...). Static arrays have the same values at every step. Arrays with the roles of kExodusMaps
// become maps.
//
// Throws Failure with the code output on a disk error, and with the code unsupported for polyhedra
// of other formats.
void write_exodus(MeshSource& mesh, const std::string& path);

extern const Format kExodusFormat;

}  // namespace shm::converters
