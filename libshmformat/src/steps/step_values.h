// Codecs for the values of one stepped array at one step, group by group. The codec `columns`
// predicts each value from its neighbours in the mesh, and optionally also from the previous step.
// The codec `shuffled_zstd` sorts the bytes by significance and compresses them with zstd. The
// encoder writes the smaller of these two results. The codec `weighted` predicts values from the
// same neighbours, with fixed weights, and is much faster. The codec `terms` is even faster: it
// predicts each value from the previous step, without the mesh.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "codecs/patterns/term_column.h"
#include "codecs/surface/values/column_coder.h"
#include "codecs/weighted/weighted_column.h"
#include "format/format.h"
#include "steps/step_elements.h"

namespace shm {

/// Decodes `count` values that encode_terms() has coded. Returns nullopt for damaged data.
std::optional<std::vector<std::byte>> decode_terms(const ArrayInfo& info,
                                                   std::span<const std::byte> bytes,
                                                   std::uint64_t count,
                                                   std::span<const std::byte> reference,
                                                   TermScratch& scratch);

/// Codes the values of one array at one step with the codec `columns` or `weighted`. The parameter
/// `Column` is ColumnDecoder or WeightedDecoder, or ColumnPlanner or WeightedEncoder
/// (step_encoder.h).
template <class Column>
class StepColumn {
 public:
  /// `schema` must outlive this object.
  StepColumn(const Schema& schema, std::uint32_t array) : schema_(&schema), array_(array) {}

  /// Begins a group. Call this function before each group that is coded with the codec.
  /// If the previous call was for a group of the same segment, the column continues from that
  /// group. Returns false if it cannot continue, because that group has a different reference.
  bool begin(std::uint32_t segment, StepReference reference) {
    const bool goes_on = continues(segment);
    if (goes_on && reference != reference_) return false;
    if (!goes_on) {
      // Except in the first segment, the column assigns vertices to two "blocks": block 0 for
      // vertices that the segment owns, block 1 for imported vertices (see GroupElements).
      const bool may_import = segment > 0 && info().location == Location::point;
      auto blocks = may_import ? std::vector<std::uint32_t>{0} : info().blocks;
      if constexpr (std::is_base_of_v<WeightedColumn, Column>) {
        column_.emplace(info(), std::move(blocks));
      } else {
        column_.emplace(info(), std::move(blocks),
                        ColumnTraits{.earlier_values = schema_->earlier_values});
        if (reference != StepReference::nothing) column_->use_reference();
      }
    }
    segment_ = segment;
    reference_ = reference;
    return true;
  }

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

class StepColumnDecoder : public StepColumn<ColumnDecoder> {
 public:
  /// `schema` must outlive this object. `most_kept` limits the total size in bytes of the data that
  /// is stored for slots.
  StepColumnDecoder(const Schema& schema, std::uint32_t array,
                    std::uint64_t most_kept = ~std::uint64_t{0})
      : StepColumn(schema, array), most_kept_(most_kept) {}

  bool begin(std::uint32_t segment, StepReference reference);
  /// Decodes the values of a group. `limit` is the largest allowed unpacked size in bytes. Returns
  /// nullopt for damaged data.
  std::optional<std::vector<std::byte>> decode(const ColumnElements& elements, Codec codec,
                                               std::span<const std::byte> bytes,
                                               std::uint64_t limit,
                                               std::span<const std::byte> reference);
  /// Returns true if decode() failed because it needed more memory than allowed.
  bool is_out_of_memory() const { return kept_ && kept_->is_refused(); }

 private:
  std::uint64_t most_kept_;
  std::unique_ptr<ColumnMemory> kept_;  // memory limit of the column decoder
};

class StepWeightedDecoder : public StepColumn<WeightedDecoder> {
 public:
  /// `schema` must outlive this object. `most_kept` limits the total size in bytes of the data that
  /// is stored for slots.
  StepWeightedDecoder(const Schema& schema, std::uint32_t array, std::uint64_t most_kept)
      : StepColumn(schema, array), most_kept_(most_kept) {}

  /// Returns true if the elements have more slots than the memory limit allows.
  bool exceeds_limit(const ColumnElements& elements) const {
    return column_->room_for(elements.slots) > most_kept_;
  }
  /// Decodes the values of a group. Returns nullopt for damaged data.
  std::optional<std::vector<std::byte>> decode(const ColumnElements& elements,
                                               std::span<const std::byte> bytes,
                                               const ReferenceValues& reference);

 private:
  std::uint64_t most_kept_;
};

}  // namespace shm
