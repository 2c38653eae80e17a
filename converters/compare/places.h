// Describes where two meshes differ, in space and in time.
#pragma once

#include <cstdint>

#include "compare/diff.h"
#include "compare/field_pairs.h"
#include "compare/pairs.h"
#include "compare/values.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// Returns the place of a field value at a step. `a` and `b` are the numbers of its vertex or cell
// in meshes A and B.
DiffPlace place_of(const StepPair& step, const FieldPair& field, std::uint64_t a, std::uint64_t b,
                   const MeshInfo& info_a, const MeshInfo& info_b);

ValueRange range_of_points(MeshSource& mesh);

// Sets the coordinates of all places (DiffPlace) in a MeshDiff: the coordinates in A, or those in B
// if A has no such vertex or cell.
class PlaceFinder {
 public:
  PlaceFinder(MeshSource& a, MeshSource& b) : a_(a), b_(b) {}
  void fill(MeshDiff& diff);

 private:
  void fill(MeshDiff& diff, MeshSource& mesh, bool is_a);
  MeshSource &a_, &b_;
};

}  // namespace shm::converters
