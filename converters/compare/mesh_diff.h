// Differences between any two meshes of any formats: the differing items, the size of each
// difference, and its place. Numbers of vertices, cells, steps and components start at 0, as in the
// files.
//
// Meshes of the same format are compared completely. Meshes of different formats are compared in
// the data that both formats can hold: coordinates, cells, fields (a vector also with its
// components in separate arrays), strings of legacy VTK and VTU, times, and block ids if VTK has
// them as an array. Data that only one format knows (number maps, sets, titles, field data) is not
// compared. Different scalar types are reported as a note, not as a difference. A mesh of a format
// without steps is taken to hold the last step.
//
// Memory is bounded; for `match` see mesh_match.h.
#pragma once

#include "base/progress.h"
#include "base/spool.h"
#include "compare/diff.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Compares two meshes. Throws Failure (misuse) for names that occur in neither mesh.
MeshDiff diff_meshes(MeshSource& a, MeshSource& b, const DiffOptions& options, Spool& spool,
                     const Progress& progress = {});

}  // namespace shm::converters
