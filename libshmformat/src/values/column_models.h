// ColumnModels: the models of a component, and what is coded with them: its domain once a group,
// how the elements of each class are predicted once a tile, and of each value what the prediction
// missed. Each call encodes what it is given, or ignores that and decodes, and returns the coded
// value either way.
// spec: "Value columns"
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/range_coder.h"
#include "values/column_state.h"
#include "values/mode_choice.h"
#include "values/rank_table.h"
#include "values/value_domain.h"
#include "values/value_predictor.h"

namespace shm {

template <class Coder>
class ColumnModels {
 public:
  /// `last`: the last mode that there is.
  explicit ColumnModels(Mode last) : last_mode_(last) {}
  // --- a group

  /// The domain of the group, which is `now` before it; nothing for damage.
  std::optional<ValueDomain> code_domain(Coder& coder, const ArrayInfo& info,
                                         const ValueDomain& now, ValueDomain domain);
  bool code_has_table(Coder& coder, bool has) { return coder.bit(has_table_, has); }
  /// As code_rank_table().
  bool code_table(Coder& coder, DomainKind kind, std::vector<std::int64_t> known,
                  std::uint64_t most_entries, std::vector<std::int64_t>& table) {
    return code_rank_table(coder, table_.get(), kind, std::move(known), most_entries, table);
  }

  // --- a tile

  /// A class that is new begins as the last one of its family was coded before this tile.
  void begin_tile(const TileClasses& classes);
  /// How the classes are predicted now.
  void copy_modes(std::vector<ClassModes>& modes) const;
  /// How the elements of a class are predicted in this tile: coded at the first of them. `wanted`:
  /// by class, when encoding.
  const ClassModes& modes(Coder& coder, std::uint32_t of_class, bool has_reference,
                          std::span<const ClassModes> wanted) {
    if (classes_[of_class].tile != tile_) code_modes(coder, of_class, has_reference, wanted);
    return classes_[of_class].modes;
  }

  // --- an element

  /// Whether the value is an escape: none of the domain.
  bool code_escape(Coder& coder, bool escape) {
    return last_escape_ = coder.bit(escape_[last_escape_], escape);
  }
  /// The bits of an escape, so many; the same as `reference`, if there is one, or in full.
  std::uint64_t code_escaped(Coder& coder, std::uint64_t bits, int count,
                             std::optional<std::uint64_t> reference) {
    if (reference && coder.bit(same_escape_, bits == *reference)) return *reference;
    return coder.raw(bits, count);
  }
  /// Whether the second mode of the class predicts it, as it did for so many near elements.
  bool code_takes_second(Coder& coder, std::uint32_t of_class, std::uint32_t near, bool takes) {
    return coder.bit(classes_[of_class].takes_second[near], takes);
  }
  /// `second`: whether the second mode predicted it.
  std::int64_t code_residual(Coder& coder, const ResidualContext& context, bool second,
                             std::int64_t residual);
  /// What other modes than the one that was taken predict, less what that one does.
  using OtherPredictions = std::array<std::int64_t, 3>;
  /// The same with mixed bits.
  std::int64_t code_mixed_residual(Coder& coder, const ResidualContext& context, bool second,
                                   const SizesAround& sizes, std::uint32_t of_class,
                                   const OtherPredictions& others, std::int64_t residual);
  /// Whether a value is recalled, as so many of the near ones are. `by_source`: whether it is known
  /// which one would follow.
  bool code_is_recalled(Coder& coder, bool by_source, std::uint32_t near, bool is) {
    RecallModels& models = recall_.get();
    auto& bits = models.from[by_source ? 1 : 0].is_recalled[models.last ? 1 : 0];
    return models.last = coder.bit(bits[near], is);
  }
  /// Of a recalled value: by how much its rank is another one than expected, and then what the
  /// value of that rank misses.
  std::int64_t code_rank(Coder& coder, bool by_source, std::int64_t by);
  std::int64_t code_recalled(Coder& coder, std::int64_t residual);
  /// Whether a zero is -0.0.
  bool code_negative_zero(Coder& coder, bool negative) {
    return last_negative_ = coder.bit(negative_[last_negative_], negative);
  }

 private:
  using SignedNumberModel = SignedModel<CompactNumberModel>;
  /// Of another domain.
  struct DomainModels {
    AdaptiveBit negative_zero, escapes, recalls, partners;
    TreeModel<3> kind;
    SignedNumberModel exponent;
  };
  /// Codec mixed.
  struct Mixed {
    MixingCoder<Coder> coder{1};
    LazyModels<SignedModel<ResidualModelOf<MixedBit>>> residuals;  // by context
  };
  /// Recalled values.
  struct RecallModels {
    /// Where ranks start from a prediction, or from a source.
    struct From {
      std::array<std::array<AdaptiveBit, 4>, 2> is_recalled{};  // by `last`, how many near ones are
      std::uint32_t length = 0;                                 // of the last rank, in bits
      NearModel ranks;
    };
    std::array<From, 2> from;
    bool last = false;         // whether the last value was one
    std::uint32_t length = 0;  // of what the last one missed, in bits
    NearModel residuals;
  };
  /// Of a class of neighbourhoods.
  struct Class {
    std::uint64_t tile = 0;  // the last one that had it, from 1
    ClassModes modes;
    std::array<AdaptiveBit, 4> takes_second;  // by how many near ones did
  };

  void code_modes(Coder& coder, std::uint32_t of_class, bool has_reference,
                  std::span<const ClassModes> wanted);
  void code_weights(Coder& coder, const Weights& wanted, const Weights& family, Weights& weights);

  std::uint32_t last_mode_;
  AdaptiveBit same_domain_, has_table_;
  LazyModel<DomainModels> domain_;
  LazyModel<RankTableModels> table_;

  std::uint64_t tile_ = 0;  // from 1
  TileClasses tile_classes_;
  std::vector<Class> classes_;
  std::vector<std::uint16_t> last_coded_;  // by family: the class, from 1; 0: none so far
  AdaptiveBit same_mode_, same_second_, same_input_, same_weights_, family_weights_;
  TreeModel<5> mode_, second_;
  LazyModel<SignedNumberModel> weight_;

  bool last_escape_ = false, last_negative_ = false;
  std::array<AdaptiveBit, 2> escape_, negative_;  // by what it was the last time
  AdaptiveBit same_escape_;
  LazyModels<NearModel> residuals_;  // by context
  LazyModel<Mixed> mixed_;
  LazyModel<RecallModels> recall_;
};

extern template class ColumnModels<SplitEncoder>;
extern template class ColumnModels<SplitDecoder>;

}  // namespace shm
