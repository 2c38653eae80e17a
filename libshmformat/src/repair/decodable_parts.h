// DecodableParts: the parts of a damaged file that can be decoded:
// - in each segment, the groups before the first damaged group;
// - in these groups, the arrays whose bitstreams are undamaged;
// - the step values that cover all these groups of a segment and refer to no lost values.
//
// DecodableParts is computed from FoundChunks. It describes each part by an index entry, as if the
// parts were a file of their own.
// spec: "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "repair/found_chunks.h"

namespace shm {

struct DecodableParts {
  std::vector<std::byte> beginning;  ///< file start and schema chunk
  /// Totals of the whole file, if they are known. The member `entries` is empty.
  container::Index totals;
  std::uint64_t index_offset = 0;
  bool has_index = false;

  /// Decodable groups in file order: in each segment, the groups before the first lost group.
  std::vector<container::IndexEntry> groups;
  std::vector<std::uint64_t> group_numbers;  ///< number of each group in the file

  /// Index in `groups` of the first group of each segment. Contains only segments that have
  /// decodable groups. The last entry is the number of groups.
  std::vector<std::size_t> first_group;
  /// Lost static arrays of each segment, in ascending order.
  std::vector<std::vector<std::uint32_t>> lost_arrays;
  /// For each segment: true if the segment is complete, as far as known.
  std::vector<bool> whole;

  /// Part of step values, with offset and length of the chunk that contains it.
  struct Part {
    std::uint64_t offset = 0, bytes = 0;
    container::StepEntry values;
  };
  struct Step {
    std::uint32_t array = 0;
    std::uint64_t step = 0;
    /// Reference of all parts of the step, including lost parts.
    StepReference reference = StepReference::nothing;
    /// Decodable parts of the step. In each part, values.group is an index in `groups`, and
    /// values.first is the number of elements in the preceding parts of this list.
    std::vector<Part> parts;
  };
  std::vector<Step> steps;  ///< sorted by array, then by step

  /// Contains (array, step number) if the original index lists values of the array at this step.
  std::set<std::pair<std::uint32_t, std::uint64_t>> listed_steps;
  std::vector<container::IndexEntry> extras, step_times;

  /// Finds the parts that can be decoded. Precondition: `known` has a schema.
  static DecodableParts of(const FoundChunks& known);
};

}  // namespace shm
