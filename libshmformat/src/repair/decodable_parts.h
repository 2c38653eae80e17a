// DecodableParts: the parts of a damaged file that can be decoded: of each segment the groups
// before the first damaged group; of these groups the arrays whose bitstreams are undamaged; and
// the step values that cover all these groups of a segment and refer to no lost values.
// in:  FoundChunks
// out: the entries that an index of these parts would have
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
  container::Index totals;           ///< of the whole file, as far as known; without entries
  std::uint64_t index_offset = 0;
  bool has_index = false;

  /// Groups in file order. Each segment keeps its groups up to the first that is lost.
  std::vector<container::IndexEntry> groups;
  std::vector<std::uint64_t> group_numbers;  ///< by group: its number in the file
  /// First group of each segment that has any group left, and the end of the last one.
  std::vector<std::size_t> first_group;
  /// By segment: lost static arrays, ascending.
  std::vector<std::vector<std::uint32_t>> lost_arrays;
  /// By segment: true if nothing of it is known to be lost.
  std::vector<bool> whole;

  /// A part of step values, with offset and length of the chunk that contains it.
  struct Part {
    std::uint64_t offset = 0, bytes = 0;
    container::StepEntry values;
  };
  struct Step {
    std::uint32_t array = 0;
    std::uint64_t step = 0;
    bool refers = false;  ///< true if any of its parts, including lost ones, refers to another step
    std::vector<Part>
        parts;  ///< values.group: index into `groups`; values.first: element index within this list
  };
  std::vector<Step> steps;  ///< by array, then by step
  /// Array and step of all step values in the index.
  std::set<std::pair<std::uint32_t, std::uint64_t>> listed_steps;
  std::vector<container::IndexEntry> extras, step_times;

  /// Must hold: `known` has a schema.
  static DecodableParts of(const FoundChunks& known);
};

}  // namespace shm
