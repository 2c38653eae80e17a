// VTK legacy files (versions 1.0 to 5.1, ASCII and binary; DATASET UNSTRUCTURED_GRID,
// STRUCTURED_GRID, RECTILINEAR_GRID, STRUCTURED_POINTS, POLYDATA) as meshes. README.md has a table
// of all features.
//
// Blocks: a mesh has one block for each VTK cell type and number of nodes, in order of first
// appearance; BlockInfo::id is the VTK cell type. If the cells of one of the types polygon,
// polyline, polyvertex, triangle strip, convex point set and polyhedron have different numbers of
// nodes, all cells of this type are in one block. Voxels and pixels are stored as hexahedra and
// quads (with permuted corners), in blocks of their own type. A structured data set has one block:
// hexahedra, quads if one dimension is 1, lines if two dimensions are 1, or a single vertex.
//
// A file with rectilinear or image data does not contain points. The points are computed when they
// are read, in the same way as in VTK: from the values of the axes, or as origin + index * spacing
// in double precision. The points are float32 if all three axes are float32.
//
// Cells of polygonal data are numbered as in VTK: VERTICES, LINES, POLYGONS, TRIANGLE_STRIPS. A
// single vertex, line segment, triangle or quad in these lists gets the specific VTK cell type, not
// polyvertex, polyline or polygon.
//
// Arrays: the arrays of POINT_DATA and CELL_DATA that have a value for every vertex or cell, and
// BLANKING of old structured grids. Bits are stored as uint8. Strings and variants are stored as
// uint32 indices into vtk/strings/<i>; only these arrays have a role, "vtk:string".
//
// vtkIdType has 32 bits in binary files, as VTK writes it. In text files, it is read as 64 bits.
// COLOR_SCALARS have the type that VTK stores: uint8 in binary files, float32 (0..1) in text files.
//
// Extras:
//   vtk/skeleton             text: the file without its numbers, line by line in file order (see
//                            below)
//   vtk/cell_types           int32[blocks]: VTK cell type of each block; does not exist for
//                            structured data
//   vtk/data/<k>             values of the array that the skeleton calls x<k>. Numbers have the
//                            type of the file and the shape {tuples, components}. Strings, variants
//                            and bits are uint8: for strings and bits of a binary file, the bytes
//                            of the file; for variants, and for strings of a text file, the words
//                            of the file, one value per line; for bits of a text file, 0 or 1
//   vtk/strings/<i>          uint8: the distinct strings of array i of the schema, one after the
//                            other, encoded as in vtk/data/<k>
// Polyhedra have the shape `faces`. However, if a polyhedron has a face without points, or a face
// whose first point occurs twice, all polyhedra have the shape polyhedron, and there are these
// extras:
//   vtk/polyhedron/cells     int64[n], refers to cells: the polyhedra
//   vtk/polyhedron/faces     int64[n]: number of faces of each polyhedron
//   vtk/polyhedron/face_sizes int64: number of vertices of each face, polyhedron by polyhedron
//
// The skeleton contains the version ("5.1"), the title and ASCII or BINARY on the first three
// lines. Further lines are:
//   DATASET <kind>                  if absent, the data set is an UNSTRUCTURED_GRID
//   FIELD <name> <arrays>           the arrays of the field follow; a field before POINT_DATA and
//                                   CELL_DATA belongs to the data set
//   POINTS <type>                   type of the coordinates in the file
//   CELLS [<type> <type>]           types of OFFSETS and CONNECTIVITY (5.x); without types, the
//                                   cells are stored as rows
//   VERTICES | LINES | POLYGONS | TRIANGLE_STRIPS <cells> [<type> <type>]
//   DIMENSIONS | EXTENT | SPACING | ASPECT_RATIO | ORIGIN <words>   verbatim from the file
//   CELL_DATA | POINT_DATA
//   <KIND> <ref> <name> <type> <components> <tuples> [<lookup table>]
//                                   KIND: SCALARS, VECTORS, ..., X_COORDINATES, ... or ARRAY for
//                                   an array of a FIELD;
//                                   ref: a<i> is array i of the schema, x<k> is vtk/data/<k>;
//                                   an array may occur once with each kind, because VTK writes an
//                                   array that is both scalars and vectors twice
//   NULL_ARRAY                      a gap in a FIELD
//   |<text>                         METADATA of the array in the preceding line
// Names are %-encoded, as in the file.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns true if a file that begins with `head` is a VTK legacy file.
bool looks_like_vtk(std::span<const std::byte> head);

// Opens a file. Reads the whole structure, and stores text arrays in `spool`, which must outlive
// the result. Binary arrays stay in the file, which must not change. Throws Failure.
std::unique_ptr<MeshSource> open_vtk(const std::string& path, Spool& spool);

// Writes a mesh front to back.
// - If the mesh came from VTK, the file has the data set, version, encoding, title and arrays of
// its source. The data set becomes an unstructured grid if points or cells were renumbered
// (Order::stream and free), so that the dimensions or lists no longer describe them.
// - A mesh of another format becomes a binary file of version 4.2 (5.1 if it has more than 2^31 - 1
// points or needs more than 2^31 - 1 integers for its cells), with the values and the time of the
// final time step. If the mesh came from a VTU file, everything that a legacy file can store is
// kept (vtk_from_vtu.h).
//
// Throws Failure (output) on a disk error.
void write_vtk(MeshSource& mesh, const std::string& path, Spool& spool);

extern const Format kVtkFormat;

}  // namespace shm::converters
