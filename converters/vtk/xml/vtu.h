// Reads and writes VTK XML files of unstructured grids (.vtu), file versions 0.1 to 2.x. Supports
// arrays inside the XML (as text or base64) and appended arrays (as raw bytes or base64), 32-bit
// and 64-bit headers, both byte orders, and compression with zlib, LZ4 and LZMA.
//
// Blocks, voxels, pixels and polyhedra are stored in the same way as for legacy VTK (see vtk.h),
// with the same extras: vtk/cell_types, vtk/polyhedron/*. The points and the cells of all pieces
// are concatenated; points are numbered consecutively across all pieces.
//
// Arrays: an array in PointData or CellData becomes an array of the mesh with the role "" if it
// contains numbers or bits for every point or cell, and if it has the same name, type and number of
// components in all non-empty pieces. Bits become uint8 with the values 0 and 1. If a file contains
// one array per time step (attribute TimeStep), these arrays become one stepped array. An array of
// strings becomes a uint32 array with the role "vtk:string"; its values are indices into the list
// of strings in vtk/strings/<i>.
//
// Extras:
//   vtu/skeleton             text: the file's XML without its numbers (see below)
//   vtk/strings/<i>          uint8: the distinct strings of array i of the schema, each followed by
//                            a 0 byte
//   vtu/data/<k>             values of the array that the skeleton calls x<k>, in the type of that
//                            array; strings are stored as bytes, each string followed by a 0 byte
//   vtu/polyhedron/ascending int32[1]: if present, connectivity lists the points of each polyhedron
//                            in ascending order; otherwise it lists them in the order in which the
//                            faces first use them
//   vtu/polyhedron/cells     int64[n], refers to cells: the polyhedra whose points are in a
//                            different order
//   vtu/polyhedron/counts    int64[n]: number of points of each of these polyhedra
//   vtu/polyhedron/points    int64, refers to vertices: the points of each of these polyhedra, in
//                            the order of the file
//
// The skeleton contains all elements with their attributes, texts, comments and instructions, in
// file order. In each DataArray and Array, the numbers are replaced with an instruction:
// <?shm-values WORD?> or <?shm-values WORD bBYTES?>. WORD is one of:
//   a<i>, a<i>s<t>           array i of the schema, or step t of this array
//   x<k>                     the extra vtu/data/<k>
//   points                   the coordinates
//   connectivity, offsets, types, faces, faceoffsets, face_connectivity, face_offsets,
//   polyhedron_to_faces, polyhedron_offsets    computed from the cells
//   block_ids                block id of each cell; only if the mesh came from another format
//   time                     time of the final step; only if the mesh came from another format
//   none                     not stored, because VTK does not read arrays of that type
// BYTES is the block size of a compressed array, given only if it is not 32768. The skeleton omits
// offsets into appended data, and white space between attributes and elements.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns true if a file that begins with `head` is a VTK XML file, whatever its data set type
// (unstructured grid, image, ...).
bool looks_like_vtu(std::span<const std::byte> head);

// Opens a file. Reads the whole file and stores all numbers in `spool`, which must outlive the
// result. Refuses a file that contains a DOCTYPE, so no entities need to be resolved. Throws
// Failure.
std::unique_ptr<MeshSource> open_vtu(const std::string& path, Spool& spool);

// Writes a mesh front to back.
// - If the mesh came from a VTU file, the new file has the same XML, encoding and compressor.
// - If the mesh came from another format, the file has version 1.0 (2.2 for Lagrange hexahedra of
// legacy version 5.1), little-endian raw appended data, zlib compression and 64-bit headers. It
// contains the values and the time of the final time step only. If the mesh came from a legacy VTK
// file, everything that VTU can represent is kept (vtu_from_vtk.h).
//
// Throws Failure (output) on a disk error.
void write_vtu(MeshSource& mesh, const std::string& path, Spool& spool);

extern const Format kVtuFormat;

}  // namespace shm::converters
