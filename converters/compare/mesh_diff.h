// Finds the differences between two meshes of any formats: which items differ, by how much, and
// where. Indices of vertices, cells, steps and components start at 0.
//
// Meshes of the same format are compared completely. If the formats differ, only data that both
// formats can store is compared: coordinates, cells, fields (a vector may be separate component
// arrays in one mesh), strings of legacy VTK and VTU, times, and block ids (which are an array in
// VTK). Data that only one format supports (number maps, sets, titles, field data) is not compared.
// Different scalar types are reported as a note, not as a difference. If one format has no steps,
// its mesh is compared with the final step of the other mesh.
//
// Memory is bounded, except with the option `match` (see mesh_match.h).
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
