// DecodableParts: what can be decoded of a damaged file: of each segment the groups before the
// first that is hurt, of these the arrays whose bitstreams are whole, and step values that stand
// for all of these groups of a segment and refer to none that are lost.
// in:  FoundChunks        out: what an index would list of them
// spec: "Recovery"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "recovery/found_chunks.h"

namespace shm {

struct DecodableParts {
  std::vector<std::byte> beginning;  ///< file start and schema chunk
  container::Index totals;           ///< of the whole file, as far as is known; no entries
  std::uint64_t index_offset = 0;
  bool has_index = false;

  /// Groups of the file in order. A segment's are those from its first one on.
  std::vector<container::IndexEntry> groups;
  std::vector<std::uint64_t> group_numbers;  ///< in the file, of each
  /// Beginning of each segment of which there is something, and the end of the last one.
  std::vector<std::size_t> first_group;
  /// By segment: static arrays that are lost in it, ascending.
  std::vector<std::vector<std::uint32_t>> lost_arrays;
  /// By segment: whether nothing of it is lost, as far as is known.
  std::vector<bool> whole;

  /// A part of step values, and where the chunk stands that has it.
  struct Part {
    std::uint64_t offset = 0, bytes = 0;
    container::StepEntry values;
  };
  struct Step {
    std::uint32_t array = 0;
    std::uint64_t step = 0;
    bool refers = false;      ///< any of its parts, lost ones too
    std::vector<Part> parts;  ///< group: place in `groups`; first: in this list
  };
  std::vector<Step> steps;  ///< by array, then by step
  /// Array and step of all step values that the index lists.
  std::set<std::pair<std::uint32_t, std::uint64_t>> listed_steps;
  std::vector<container::IndexEntry> extras, step_times;

  /// Must hold: there is a schema.
  static DecodableParts of(const FoundChunks& known);
};

}  // namespace shm
