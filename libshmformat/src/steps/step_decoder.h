// StepDecoder: decodes step_values chunks to values of stepped arrays. StepEncoder encodes them.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "shm/blocks.h"
#include "shm/limits.h"
#include "steps/bundle_chunk.h"
#include "steps/step_memory.h"
#include "steps/step_parts.h"

namespace shm {

class StepDecoder {
 public:
  /// Creates a decoder. `schema` must have passed check_schema(). `topology` is the topology of the
  /// whole mesh. Both must outlive the decoder. `elements` lists the number of elements of each
  /// array. `kept` says where values of earlier steps are stored.
  StepDecoder(const Schema& schema, const ReadLimits& limits, StepTopology& topology,
              std::vector<std::uint64_t> elements, KeptSteps kept);

  /// States whether the digests of all parts from now on are added up. Precondition: the topology
  /// has the numbers that digests need, or `has_digests` is false.
  void use_digests(bool has_digests) { has_digests_ = has_digests; }
  /// Returns the sum of the digests of the parts since the previous call.
  std::uint64_t take_digest() { return std::exchange(digest_, 0); }

  /// Decodes the values of a part. `file` is the size in bytes of the file up to the end of the
  /// part. Errors contain no offset.
  Result<StepPiece> read(const container::StepHeader& header, std::span<const std::byte> bytes,
                         std::uint64_t file);
  /// Returns the values of a pair of an array and a step of a bundle. Otherwise as above.
  Result<StepPiece> read(const BundleChunk& bundle, std::size_t pair, std::uint64_t file);
  /// Returns true if all values of the most recent step have been decoded.
  bool is_complete() const { return array_ == kNone || last_[array_].first == elements_[array_]; }

 private:
  /// State of an array at its most recent step.
  struct Last {
    bool begun = false;
    // Number of the most recent step, and index of the next element whose value at this step is to
    // be read.
    std::uint64_t step = 0, first = 0;
    std::size_t groups = 0;  // number of groups read
    StepMemory values;
    std::uint64_t step_before = 0;
    // Number of steps from the most recent key step to `step_before` (the step before `step`), both
    // included.
    std::uint32_t run = 0;
    StepReference reference = StepReference::nothing;  // of the parts of `step`
    std::optional<std::uint64_t> base;                 // number of the base, if there is one
  };

  Result<void> begin_part(const container::StepHeader& header, std::uint64_t file);
  Result<StepPiece> end_part(const container::StepHeader& header, std::vector<std::byte> values);
  Result<void> begin_step(const container::StepHeader& header, std::uint64_t file);
  Result<void> expect_group(const container::StepHeader& header);
  Result<void> check_reference(const container::StepHeader& header) const;
  Result<std::vector<std::byte>> decode(const container::StepHeader& header,
                                        std::span<const std::byte> bytes);

  const Schema* schema_;
  ReadLimits limits_;
  StepElements mesh_;
  std::vector<std::uint64_t> elements_;
  std::unique_ptr<StepStore> store_;
  std::vector<Last> last_;  // state of each array

  // State of the current step and its array.
  std::uint32_t array_ = kNone;
  std::optional<StepParts> parts_;

  bool has_digests_ = false;
  std::uint64_t digest_ = 0;
};

}  // namespace shm
