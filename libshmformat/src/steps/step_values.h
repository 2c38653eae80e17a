// Step values: one stepped array at one step, group by group.
// Two codecs, the smaller wins: `columns` predicts each value over the mesh, from its neighbours
// and perhaps from the step before; `shuffled_zstd` sorts the bytes by significance and leaves them
// to zstd. And one for speed: `terms`, from the step before, without the mesh.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "container/format.h"
#include "patterns/term_column.h"
#include "steps/step_elements.h"

namespace shm {

/// The values of a group at one step in `terms`, and whether they refer to the reference, of which
/// there need not be one.
struct StepTerms {
  bool refers = false;
  EncodedColumn column;
};
StepTerms encode_terms(const ArrayInfo& info, std::span<const std::byte> values,
                       std::span<const std::byte> reference, TermScratch& scratch);
/// So many values; nothing for damaged data.
std::optional<std::vector<std::byte>> decode_terms(const ArrayInfo& info,
                                                   std::span<const std::byte> bytes,
                                                   std::uint64_t count,
                                                   std::span<const std::byte> reference,
                                                   TermScratch& scratch);

/// The values of one array at one step through `columns`.
template <class Coder>
class StepColumn {
 public:
  /// `schema` is borrowed. `most_kept`: bytes of what is kept by slot.
  StepColumn(const Schema& schema, std::uint32_t array, std::uint64_t most_kept = ~std::uint64_t{0})
      : schema_(&schema), array_(array), most_kept_(most_kept) {}

  /// Before each group in columns. It goes on with what the group before has left, if that is of
  /// the same segment. False if it cannot, because that group refers to something else.
  bool begin(std::uint32_t segment, StepReference reference);

  /// Encoding. `values`: those of the group's elements; `reference`: what they refer to, or empty.
  EncodedColumn encode(const ColumnElements& elements, std::span<const std::byte> values,
                       Level level, std::span<const std::byte> reference);
  /// Decoding. `limit`: bytes of all values. Nothing for damaged data.
  std::optional<std::vector<std::byte>> decode(const ColumnElements& elements, Codec codec,
                                               std::span<const std::byte> bytes,
                                               std::uint64_t limit,
                                               std::span<const std::byte> reference);
  /// Whether decode() failed since it would have kept more than was allowed.
  bool is_out_of_memory() const { return kept_ && kept_->is_refused(); }

 private:
  const Schema* schema_;
  std::uint32_t array_;
  std::uint64_t most_kept_;
  std::unique_ptr<ColumnMemory> kept_;  // decoding: of the column
  std::optional<ValueColumn<Coder>> column_;
  std::uint32_t segment_ = 0;
  StepReference reference_ = StepReference::nothing;
};

extern template class StepColumn<SplitEncoder>;
extern template class StepColumn<SplitDecoder>;

}  // namespace shm
