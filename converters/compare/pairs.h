// Which block and which time step of one mesh belongs to which of another.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/stored_value.h"
#include "compare/diff.h"
#include "compare/field_pairs.h"

namespace shm::converters {

struct BlockPairs {
  // Of each block: blocks of both meshes that may hold the same cells are of one class.
  std::vector<std::uint32_t> class_a, class_b;
  struct Difference {
    std::string what, a, b;
    bool only_a = false, only_b = false;
  };
  std::vector<Difference> differences;
};

// Of one format: by id and name, then by id, then by name; or all in their order where they are
// alike. Between formats, blocks are compared as far as both have them (VTK has none), and their
// cells by shape.
BlockPairs pair_blocks(const MeshInfo& a, const MeshInfo& b, bool one_format);

// "block 3 'steel' of hexahedra with 8 nodes"
std::string block_text(const BlockInfo& block);

struct StepPair {
  std::uint64_t a, b;
};

// As many steps of both: in their order. Else those of equal times, where times ascend. What
// differs goes to `result`: times, and steps of one mesh only.
std::vector<StepPair> pair_steps(const MeshInfo& a, const MeshInfo& b, bool one_format,
                                 const Likeness& likeness, std::uint64_t limit, MeshDiff& result);

// The steps at which both sides of a field are compared. A static side stands for all steps of the
// other where that has values at every step, and for the last one where a mesh has no steps.
std::vector<StepPair> steps_of(const FieldPair& field, const std::vector<StepPair>& common,
                               std::uint64_t steps_a, std::uint64_t steps_b);

}  // namespace shm::converters
