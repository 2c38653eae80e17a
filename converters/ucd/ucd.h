// AVS UCD files (text) as meshes.
//
// In the model: one block for each material and cell type, in order of first appearance;
// BlockInfo::id is the material. If there would be more than 1024 blocks, there is one block per
// cell type (id 0), and the materials are in an array. Node and cell data are float64 arrays, one
// for each labelled component. Pyramids have their apex first in the file, last in the model.
//
// Arrays with a role:
//   ucd:node_id, ucd:cell_id   int64, only if the numbers are not 1, 2, 3, ...
//   ucd:material               int64, only if block ids are not the materials
//
// Extras:
//   ucd/comments               text: the lines before the counts, each begins with '#'
//   ucd/point_units, ucd/cell_units   text: a line for each array with the text after its label,
//                              from the comma on; an empty line if it has none
//   ucd/model_values           int64 [1]: number of values of the model
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

// Recognizes the format by content. `head` is the beginning of the file, up to 4096 bytes.
bool looks_like_ucd(std::span<const std::byte> head);

// Opens a file. Reads all data into `spool`, which must outlive the mesh. If nodes are not numbered
// from 1, needs another 16 bytes of memory per vertex. Throws Failure; its code is unsupported for
// binary files.
std::unique_ptr<MeshSource> open_ucd(const std::string& path, Spool& spool);

// Writes a mesh. If the mesh came from UCD, all its data is written. For other meshes, block ids
// become the materials, and the arrays without a role become data; of stepped arrays the last step
// is written. Throws Failure: unsupported for cells that UCD does not have, output if the disk
// fails.
void write_ucd(MeshSource& mesh, const std::string& path);

extern const Format kUcdFormat;

}  // namespace shm::converters
