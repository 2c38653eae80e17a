// Codecs for the values of one stepped array at one step, group by group. `columns` predicts each
// value over the mesh: from its neighbours, and perhaps also from the step before. `shuffled_zstd`
// sorts the bytes by significance and compresses them with zstd. The encoder writes the smaller of
// these two results. The third codec, `terms`, is for speed: it predicts from the step before,
// without the mesh.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codecs/patterns/term_column.h"
#include "codecs/surface/plan/column_planner.h"
#include "codecs/surface/values/column_coder.h"
#include "format/format.h"
#include "steps/step_elements.h"

namespace shm {

/// The values of a group at one step, coded with `terms`. `refers` is true if they refer to the
/// reference values. There may be no reference values.
struct StepTerms {
  bool refers = false;
  EncodedColumn column;
};
StepTerms encode_terms(const ArrayInfo& info, std::span<const std::byte> values,
                       std::span<const std::byte> reference, TermScratch& scratch);
/// Decodes `count` values. Returns nullopt for damaged data.
std::optional<std::vector<std::byte>> decode_terms(const ArrayInfo& info,
                                                   std::span<const std::byte> bytes,
                                                   std::uint64_t count,
                                                   std::span<const std::byte> reference,
                                                   TermScratch& scratch);

/// Codes the values of one array at one step with the codec `columns`. `Column`: ColumnPlanner or
/// ColumnDecoder.
template <class Column>
class StepColumn {
 public:
  /// `schema` must outlive this object.
  StepColumn(const Schema& schema, std::uint32_t array) : schema_(&schema), array_(array) {}

  /// Call it before each group that is coded in columns. The column continues from the group before
  /// if that group is in the same segment. Returns false if this is impossible because that group
  /// has a different reference.
  bool begin(std::uint32_t segment, StepReference reference);

 protected:
  bool continues(std::uint32_t segment) const { return column_ && segment == segment_; }
  const ArrayInfo& info() const { return schema_->arrays[array_]; }

  std::optional<Column> column_;

 private:
  const Schema* schema_;
  std::uint32_t array_;
  std::uint32_t segment_ = 0;
  StepReference reference_ = StepReference::nothing;
};

extern template class StepColumn<ColumnPlanner>;
extern template class StepColumn<ColumnDecoder>;

class StepColumnEncoder : public StepColumn<ColumnPlanner> {
 public:
  using StepColumn::StepColumn;

  /// Encodes the values of the group's elements. `reference` contains the values to which they
  /// refer, or is empty.
  EncodedColumn encode(const ColumnElements& elements, std::span<const std::byte> values,
                       Level level, std::span<const std::byte> reference);
};

class StepColumnDecoder : public StepColumn<ColumnDecoder> {
 public:
  /// `schema` must outlive this object. `most_kept` is a limit in bytes for data stored by slot.
  StepColumnDecoder(const Schema& schema, std::uint32_t array,
                    std::uint64_t most_kept = ~std::uint64_t{0})
      : StepColumn(schema, array), most_kept_(most_kept) {}

  bool begin(std::uint32_t segment, StepReference reference);
  /// Decodes the values of a group. `limit` is the size of all values in bytes. Returns nullopt for
  /// damaged data.
  std::optional<std::vector<std::byte>> decode(const ColumnElements& elements, Codec codec,
                                               std::span<const std::byte> bytes,
                                               std::uint64_t limit,
                                               std::span<const std::byte> reference);
  /// Returns true if decode() failed because it needed more memory than allowed.
  bool is_out_of_memory() const { return kept_ && kept_->is_refused(); }

 private:
  std::uint64_t most_kept_;
  std::unique_ptr<ColumnMemory> kept_;  // limits the memory of the column
};

}  // namespace shm
