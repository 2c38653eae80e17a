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
  // Class of each block. A cell of A and a cell of B can be equal only if their blocks have the
  // same class.
  std::vector<std::uint32_t> class_a, class_b;
  struct Difference {
    std::string what, a, b;
    bool only_a = false, only_b = false;
  };
  std::vector<Difference> differences;
};

// Pairs blocks of meshes of the same format by id and name, then by id, then by name. If the
// formats differ, blocks are compared only if both formats have blocks (VTK does not), and blocks
// whose cells have the same shape get the same class.
BlockPairs pair_blocks(const MeshInfo& a, const MeshInfo& b, bool one_format);

// Returns text such as "block 3 'steel' of hexahedron cells with 8 nodes".
std::string block_text(const BlockInfo& block);

struct StepPair {
  std::uint64_t a, b;
};

// If both meshes have the same number of steps, pairs the i-th step of A with the i-th step of B.
// Otherwise, if the times ascend, pairs steps with equal times. Adds the differences to `result`:
// pairs with different times, and steps that only one mesh has.
std::vector<StepPair> pair_steps(const MeshInfo& a, const MeshInfo& b, bool one_format,
                                 const Likeness& likeness, std::uint64_t limit, MeshDiff& result);

// Returns the pairs of steps at which a field of A is compared with the same field of B. A field
// that does not change with time is compared with all steps of the other field. However, if its
// mesh has no steps at all, the field is compared only with the final step of the other field.
std::vector<StepPair> steps_of(const FieldPair& field, const std::vector<StepPair>& common,
                               std::uint64_t steps_a, std::uint64_t steps_b);

}  // namespace shm::converters
