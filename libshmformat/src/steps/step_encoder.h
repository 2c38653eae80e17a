// StepEncoder: encodes values of stepped arrays as step_values. Each group that has elements of the
// array becomes one part. StepDecoder decodes the parts.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codecs/bundles/bundle_encoder.h"
#include "codecs/shared/special_values.h"
#include "codecs/surface/plan/column_planner.h"
#include "codecs/weighted/weighted_encoder.h"
#include "shm/options.h"
#include "shm/schema.h"
#include "steps/step_memory.h"
#include "steps/step_values.h"

namespace shm {

/// Encodes the values of one array at one step with the codec `columns`.
class StepColumnEncoder : public StepColumn<ColumnPlanner> {
 public:
  using StepColumn::StepColumn;

  /// Encodes the values of the group's elements. `reference` contains the reference values, or is
  /// empty if none exist.
  EncodedColumn encode(const ColumnElements& elements, std::span<const std::byte> values,
                       Level level, const ReferenceValues& reference);
};

/// Encodes the values of one array at one step with the codec `weighted`.
class StepWeightedEncoder : public StepColumn<WeightedEncoder> {
 public:
  using StepColumn::StepColumn;

  /// Does the same as StepColumnEncoder::encode().
  EncodedColumn encode(const ColumnElements& elements, std::span<const std::byte> values,
                       const ReferenceValues& reference);
};

class StepEncoder {
 public:
  /// Function that receives a part: its header, the index of its first element in the array, its
  /// coded values, and the digest of its values.
  using Sink = std::function<Result<void>(const container::StepHeader&, std::uint64_t,
                                          std::span<const std::byte>, std::uint64_t)>;

  /// Function that receives a bundle: the headers of its parts, and its bytes.
  using BundleSink =
      std::function<Result<void>(std::span<const container::StepPart>, std::span<const std::byte>)>;

  /// Creates an encoder. `schema` must have passed check_schema(). `topology` is the topology of
  /// the whole mesh. Both must outlive the encoder. `elements` lists the number of elements of each
  /// array. Among any `key_steps` consecutive steps of an array, at least one is a key step, which
  /// refers at most to the base: the most recent step that refers to no other step.
  /// `kept` says where values of earlier steps are stored.
  StepEncoder(const Schema& schema, StepTopology& topology, std::vector<std::uint64_t> elements,
              std::uint32_t key_steps, KeptSteps kept, Level level, Sink sink);
  /// Allows bundles. The steps of small arrays then wait until they have more than `waiting_bytes`
  /// bytes in total, or until end_steps() is called. If the file already contains step values,
  /// `pairs` is the number of pairs of an array and a step in its bundles, and `bytes` is the total
  /// size of its chunks of step values.
  void use_bundles(BundleSink sink, std::uint64_t waiting_bytes, std::uint64_t pairs = 0,
                   std::uint64_t bytes = 0) {
    bundle_sink_ = std::move(sink);
    most_waiting_bytes_ = waiting_bytes;
    bundle_pairs_ = pairs;
    written_ = bytes;
  }

  /// Sets the number of values after which the codec `columns` is not tried any more, except at
  /// level best. See WriteOptions::slow_step_values.
  void use_slow_codec(std::uint64_t values) { most_slow_values_ = values; }

  /// Computes the digests of all parts.
  void use_digests() { has_digests_ = true; }

  /// Continues an array whose steps up to `last_step` are already in the file. `run` is the number
  /// of steps from the most recent key step to `last_step`, both included. `base` is the number of
  /// the most recent step that refers to no other step, if such a step exists.
  void go_on(std::uint32_t array, std::uint64_t last_step, std::uint32_t run,
             std::optional<std::uint64_t> base);
  /// Returns true if the next step of the array may use this kind of reference.
  bool may_refer(std::uint32_t array, StepReference kind) const;
  /// Stores all values of an earlier step, to which the next step may refer. Call this function
  /// after go_on(). If the next step may refer to a trend, call it for the two most recent steps,
  /// in order; if it may refer to the previous step, only for that step.
  Result<void> remember(std::uint32_t array, std::span<const std::byte> values) {
    return before_[array].values.take(0, values, false);
  }
  /// Returns true if any later step of the array may refer to its base. remember_base() must then
  /// be called with the values of the base.
  bool may_refer_to_base(std::uint32_t array) const {
    return most_ == StepReference::base && before_[array].base.has_value();
  }
  /// Stores all values of the base.
  Result<void> remember_base(std::uint32_t array, std::span<const std::byte> values) {
    return before_[array].values.take_base(values);
  }

  /// The part of a larger mesh that an encoder codes. For each array, `first` is the index of the
  /// part's first element, and `all` is the number of elements in the whole mesh.
  struct Part {
    std::uint32_t first_group = 0;
    std::vector<std::uint64_t> first, all;
  };
  /// Declares that the encoder codes only a part of a larger mesh: the topology and `elements` are
  /// those of the part. Must be called before any other function. Bundles then contain only arrays
  /// of which the part has all elements.
  void begin_part(Part part) { part_ = std::move(part); }
  /// Sets the reference and the codec of the next step. If several encoders code parts of a mesh,
  /// one of them chooses both, and the others receive them through this function.
  void choose(StepBasis basis);
  /// Returns the reference and the codec of the current step, or nullopt if they have not been
  /// chosen yet, or if the step waits.
  std::optional<StepBasis> chosen() const;
  /// Begins a step. No values need to follow if the array has no elements.
  Result<void> begin(std::uint32_t array, std::uint64_t step);

  /// Adds values of a step. Precondition: the array is stepped, and `values` contains whole
  /// elements.
  Result<void> add(std::uint32_t array, std::uint64_t step, std::span<const std::byte> values);
  /// Ends the current step, if there is one.
  Result<void> end_step();
  /// Ends the current step, and encodes the steps that wait.
  Result<void> end_steps();
  /// Returns the number of elements of the array in the whole mesh.
  std::uint64_t elements(std::uint32_t array) const {
    return part_ ? part_->all[array] : elements_[array];
  }
  /// Returns the highest step number so far, plus 1.
  std::uint64_t steps() const { return steps_; }

 private:
  /// State of an array between its steps.
  struct Before {
    StepMemory values;
    std::uint64_t next_step = 0;     ///< lowest step number that may come next
    std::uint64_t encoded_step = 0;  ///< number of the most recent encoded step
    /// Number of steps since the most recent key step, including the key step.
    std::uint32_t run = 0;
    std::optional<std::uint64_t> base;  ///< number of the most recent step that refers to no other
    /// Coded size in bytes of the first group of the base, if it is coded with `terms`.
    std::size_t base_bytes = 0;
    /// Number of the most recent steps that choose_terms() coded without a reference.
    std::uint32_t alone = 0;
    /// Reference that choose_terms() chose most recently.
    StepReference liked = StepReference::nothing;
    /// Coded size in bytes of the first group at the step at which `liked` was chosen; 0 if the
    /// next step must choose again.
    std::size_t liked_bytes = 0;
  };
  /// The values of a group at one step, coded with `terms`. `refers` is true if any value is
  /// predicted from the reference values.
  struct StepTerms {
    bool refers = false;
    EncodedColumn column;
  };
  /// A step of an array that waits.
  struct Waiting {
    std::uint32_t array = 0;
    std::uint64_t step = 0;
    std::vector<std::byte> values;
  };
  /// A part that has been encoded while steps wait.
  struct EncodedPart {
    container::StepHeader header;
    std::uint64_t first = 0;
    std::vector<std::byte> bytes;
    std::uint64_t digest = 0;
  };
  /// The steps of an array that waits, and how they may be coded.
  struct WaitingArray {
    std::uint32_t array = 0;
    std::vector<const Waiting*> steps;
    ValuesOfSteps values;
    std::uint32_t group = 0;
    std::uint64_t digest = 0;  ///< of the values of all these steps
    PlannedColumns columns;
    bool is_bundled = false;         ///< true if a bundle can contain the array
    std::size_t bundled = 0;         ///< approximate number of bytes in a bundle
    std::vector<EncodedPart> parts;  ///< ordinary parts; empty if they are larger or not tried

    std::size_t bytes_of_parts() const;
  };
  class Bundles;

  Result<void> begin_step(std::uint32_t array, std::uint64_t step);
  void begin_encoding(std::uint32_t array, std::uint64_t step);
  Result<void> encode_values(std::span<const std::byte> values);
  void end_encoding();
  bool may_wait(std::uint32_t array);
  Result<void> encode_waiting();
  Result<void> encode_set(std::uint64_t first, std::uint64_t steps,
                          std::vector<WaitingArray>& arrays);
  Result<std::uint32_t> group_of(std::uint32_t array);
  Result<void> encode_parts(WaitingArray& array);
  Result<void> begin_group();
  Result<void> end_group();
  Result<void> remember(std::uint32_t array, std::uint64_t offset,
                        std::span<const std::byte> values, bool is_base);
  bool is_rounded(std::uint32_t array) const;
  std::vector<std::byte> rounded(std::uint32_t array, std::span<const std::byte> values) const;
  Result<std::uint64_t> digest_of(std::uint32_t array, std::uint64_t step, std::size_t group,
                                  std::uint64_t first, std::span<const std::byte> values);
  Result<EncodedColumn> encode();
  Result<EncodedColumn> encode_plain();
  Result<EncodedColumn> choose_codec(const ColumnElements& elements);
  EncodedColumn encode_shuffled(int zstd_level) const;
  Result<StepTerms> encode_terms(StepReference kind);
  Result<EncodedColumn> encode_in_terms();
  Result<EncodedColumn> choose_terms();
  /// Returns the values to which the current group may refer.
  Result<ReferenceValues> stored_reference(StepReference kind) {
    return before_[*array_].values.reference(kind, schema_->arrays[*array_], first_ * stride(),
                                             pending_.size());
  }
  Result<ReferenceValues> reference(StepReference kind);
  /// Returns the values of the current group without special values.
  std::span<const std::byte> values() const { return special_ ? plain_ : pending_; }
  std::size_t stride() const {
    return scalar_bytes(schema_->arrays[*array_].type) * schema_->arrays[*array_].components;
  }

  const Schema* schema_;
  StepElements mesh_;
  std::vector<std::uint64_t> elements_;
  std::uint32_t key_steps_;
  Level level_;
  StepReference most_;
  Sink sink_;
  std::optional<Part> part_;
  // Reference and codec of the next step, set by choose().
  std::optional<StepReference> given_reference_;
  std::optional<Codec> given_codec_;
  std::uint64_t steps_ = 0;
  std::unique_ptr<StepStore> store_;  // shared by the memories of all arrays
  std::vector<Before> before_;        // state of each array

  // State of the current array and step.
  std::optional<std::uint32_t> array_;
  std::uint64_t step_ = 0, first_ = 0;
  std::uint64_t previous_step_ = 0;  // not used if no step precedes the current step
  // Reference of the current step, once it has been chosen.
  std::optional<StepReference> reference_;
  std::optional<Codec> codec_;  // codec of the current step that choose() has set
  // The column of the chosen codec. Both are empty until the codec of the step has been chosen, or
  // if it is shuffled_zstd.
  std::optional<StepColumnEncoder> column_;
  std::optional<StepWeightedEncoder> weighted_;
  bool is_shuffled_ = false;
  // Number of groups with elements of the array so far at this step, including the current group.
  std::size_t groups_ = 0;
  std::size_t group_ = 0;    // index of the current group
  std::uint64_t count_ = 0;  // number of elements in the current group; 0 if no group has begun
  std::vector<std::byte> pending_;
  // The special values of the current group, if it has any; the other values; and the reference
  // without special values.
  std::optional<SpecialValues> special_;
  std::vector<std::byte> plain_;
  PlainReference plain_reference_;
  TermScratch scratch_;

  BundleSink bundle_sink_;
  std::vector<Waiting> waiting_;
  std::uint64_t waiting_bytes_ = 0, most_waiting_bytes_ = 0;
  bool waits_ = false;  // true if the current step will wait
  bool has_digests_ = false;
  std::uint64_t bundle_pairs_ = 0, written_ = 0;
  std::uint64_t most_slow_values_ = WriteOptions().slow_step_values;
  std::uint64_t slow_values_ = 0;  // number of values that the codec `columns` was tried for
};

}  // namespace shm
