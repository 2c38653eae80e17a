// Codecs for the values of one stepped array at one step, group by group. The codec `columns`
// predicts each value over the mesh: from the value's neighbours, and perhaps also from the
// previous step. The codec `shuffled_zstd` sorts the bytes by significance and compresses them with
// zstd. The encoder writes the smaller of these two results. The third codec, `terms`, is for
// speed: it predicts each value from the previous step, without the mesh.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codecs/patterns/term_column.h"
#include "format/format.h"
#include "steps/step_elements.h"

namespace shm {

/// Values of a group at one step, coded with the codec `terms`. `refers` is true if they are coded
/// relative to the reference values, which may be absent.
struct StepTerms {
  bool refers = false;
  EncodedColumn column;
};
StepTerms encode_terms(const ArrayInfo& info, std::span<const std::byte> values,
                       std::span<const std::byte> reference, TermScratch& scratch);
/// Decodes `count` values that encode_terms() has coded. Returns nullopt for damaged data.
std::optional<std::vector<std::byte>> decode_terms(const ArrayInfo& info,
                                                   std::span<const std::byte> bytes,
                                                   std::uint64_t count,
                                                   std::span<const std::byte> reference,
                                                   TermScratch& scratch);

/// Codes the values of one array at one step with the codec `columns`.
template <class Coder>
class StepColumn {
 public:
  /// Creates a column of `array`. `schema` must outlive this object. `most_kept` limits the size in
  /// bytes of the data that is stored by slot.
  StepColumn(const Schema& schema, std::uint32_t array, std::uint64_t most_kept = ~std::uint64_t{0})
      : schema_(&schema), array_(array), most_kept_(most_kept) {}

  /// Begins a group. Must be called before each group that is coded in columns. The column
  /// continues from the previous group if that group is in the same segment. Returns false if this
  /// is impossible because the previous group has a different reference.
  bool begin(std::uint32_t segment, StepReference reference);

  /// Encodes the values of the group's elements. `reference` contains the values to which they
  /// refer, or is empty.
  EncodedColumn encode(const ColumnElements& elements, std::span<const std::byte> values,
                       Level level, std::span<const std::byte> reference);
  /// Decodes the values of a group. `limit` is the size in bytes of all values. Returns nullopt for
  /// damaged data.
  std::optional<std::vector<std::byte>> decode(const ColumnElements& elements, Codec codec,
                                               std::span<const std::byte> bytes,
                                               std::uint64_t limit,
                                               std::span<const std::byte> reference);
  /// Returns true if decode() failed because it needed more memory than allowed.
  bool is_out_of_memory() const { return kept_ && kept_->is_refused(); }

 private:
  const Schema* schema_;
  std::uint32_t array_;
  std::uint64_t most_kept_;
  std::unique_ptr<ColumnMemory> kept_;  // memory limit of the column; used only for decoding
  std::optional<ValueColumn<Coder>> column_;
  std::uint32_t segment_ = 0;
  StepReference reference_ = StepReference::nothing;
};

extern template class StepColumn<SplitEncoder>;
extern template class StepColumn<SplitDecoder>;

}  // namespace shm
