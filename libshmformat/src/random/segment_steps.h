// SegmentSteps: reads one stepped array in one segment, from a key step or its base to the wanted
// step, through an IndexedFile and its StepIndex. It reads group by group, and returns the values
// of the wanted step for each group. It reads all steps of a group together, so that the topology
// of the group is decoded only once. It keeps the values of the most recently decoded step. If
// trends are allowed, it also keeps the values of the step before that.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "random/step_index.h"
#include "steps/bundle_chunk.h"
#include "steps/step_parts.h"
#include "steps/step_store.h"

namespace shm {

/// Values of an array in one segment, stored from one request to the next.
struct HeldSteps {
  /// Holds steps of `bytes` bytes each. `store` must outlive it.
  HeldSteps(StepStore& store, std::uint64_t bytes) : last(store, bytes), one_back(store, bytes) {}

  /// Index in StepIndex::steps() of the step whose values are in `last`.
  std::optional<std::size_t> at;
  StepBytes last, one_back;  ///< values of the step `at` and of the previous step
};

/// The bundles that were decoded most recently. They are shared by all arrays of a reader.
class HeldBundles {
 public:
  /// Returns the bundle of the chunk at this offset, or nullptr if it is not held. The result is
  /// valid until the next call of keep().
  const BundleChunk* find(std::uint64_t offset);
  /// Keeps a bundle. Drops the one that was not used for the longest time if there are too many.
  const BundleChunk* keep(std::uint64_t offset, BundleChunk bundle);

 private:
  static constexpr std::size_t kMost = 4;
  // Bundles and the offsets of their chunks. The most recently used one is the last.
  std::vector<std::pair<std::uint64_t, BundleChunk>> bundles_;
};

class SegmentSteps {
 public:
  /// Creates a reader of step `wanted`. All references are borrowed. Precondition: the array is
  /// stepped and has a step `wanted`. The reader uses and replaces what `held` and `bundles`
  /// contain. Precondition: `held` has room for elements() elements.
  SegmentSteps(IndexedFile& file, const StepIndex& index, StepReference most, std::uint32_t array,
               std::size_t segment, std::size_t wanted, HeldSteps& held, HeldBundles& bundles);

  /// Returns true if decoding needs the mesh, because some values are predicted from neighbours in
  /// the mesh.
  bool needs_mesh() const;
  /// Returns true if all groups have been read.
  bool at_end() const { return next_ == parts_of(wanted()).size(); }
  /// Returns the part of the next group that has elements of the array. Precondition: at_end() is
  /// false.
  const StepIndex::Part& next_part() const { return parts_of(wanted())[next_]; }

  /// Returns the number of elements of the array in the segment, according to the index.
  std::uint64_t elements() const;

  /// Returns the elements of the group to which a part belongs. Fails if their number differs from
  /// the number that the part states.
  Result<ColumnElements> elements_of(StepElements& mesh, const StepIndex::Part& part) const;
  /// Returns the values of next_part() at the wanted step. `mesh` provides the elements of the
  /// segment; it may be null if needs_mesh() is false.
  Result<std::vector<std::byte>> read_next(StepElements* mesh);

 private:
  /// Range of steps that are read together.
  struct Pass {
    std::size_t from, end;  // range of indices in chain_; `end` is excluded
  };

  std::size_t wanted() const { return chain_.back(); }
  const StepIndex::Step& step_at(std::size_t i) const { return index_->steps(array_)[chain_[i]]; }
  std::span<const StepIndex::Part> parts_of(std::size_t step) const {
    return index_->parts(index_->steps(array_)[step], file_->first_group(segment_),
                         file_->first_group(segment_ + 1));
  }
  bool has_same_groups(std::size_t step) const;
  Result<void> read_earlier_passes(StepElements* mesh);
  std::uint64_t most_kept() const;
  void begin_pass();
  Result<void> read_group(std::size_t nth, StepElements* mesh);
  Result<void> read_step(std::size_t i, std::size_t nth, const ColumnElements* elements);
  Result<std::vector<std::byte>> decode(std::size_t i, const StepIndex::Part& part,
                                        const ColumnElements* elements);
  Result<std::vector<std::byte>> values_in(const BundleChunk& bundle, std::size_t i,
                                           const StepIndex::Part& part) const;
  Result<void> check_reference(std::size_t i, const container::StepHeader& header) const;
  Result<void> hold(std::uint64_t offset);
  std::uint64_t group_number(const StepIndex::Part& part) const;
  bool told_by_mesh(std::size_t step) const;
  const ArrayInfo& info() const { return file_->schema().arrays[array_]; }

  IndexedFile* file_;
  const StepIndex* index_;
  StepReference most_;
  std::uint32_t array_;
  std::size_t segment_;
  std::vector<std::size_t> chain_;  // steps to decode, see StepIndex::chain()
  std::size_t from_ = 0;            // index in chain_ of the first step that held_ does not contain
  HeldSteps* held_;
  HeldBundles* bundles_;
  std::size_t next_ = 0;  // index of the next part of the wanted step
  bool begun_ = false;

  Pass pass_{};
  std::vector<std::optional<StepParts>> columns_;  // decoder of each step of the pass
  // For each step of the pass: true if values are predicted from neighbours in the mesh.
  std::vector<bool> by_mesh_;

  // Values of the current group at the step that is being decoded, and at earlier steps.
  std::vector<std::byte> values_, one_back_, two_back_, trend_;
};

}  // namespace shm
