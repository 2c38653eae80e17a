// Pairs the blocks and the time steps of two meshes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/stored_value.h"
#include "compare/diff.h"
#include "compare/field_pairs.h"

namespace shm::converters {

struct BlockPairs {
  // Class of each block. Blocks of both meshes that may hold the same cells have the same class.
  std::vector<std::uint32_t> class_a, class_b;
  struct Difference {
    std::string what, a, b;
    bool only_a = false, only_b = false;
  };
  std::vector<Difference> differences;
};

// Pairs blocks of meshes of the same format by id and name, then by id, then by name. If the
// formats differ, blocks are compared only if both formats have them (VTK has none), and their
// cells are compared by shape.
BlockPairs pair_blocks(const MeshInfo& a, const MeshInfo& b, bool one_format);

// Returns text such as "block 3 'steel' of hexahedron cells with 8 nodes".
std::string block_text(const BlockInfo& block);

struct StepPair {
  std::uint64_t a, b;
};

// If both meshes have the same number of steps, pairs the steps in order. Otherwise pairs steps
// with equal times, provided that times ascend. Adds differences to `result`: times that differ,
// and steps that only one mesh has.
std::vector<StepPair> pair_steps(const MeshInfo& a, const MeshInfo& b, bool one_format,
                                 const Likeness& likeness, std::uint64_t limit, MeshDiff& result);

// Returns the steps at which both sides of a field are compared. A side without steps is compared
// with all steps of the other side. If the whole mesh of this side has no steps, the side is
// compared only with the last step of the other side.
std::vector<StepPair> steps_of(const FieldPair& field, const std::vector<StepPair>& common,
                               std::uint64_t steps_a, std::uint64_t steps_b);

}  // namespace shm::converters
