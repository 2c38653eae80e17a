// VTK XML files of unstructured grids (.vtu), file versions 0.1 to 2.x, as meshes. Supported are
// arrays inside the XML (as text or base64) and appended arrays (as raw bytes or base64); headers
// of 32 or 64 bits; both byte orders; zlib, LZ4 and LZMA.
//
// Blocks, voxels, pixels and polyhedra are the same as in vtk.h, with the same extras:
// vtk/cell_types, vtk/polyhedron/*. Points and cells of several pieces are concatenated; points are
// numbered consecutively through all pieces.
//
// Arrays: an array of PointData or CellData becomes an array of the mesh (role "") if it has
// numbers (or bits: uint8, 0 or 1) for every point or cell, with the same name, type and components
// in all pieces that have points or cells. Arrays with a TimeStep for each of the file's TimeValues
// become one stepped array. Strings become uint32 with role "vtk:string": indices into
// vtk/strings/<i>.
//
// Extras:
//   vtu/skeleton             text: the file's XML without its numbers (see below)
//   vtk/strings/<i>          uint8: the distinct strings of array i of the schema, each ended by 0
//   vtu/data/<k>             values of the array that the skeleton calls x<k>, in their own type;
//                            strings as their bytes, each ended by 0
//   vtu/polyhedron/ascending int32[1]: if present, the points of each polyhedron ascend; otherwise
//                            they are in the order in which the faces first use them
//   vtu/polyhedron/cells     int64[n], refers to cells: polyhedra whose points have another order
//   vtu/polyhedron/counts    int64[n]: number of points of each of these polyhedra
//   vtu/polyhedron/points    int64, refers to vertices: their points in the file's order
//
// The skeleton contains all elements with all attributes in file order, texts, comments and
// instructions. In each DataArray and Array, an instruction <?shm-values WORD?> or <?shm-values
// WORD bBYTES?> replaces the numbers. WORD is one of:
//   a<i>, a<i>s<t>           array i of the schema, or its step t
//   x<k>                     vtu/data/<k>
//   points                   the coordinates
//   connectivity, offsets, types, faces, faceoffsets, face_connectivity, face_offsets,
//   polyhedron_to_faces, polyhedron_offsets    computed from the cells
//   block_ids                block number of each cell; only in files of meshes of other formats
//   time                     time of the last step; only in files of meshes of other formats
//   none                     nothing: VTK does not read an array of that type
// BYTES is the size of the blocks that are compressed one by one, if it is not 32768. The skeleton
// omits offsets into appended data, and blanks between attributes and elements.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns true if a file that begins with `head` is a VTK XML file of any data set.
bool looks_like_vtu(std::span<const std::byte> head);

// Opens a file. Reads the whole file and stores all numbers in `spool`, which must outlive the
// result. Refuses a file with a DOCTYPE, so entities are never resolved. Throws Failure.
std::unique_ptr<MeshSource> open_vtu(const std::string& path, Spool& spool);

// Writes a mesh front to back.
// - If the mesh came from VTU, the file has the XML, encoding and compressor of its source.
// - A mesh of another format becomes version 1.0 (2.2 for Lagrange hexahedra of legacy 5.1), little
// endian, with raw appended data, zlib and 64-bit headers. The file contains the values and the
// time of the last time step. If the mesh came from a legacy file, everything that XML can express
// is kept (vtu_from_vtk.h).
//
// Throws Failure (output) on a disk error.
void write_vtu(MeshSource& mesh, const std::string& path, Spool& spool);

extern const Format kVtuFormat;

}  // namespace shm::converters
