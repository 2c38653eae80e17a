// ColumnModels: the adaptive models of one component, and the functions that code with these
// models. The domain is coded once per group, the modes of each class once per tile, and the
// residual once per value. When encoding, each function encodes its argument. When decoding, it
// ignores the argument. In both directions it returns the coded value.
// spec: "Value columns"
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/column_state.h"
#include "codecs/surface/values/rank_table.h"
#include "codecs/surface/values/value_predictor.h"
#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"

namespace shm {

template <class Coder>
class ColumnModels {
 public:
  /// `last`: largest mode number that this column may use.
  explicit ColumnModels(Mode last) : last_mode_(last) {}

  // --- once per group

  /// Codes the domain of the group. `now`: the domain of the previous group. Returns nothing if the
  /// data is damaged.
  std::optional<ValueDomain> code_domain(Coder& coder, const ArrayInfo& info,
                                         const ValueDomain& now, ValueDomain domain);
  bool code_has_table(Coder& coder, bool has) { return coder.bit(has_table_, has); }
  /// Codes the rank table of the group. See code_rank_table().
  bool code_table(Coder& coder, DomainKind kind, std::vector<std::int64_t> known,
                  std::uint64_t most_entries, std::vector<std::int64_t>& table) {
    return code_rank_table(coder, table_.get(), kind, std::move(known), most_entries, table);
  }

  // --- once per tile

  /// Begins a tile. A class that occurs for the first time starts with the modes that were coded
  /// most recently for a class of the same family before this tile.
  void begin_tile(const TileClasses& classes);
  /// Copies the current modes of all classes to `modes`.
  void copy_modes(std::vector<ClassModes>& modes) const;
  /// Returns the modes of a class in this tile. If no element of the class has occurred in the tile
  /// yet, codes the modes first. `wanted`: modes to encode, one entry for each class; the decoder
  /// ignores them.
  const ClassModes& modes(Coder& coder, std::uint32_t of_class, bool has_reference,
                          std::span<const ClassModes> wanted) {
    if (classes_[of_class].tile != tile_) code_modes(coder, of_class, has_reference, wanted);
    return classes_[of_class].modes;
  }

  // --- once per element

  /// Codes whether the value is an escape. An escape is a value that the domain does not contain.
  bool code_escape(Coder& coder, bool escape) {
    return last_escape_ = coder.bit(escape_[last_escape_], escape);
  }
  /// Codes an escape in full, as `count` bits. If the value equals its reference value, one bit
  /// replaces the `count` bits.
  std::uint64_t code_escaped(Coder& coder, std::uint64_t bits, int count,
                             std::optional<std::uint64_t> reference) {
    if (reference && coder.bit(same_escape_, bits == *reference)) return *reference;
    return coder.raw(bits, count);
  }
  /// Codes whether the second mode of the class predicts the value. `near`: number of near elements
  /// that were predicted by a second mode.
  bool code_takes_second(Coder& coder, std::uint32_t of_class, std::uint32_t near, bool takes) {
    return coder.bit(classes_[of_class].takes_second[near], takes);
  }
  /// Codes a residual. `second`: true if the second mode has predicted the value.
  std::int64_t code_residual(Coder& coder, const ResidualContext& context, bool second,
                             std::int64_t residual);
  /// Predictions of three other modes, each minus the prediction that is used.
  using OtherPredictions = std::array<std::int64_t, 3>;
  /// Does the same as code_residual(), but codes the bits with a mix of predictions.
  std::int64_t code_mixed_residual(Coder& coder, const ResidualContext& context, bool second,
                                   const SizesAround& sizes, std::uint32_t of_class,
                                   const OtherPredictions& others, std::int64_t residual);
  /// Codes whether the value is recalled. `by_source`: true if the class has a source, the earlier
  /// value that was recalled most recently. The value next to the source is probably recalled now.
  /// `near`: number of near elements that were recalled.
  bool code_is_recalled(Coder& coder, bool by_source, std::uint32_t near, bool is) {
    RecallModels& models = recall_.get();
    auto& bits = models.from[by_source ? 1 : 0].is_recalled[models.last ? 1 : 0];
    return models.last = coder.bit(bits[near], is);
  }
  /// The next two functions code a recalled value. code_rank() codes the difference of its rank
  /// from the expected rank. Then code_recalled() codes the residual from the earlier value with
  /// this rank.
  std::int64_t code_rank(Coder& coder, bool by_source, std::int64_t by);
  std::int64_t code_recalled(Coder& coder, std::int64_t residual);
  /// Codes whether a zero is -0.0.
  bool code_negative_zero(Coder& coder, bool negative) {
    return last_negative_ = coder.bit(negative_[last_negative_], negative);
  }

 private:
  using SignedNumberModel = SignedModel<CompactNumberModel>;
  /// Models for a change of the domain.
  struct DomainModels {
    AdaptiveBit negative_zero, escapes, recalls, partners;
    TreeModel<3> kind;
    SignedNumberModel exponent;
  };
  /// Models of the codec mixed_columns.
  struct Mixed {
    MixingCoder<Coder> coder{1};
    // Models of residuals, by number_of()
    LazyModels<SignedModel<ResidualModelOf<MixedBit>>> residuals;
  };
  /// Models of recalled values.
  struct RecallModels {
    /// There are two sets of models. The first is used if the rank of the recalled value is
    /// predicted from the prediction of the value, the second if it is predicted from the
    /// previously recalled value (the source).
    struct From {
      // Models indexed by `last` (1 if the previous value was recalled) and by the number of near
      // elements that were recalled
      std::array<std::array<AdaptiveBit, 4>, 2> is_recalled{};
      std::uint32_t length = 0;  // bit length of the previous rank difference
      NearModel ranks;
    };
    std::array<From, 2> from;
    bool last = false;         // whether the last value was recalled
    std::uint32_t length = 0;  // bit length of the last residual
    NearModel residuals;
  };
  /// State of one class of neighbourhoods.
  struct Class {
    std::uint64_t tile =
        0;  // number of the most recent tile that contains an element of the class, counted from 1
    ClassModes modes;
    // Models indexed by the number of near elements that were predicted by a second mode
    std::array<AdaptiveBit, 4> takes_second;
  };

  void code_modes(Coder& coder, std::uint32_t of_class, bool has_reference,
                  std::span<const ClassModes> wanted);
  void code_weights(Coder& coder, const Weights& wanted, const Weights& family, Weights& weights);

  std::uint32_t last_mode_;
  AdaptiveBit same_domain_, has_table_;
  LazyModel<DomainModels> domain_;
  LazyModel<RankTableModels> table_;

  std::uint64_t tile_ = 0;  // number of the current tile, from 1
  TileClasses tile_classes_;
  std::vector<Class> classes_;
  // For each family: number, counted from 1, of the most recently coded class; 0 if no class has
  // been coded yet
  std::vector<std::uint16_t> last_coded_;
  AdaptiveBit same_mode_, same_second_, same_input_, same_weights_, family_weights_;
  TreeModel<5> mode_, second_;
  LazyModel<SignedNumberModel> weight_;

  bool last_escape_ = false, last_negative_ = false;
  std::array<AdaptiveBit, 2> escape_,
      negative_;  // one model for each value of the previous decision of the same kind
  AdaptiveBit same_escape_;
  LazyModels<NearModel> residuals_;  // models of residuals, by number_of()
  LazyModel<Mixed> mixed_;
  LazyModel<RecallModels> recall_;
};

extern template class ColumnModels<SplitEncoder>;
extern template class ColumnModels<SplitDecoder>;

}  // namespace shm
