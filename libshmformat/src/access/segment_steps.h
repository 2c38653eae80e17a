// SegmentSteps: one stepped array in one segment, read from a key step on to the step that is
// wanted: group by group, all these steps of a group together, so that the topology is decoded
// once.
// in:    an IndexedFile and its StepIndex
// out:   values of the wanted step, group by group
// keeps: the values of the last step, and of the one before it where trends are allowed
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "access/step_index.h"
#include "steps/step_parts.h"

namespace shm {

/// What is held of an array in a segment between reads.
struct HeldSteps {
  std::optional<std::size_t> at;          ///< which of StepIndex::steps()
  std::vector<std::byte> last, one_back;  ///< values of that step, and of the one before it
};

class SegmentSteps {
 public:
  /// Everything is borrowed. Must hold: the array is stepped and has a step `wanted`. What `held`
  /// has is used and replaced.
  SegmentSteps(IndexedFile& file, const StepIndex& index, StepReference most, std::uint32_t array,
               std::size_t segment, std::size_t wanted, HeldSteps& held);

  /// Whether values are predicted over the mesh.
  bool needs_mesh() const;
  /// Whether all groups have been read.
  bool at_end() const { return next_ == parts_of(wanted_).size(); }
  /// The next group that has elements of the array. Must hold: not at_end().
  const StepIndex::Part& next_part() const { return parts_of(wanted_)[next_]; }

  /// How many elements the array has in the segment, as the index states.
  std::uint64_t elements() const;

  /// The elements of the group of a part; fails where they are another number.
  Result<ColumnElements> elements_of(StepElements& mesh, const StepIndex::Part& part) const;
  /// The values of next_part() at the wanted step. `mesh` is of the segment; null unless
  /// needs_mesh().
  Result<std::vector<std::byte>> read_next(StepElements* mesh);

 private:
  /// A run of steps that are read together.
  struct Pass {
    std::size_t from, end;  // of StepIndex::steps()
  };

  std::span<const StepIndex::Part> parts_of(std::size_t at) const {
    return index_->parts(index_->steps(array_)[at], file_->first_group(segment_),
                         file_->first_group(segment_ + 1));
  }
  bool has_same_groups(std::size_t at) const;
  Result<void> read_earlier_passes(StepElements* mesh);
  std::uint64_t most_kept() const;
  void begin_pass();
  Result<void> read_group(std::size_t nth, StepElements* mesh);
  Result<void> read_step(std::size_t at, std::size_t nth, const ColumnElements* elements);
  Result<std::vector<std::byte>> decode(std::size_t at, const StepIndex::Part& part,
                                        const ColumnElements* elements);
  Result<void> check_reference(std::size_t at, const container::StepHeader& header) const;
  void hold(std::size_t offset);
  bool told_by_mesh(std::size_t at) const;
  const ArrayInfo& info() const { return file_->schema().arrays[array_]; }

  IndexedFile* file_;
  const StepIndex* index_;
  StepReference most_;
  std::uint32_t array_;
  std::size_t segment_, wanted_, key_, from_;
  HeldSteps* held_;
  std::size_t next_ = 0;  // of the wanted step's parts
  bool begun_ = false;

  Pass pass_{};
  std::vector<std::optional<StepParts>> columns_;  // of the steps of the pass
  std::vector<bool> by_mesh_;                      // the same
  // of the group at hand
  std::vector<std::byte> values_, one_back_, two_back_, trend_;
};

}  // namespace shm
