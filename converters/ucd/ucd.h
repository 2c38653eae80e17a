// AVS UCD files (text) as meshes.
//
// A mesh has one block for each combination of material and cell type, in the order in which the
// combinations first occur; BlockInfo::id is the material. If there would be more than 1024 blocks,
// the mesh has one block per cell type (id 0), and the materials are in an array. Node and cell
// data are float64 arrays, one for each labelled component. The apex of a pyramid is its first node
// in the file and its last node in the mesh.
//
// Arrays with a role:
//   ucd:node_id, ucd:cell_id   int64: node and cell numbers; exist only if the numbers are not
//                              1, 2, 3, ...
//   ucd:material               int64: material of each cell; exists only if the materials are not
//                              stored as block ids
//
// Extras:
//   ucd/comments               text: the lines before the counts; each line begins with '#'
//   ucd/point_units, ucd/cell_units
//                              text: one line for each array; the line contains the text after the
//                              array's label, from the comma on, and is empty if the label has no
//                              text
//   ucd/model_values           int64 [1]: number of values of the model data
//   ucd/model                  text: everything after the data of nodes and cells
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "interface/format.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns true if a file is a UCD file. `head` is the beginning of the file, up to 4096 bytes.
bool looks_like_ucd(std::span<const std::byte> head);

// Opens a file. Reads all data into `spool`, which must outlive the mesh. If the node numbers are
// not 1, 2, 3, ..., the mesh needs another 16 bytes of memory per node. Throws Failure; its error
// code is `unsupported` for binary files.
std::unique_ptr<MeshSource> open_ucd(const std::string& path, Spool& spool);

// Writes a mesh. If the mesh came from a UCD file, all its data is written. For any other mesh,
// block ids become the materials, and arrays without a role become node or cell data; stepped
// arrays are written with the values of their last step. Throws Failure: unsupported for cells that
// UCD does not have, output on a disk error.
void write_ucd(MeshSource& mesh, const std::string& path);

extern const Format kUcdFormat;

}  // namespace shm::converters
