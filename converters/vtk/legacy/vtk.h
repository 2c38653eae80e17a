// VTK legacy files (versions 1.0 to 5.1, ASCII and binary; DATASET UNSTRUCTURED_GRID,
// STRUCTURED_GRID, RECTILINEAR_GRID, STRUCTURED_POINTS, POLYDATA) as meshes. vtk.md has the table
// of all features.
//
// Blocks: one for each VTK cell type and number of nodes, in order of first appearance;
// BlockInfo::id is the VTK cell type. Polygons, polylines, polyvertices, triangle strips, convex
// point sets and polyhedra share one block a type when their numbers of nodes differ. Voxels and
// pixels are stored as hexahedra and quads (corners permuted); their type is another one.
// Structured data have one block: hexahedra, quads where one dimension is 1, lines, a vertex.
// Points of rectilinear and image data are made when they are read, as VTK makes them: axis values,
// or origin + number * spacing in double; float32 when all three axes are.
// Cells of polygonal data are numbered as VTK does: VERTICES, LINES, POLYGONS, TRIANGLE_STRIPS; a
// vertex, line, triangle or quad among them has that type.
// Arrays: those of POINT_DATA and CELL_DATA that have values for every vertex or cell, role "";
// BLANKING of old structured grids. Bits are uint8. Strings and variants are uint32, role
// "vtk:string": places in vtk/strings/<i>.
// vtkIdType is 32 bits wide in binary files (as VTK writes it) and read as 64 bits from text.
// COLOR_SCALARS are uint8 in binary files and float32 (0..1) in text, as they are stored.
//
// Extras:
//   vtk/skeleton             text: the file without its numbers, line by line in file order (below)
//   vtk/cell_types           int32[blocks]: VTK cell type of each block; not of structured data
//   vtk/data/<k>             values of the array that the skeleton calls x<k>: numbers in their own
//                            type, shape {tuples, components}; string, variant and bit arrays as
//                            uint8: exactly the file's bytes (binary strings, packed bits) or its
//                            words, one value a line (text strings, variants), or 0/1 (text bits)
//   vtk/strings/<i>          uint8: the different strings of array i of the schema one after the
//                            other, as vtk/data/<k> has them
// Polyhedra have the shape `faces`. Where one has a face without points, or that has its first one
// twice, all have the shape polyhedron, and there are
//   vtk/polyhedron/cells     int64[n], refers to cells: the polyhedra
//   vtk/polyhedron/faces     int64[n]: number of faces of each
//   vtk/polyhedron/face_sizes int64: number of vertices of each face, polyhedron by polyhedron
//
// The skeleton: version ("5.1"), title and ASCII or BINARY on the first three lines, then
//   DATASET <kind>                  absent: UNSTRUCTURED_GRID
//   FIELD <name> <arrays>           its arrays follow; before POINT_DATA/CELL_DATA: dataset's own
//   POINTS <type>                   declared type of the coordinates
//   CELLS [<type> <type>]           with types: OFFSETS and CONNECTIVITY (5.x), without: rows
//   VERTICES | LINES | POLYGONS | TRIANGLE_STRIPS <cells> [<type> <type>]
//   DIMENSIONS | EXTENT | SPACING | ASPECT_RATIO | ORIGIN <words>   as they stand in the file
//   CELL_DATA | POINT_DATA
//   <KIND> <ref> <name> <type> <components> <tuples> [<lookup table>]
//                                   KIND: SCALARS, VECTORS, ..., X_COORDINATES, ... or ARRAY for
//                                   one of a FIELD;
//                                   ref: a<i> is array i of the schema, x<k> is vtk/data/<k>;
//                                   an array may stand once in each kind, as VTK writes those that
//                                   are scalars and vectors
//   NULL_ARRAY                      a gap in a FIELD
//   |<text>                         METADATA of the array above
// Names are %-encoded as they stand in the file.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "transfer/format.h"

namespace shm::converters {

// True when a file that starts with `head` is a VTK legacy file.
bool looks_like_vtk(std::span<const std::byte> head);

// Reads the whole structure, and text arrays into `spool`, which must outlive the result; binary
// arrays stay in the file, which must not change. Throws Failure.
std::unique_ptr<MeshSource> open_vtk(const std::string& path, Spool& spool);

// Writes `mesh` front to back. A mesh that came from VTK gets its data set, version, encoding,
// title and arrays back as they were; where points or cells no longer are in the order that its
// dimensions or lists state (Order::stream and free), it becomes an unstructured grid. Any other
// mesh becomes binary version 4.2 (5.1 beyond 2^31 entries), with the last time step's values and
// time; one from a VTU file with all that a legacy file can hold of it (vtk_from_vtu.h). Throws
// Failure (output) when the disk fails.
void write_vtk(MeshSource& mesh, const std::string& path, Spool& spool);

extern const Format kVtkFormat;

}  // namespace shm::converters
