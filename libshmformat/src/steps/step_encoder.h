// StepEncoder: values of stepped arrays in, step_values chunks out: one for each group that has
// elements of the array. The mirror of step_decoder.h.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "steps/step_memory.h"
#include "steps/step_values.h"

namespace shm {

class StepEncoder {
 public:
  /// Receives a part: header, the number of its first element in the array, the coded bytes.
  using Sink = std::function<Result<void>(const container::StepHeader&, std::uint64_t,
                                          std::span<const std::byte>)>;

  /// `schema` is checked, borrowed, and so is `topology`, of the whole mesh. `elements`: how many
  /// each array has. At least one of `key_steps` steps refers to no other.
  StepEncoder(const Schema& schema, StepTopology& topology, std::vector<std::uint64_t> elements,
              std::uint32_t key_steps, Level level, Sink sink);

  /// What stands in the file of an array that this one has not begun: steps up to `last_step`, the
  /// last `run` of them since the last key step, it included.
  void go_on(std::uint32_t array, std::uint64_t last_step, std::uint32_t run);
  /// Whether the next step of the array may refer to that many steps before.
  bool refers_to(std::uint32_t array, StepReference kind) const { return most_next(array) >= kind; }
  /// After go_on(): all values of the last step but one, then of the last one, as far as the next
  /// step may refer to them.
  void remember(std::uint32_t array, std::span<const std::byte> values) {
    before_[array].values.take(0, values);
  }

  /// Where the elements of a part of a mesh stand, by array; `all`: of the whole mesh.
  struct Part {
    std::uint32_t first_group = 0;
    std::vector<std::uint64_t> first, all;
  };
  /// Before anything else: the topology, and `elements`, are those of a part.
  void begin_part(Part part);
  /// Of a part: what the step that begins next refers to, as another part has chosen.
  void choose(StepReference reference) { given_reference_ = reference; }
  /// What the step at hand refers to, once that is known.
  std::optional<StepReference> chosen() const { return array_ ? reference_ : std::nullopt; }
  /// Begins a step that may get no values.
  Result<void> begin(std::uint32_t array, std::uint64_t step);

  /// Must hold: the array is stepped, `values` are whole elements.
  Result<void> add(std::uint32_t array, std::uint64_t step, std::span<const std::byte> values);
  /// Ends the step at hand, if there is one.
  Result<void> end_step();
  /// How many elements the array has in the whole mesh.
  std::uint64_t elements(std::uint32_t array) const {
    return part_ ? part_->all[array] : elements_[array];
  }
  /// Highest step + 1.
  std::uint64_t steps() const { return steps_; }

 private:
  /// What is held of an array between its steps.
  struct Before {
    std::uint64_t next_step = 0;  ///< the first that may come
    std::uint32_t run = 0;        ///< steps since one that refers to no other, it included
    StepMemory values;
    StepReference liked = StepReference::nothing;  ///< in terms, when it was last chosen,
    std::size_t liked_bytes = 0;                   ///< and what the first group took
  };
  using Column = StepColumn<SplitEncoder>;

  StepReference most_next(std::uint32_t array) const;
  Result<void> begin_step(std::uint32_t array, std::uint64_t step);
  Result<void> begin_group();
  Result<void> end_group();
  Result<EncodedColumn> encode();
  EncodedColumn choose_reference(const ColumnElements& elements);
  EncodedColumn encode_in_terms();
  EncodedColumn choose_terms();
  std::span<const std::byte> reference(StepReference kind) {
    return before_[*array_].values.reference(kind, schema_->arrays[*array_],
                                             static_cast<std::size_t>(first_) * stride(),
                                             pending_.size());
  }
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
  std::optional<StepReference> given_reference_;  // of the step that begins next
  std::uint64_t steps_ = 0;
  std::vector<Before> before_;  // by array

  // the array and step at hand
  std::optional<std::uint32_t> array_;
  std::uint64_t step_ = 0, first_ = 0;
  std::uint64_t reference_step_ = 0;
  StepReference most_here_ = StepReference::nothing;
  std::optional<StepReference> reference_;  // once chosen
  bool has_referred_ = false;
  std::optional<Column> column_;
  std::size_t groups_ = 0;   // that have elements of the array, the one at hand included
  std::size_t group_ = 0;    // the one at hand
  std::uint64_t count_ = 0;  // elements of the group at hand; 0: none is begun
  std::vector<std::byte> pending_;
  TermScratch scratch_;
};

}  // namespace shm
