// Exodus II files (versions 2.02 to 9; netCDF classic, 64-bit offset, CDF-5 and netCDF-4) as
// meshes.
//
// In the model: one block for each element block, in file order; hexahedra, wedges and so on of
// known orders have VTK's node order. HEX9, HEX16 ... are hexahedra too, other elements (BEX_HEX,
// TETRA14 ...) have shape `other`, both in the order of the file. NSIDED blocks are polygons,
// NFACED blocks have the shape `faces`, where all faces are used and unlike each other, else they
// are polyhedra whose faces are extras. Missing coordinates are 0. Every variable of numbers or
// characters that has values for all nodes, all elements or all elements of a block, in any one of
// its dimensions, is an array of its stored type; places in dimensions before that one are arrays
// of their own:
//   role ""                  nodal and element variables, per step
//   "exodus:attribute"       attrib<b>: components = attributes, on one block
//   "exodus:node_attribute"  nattrb
//   "exodus:connectivity"    columns of a connectivity behind the nodes (BEX_HEX ...), one block
//   "exodus:polyhedron"      of a block of polyhedra: which one of the file, from 0
//   "exodus:<variable>"      node_num_map, elem_num_map, elem_map, node_map<i>, elem_map<i> and
//                            whatever else has that shape; the name is the variable's, too, with
//                            #1, #2, ... for places in dimensions before
//
// Extras:
//   exodus/skeleton              text: the netCDF structure in file order (below)
//   mesh/node_set/<i>/..., mesh/side_set/<i>/..., mesh/element_set/<i>/...
//                                as in shm/sets.h and spec/registry.md; each list in the type that
//                                the file has (members int32, or int64 when that is wider)
//   exodus/edge_set/<i>/..., exodus/face_set/<i>/...    i counts from 0
//     id                         integer [1]
//     name                       text, when there is one
//     edges, faces               members as they are in the file (from 1)
//     sides                      orientation of each edge or face
//     factors                    distribution factors
//   exodus/shared_faces_first    int32[1], and
//   exodus/face_numbers          int32 or int64: the numbers of the faces of polyhedra, in an order
//                                that follows from the cells (polyhedra.h); 1, 2, 3, ... if missing
//   exodus/variable/<name>       any other netCDF variable, row-major, in its own type: QA and info
//                                records, coordinate names, properties, attribute names, global and
//                                set variables, edge and face blocks, assemblies, blobs, Nemesis
//                                data. Text as uint8; netCDF strings as uint8, each ended by a
//                                zero. With a reference: vertices or cells from 0, as above
//   .../1, .../2, ...            further rows of a variable of more than 16 MiB, behind its first
// A variable that follows from the rest of the mesh is not carried twice: ids and names of
// blocks and sets, whether they have members (eb_status ...), distribution factors of 1, names of
// nodal and element variables, their truth table, times, node counts of polygons, faces of
// polyhedra. Files before 0.10 have sets under keys of Exodus and carry more of these
// (old_extras.cpp). Members that are numbers of no vertex or cell make their variable a plain
// exodus/variable. What of a file is kept, and how: exodus.md.
//
// The skeleton: a line for each thing, fields separated by tabs, names and text %-encoded:
//   K  kind                      classic, 64-bit-offset, cdf5, netcdf4 or netcdf4-classic
//   D  name  length  [unlimited]
//   A  name  type  value...      of the variable above; before the first V: of the file. Text is
//                                one value; floats are shortest decimals, or x and their bits
//   V  name  type  dimension...  names of D lines
// and for the variable above, in netCDF-4 files:
//   S  level  shuffle  checksum  chunk...   when chunked
//   F  filter  parameter...      another filter of HDF5
//   O  word...                   compact, big-endian, filled (before values are written)
// So that files with other numbers of things have the same lines, a '#' stands for a number (digits
// as far as they go, of the %-encoded name, which has %23 for a '#' of its own):
//   in a name of a D or V line   one more than the number at its place in the last name of such a
//                                line that differs from this one in numbers only; 1 in the first
//   in a dimension of a V line   the last number of the variable's name
// A '#' is always written where it can be, but for a last number of more than 20 digits. As in
//   D  num_side_ss#  9        num_side_ss1
//   D  num_side_ss#  6        num_side_ss2
//   V  elem_ss#  int  num_side_ss#
// Files before 0.10 (and drafts of it) begin with N instead of K, have all numbers in names, and in
// V lines the numbers of D lines, from 0; they are read as they are.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "transfer/format.h"

namespace shm::converters {

// By content: `head` is the beginning of the file, up to 4096 bytes. True for any netCDF or HDF5
// file; open_exodus finds out whether it is Exodus.
bool looks_like_exodus(std::span<const std::byte> head);

// Arrays and cells stay in the file, which must not change; extras are read at once. `spool` must
// outlive the mesh. Throws Failure.
std::unique_ptr<MeshSource> open_exodus(const std::string& path, Spool& spool);

// Number maps, from 1. Those that the whole mesh had, in a part of a decomposed one, are written as
// a map called original_global_id_map, as nem_spread does: one integer for each vertex or cell.
inline constexpr NumberMaps kExodusMaps = {.vertices = "node_num_map",
                                           .cells = "elem_num_map",
                                           .vertices_role = "exodus:node_num_map",
                                           .cells_role = "exodus:elem_num_map",
                                           .original_role = "exodus:original_map"};

// A mesh that came from Exodus gets its netCDF structure back. Any other one becomes a 64-bit
// offset file (netCDF-4 when a variable is too large for that): one element block for each block
// and number of nodes, polygons as NSIDED; 32-bit floats when they hold all values, else 64-bit;
// arrays without a role as variables, components apart (name_x, name_y, name_z or name_1, ...),
// static ones at every step; arrays with the roles of kExodusMaps as maps. Throws Failure: output
// when the disk fails, unsupported for polyhedra of other formats.
void write_exodus(MeshSource& mesh, const std::string& path);

extern const Format kExodusFormat;

}  // namespace shm::converters
