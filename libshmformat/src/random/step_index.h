// StepIndex: the entries of the index for stepped arrays. For each array and step, it lists the
// parts of chunks that contain the values, and the earlier step at which reading must begin.
// StepIndex checks that the entries are consistent. It does not check the contents of the chunks;
// readers check these.
// spec: "Index and trailer"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "codecs/shared/codec_id.h"
#include "random/indexed_file.h"

namespace shm {

class StepIndex {
 public:
  /// A part of the values of a step, with the position of the part's chunk. The chunk may contain
  /// other parts, too.
  struct Part {
    std::uint64_t offset = 0, bytes = 0;  // position and size in bytes of the chunk
    // Index, in the array, of the first element of the part; number of elements.
    std::uint64_t first = 0, count = 0;
    std::uint32_t group = 0;
    StepReference reference = StepReference::nothing;
    container::Codec codec = container::Codec::columns;
  };
  struct Step {
    std::uint64_t step = 0;
    StepReference reference = StepReference::nothing;  // of all parts of the step
    // Index of the most recent key step, up to and including this one.
    std::size_t key = 0;
    // Index of the most recent step, up to and including this one, that refers to no other step.
    std::size_t base = 0;
    std::size_t begin = 0, end = 0;
  };

  /// Creates the lists. Precondition: `file` is open. On success, removes the entries of step
  /// values from the index of `file`. For a damaged file, lists only the decodable step values.
  static Result<StepIndex> of(IndexedFile& file);

  const std::vector<Step>& steps(std::uint32_t array) const { return steps_[array]; }
  std::uint64_t elements(std::uint32_t array) const { return elements_[array]; }
  /// Returns the number of elements of each array; 0 for static arrays.
  const std::vector<std::uint64_t>& elements() const { return elements_; }
  /// Returns the parts of the step that belong to the groups from `first_group` to `end_group` - 1,
  /// in order.
  std::span<const Part> parts(const Step& step, std::size_t first_group,
                              std::size_t end_group) const;
  /// Returns the indices of the steps that must be decoded for step `nth`, in order. The last one
  /// is `nth`. Each of them refers to the one before it; a trend also to the one before that.
  std::vector<std::size_t> chain(std::uint32_t array, std::size_t nth) const;

 private:
  Result<void> add_decodable(const IndexedFile& file);
  Result<void> count_elements(const IndexedFile& file);
  Result<void> add(const IndexedFile& file, const container::IndexEntry& entry,
                   const container::StepEntry& part);
  Result<void> add_bundle(const IndexedFile& file, const container::IndexEntry& entry,
                          const container::StepEntry& bundle);
  Result<void> expect_complete(const IndexedFile& file) const;
  void find_keys();

  std::vector<std::uint64_t> elements_;   // number of elements of each array
  std::vector<std::vector<Step>> steps_;  // list of the steps of each array
  std::vector<Part> parts_;
  std::uint32_t last_array_ = 0;    // array of the previous part; not used for the first part
  std::uint64_t bundle_pairs_ = 0;  // number of pairs of an array and a step in bundles
  std::uint64_t step_bytes_ = 0;    // total size of the chunks of step values so far
};

}  // namespace shm
