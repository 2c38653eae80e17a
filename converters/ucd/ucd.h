// AVS UCD files (text) as meshes.
//
// In the model: one block for each material and cell type, in order of first appearance;
// BlockInfo::id is the material. Where these are more than 1024, one for each type (id 0), the
// materials in an array. Node and cell data are float64 arrays, one for each labelled component.
// Pyramids have their apex first in the file, last in the model.
//
// Arrays with a role:
//   ucd:node_id, ucd:cell_id   int64, only when they do not count up from 1
//   ucd:material               int64, only when it is not that of the block
//
// Extras:
//   ucd/comments               text: the lines before the counts, each begins with '#'
//   ucd/point_units, ucd/cell_units   text: a line for each array, what stands behind its label
//                              from the comma on; an empty one where there is no comma
//   ucd/model_values           int64 [1]: number of values of the model
//   ucd/model                  text: what stands behind the data of nodes and cells
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>

#include "base/spool.h"
#include "mesh/mesh_source.h"
#include "transfer/format.h"

namespace shm::converters {

// By content: `head` is the beginning of the file, up to 4096 bytes.
bool looks_like_ucd(std::span<const std::byte> head);

// Reads everything into `spool`, which must outlive the mesh; 16 bytes a vertex besides where nodes
// are not numbered from 1. Throws Failure; unsupported for binary files.
std::unique_ptr<MeshSource> open_ucd(const std::string& path, Spool& spool);

// A mesh that came from UCD comes back as it was. Of any other one: block ids are the materials;
// arrays without a role, of stepped ones the last step. Throws Failure: unsupported for cells that
// UCD has no word for, output when the disk fails.
void write_ucd(MeshSource& mesh, const std::string& path);

extern const Format kUcdFormat;

}  // namespace shm::converters
