// The difference of any two meshes, of whatever formats: what differs, by how much, and where.
// Numbers of vertices, cells, steps and components count from 0, as in the files.
//
// Of one format, all is compared. Between formats, what both can hold: coordinates, cells, fields
// (a vector also against its components apart), strings of legacy VTK and VTU, times, ids of blocks
// where VTK has them as an array; what only one of them knows (number maps, sets, titles, field
// data) is not, and other scalar types are a note, no difference. A format without steps is taken
// to hold the last one.
//
// Memory: bounded; with `match`, see mesh_match.h.
#pragma once

#include "base/progress.h"
#include "base/spool.h"
#include "compare/diff.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Throws misuse for names that fit nothing in either mesh.
MeshDiff diff_meshes(MeshSource& a, MeshSource& b, const DiffOptions& options, Spool& spool,
                     const Progress& progress = {});

}  // namespace shm::converters
