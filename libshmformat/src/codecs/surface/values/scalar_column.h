// ScalarColumn: the coder of one component of an array. For each value it computes a prediction
// from the neighbourhood (value_predictor.h), codes the residual (column_models.h), and stores the
// restored value (column_state.h). The same code encodes and decodes.
// spec: "Value columns"
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "codecs/shared/neighbourhood.h"
#include "codecs/shared/value_domain.h"
#include "codecs/surface/values/column_models.h"
#include "codecs/surface/values/column_state.h"
#include "codecs/surface/values/mode_choice.h"
#include "entropy/range_coder.h"

namespace shm {

/// How the components of an array are coded in a group.
struct ColumnStyle {
  Reach reach = Reach::farther;  ///< distance at which neighbours are used
  bool matches = true;           ///< whether predictions use matches and other components
  bool mixes = false;            ///< whether residuals are coded with mixed bits
  bool hurries = false;          ///< encoding: modes are kept as long as they predict well
  bool copies = false;           ///< whether elements may be coded as copies of earlier elements

  /// Returns the bits of Neighbourhood::known that this style uses.
  std::uint32_t known() const {
    constexpr std::uint32_t kNearest = Neighbourhood::kLattice | 7 * Neighbourhood::kThird;
    constexpr std::uint32_t kToBeyond = kNearest | 7 * Neighbourhood::kBeyond;
    if (reach == Reach::lattice) return kNearest;
    return reach == Reach::beyond ? kToBeyond : kToBeyond | 7 * Neighbourhood::kFarther;
  }
};

template <class Coder>
class ScalarColumn {
 public:
  /// `earlier_values`: true if values may be recalled or have partners.
  ScalarColumn(std::shared_ptr<const ArrayInfo> info, std::size_t component, bool earlier_values)
      : state_(std::move(info), component), models_(earlier_values ? kPartnerMode : kStayMode) {}

  /// Shares the scratch memory of another component.
  void share_scratch(const ScalarColumn& other) { scratch_ = other.scratch_; }

  /// Sets the style of this group and of all later groups, until the next call.
  void set_style(const ColumnStyle& style) {
    style_ = style;
    state_.use_matches(style.matches);
  }

  /// Encoding: returns true if the component may change to this domain.
  bool may_change_to(const ValueDomain& domain) const {
    return state_.may_change_to(domain, kMostMovesForEach / 2);
  }
  /// Begins a group. The encoder codes `plan`; the decoder ignores it and reads the plan from the
  /// stream. `before`: the previous components, which have already begun the group. Returns false
  /// if the data is damaged, for example if a table has more than `most_entries` entries or the
  /// domain changes too often.
  bool begin_group(Coder& coder, const DomainPlan& plan,
                   std::span<const ScalarColumn<Coder>> before, std::uint64_t most_entries);
  /// Codes the values of one tile, given as bits. Returns false if the data is damaged.
  bool code_tile(Coder& coder, const ColumnTile& tile, std::span<std::uint64_t> bits);
  /// Returns the values and residual sizes of the last tile.
  const CodedTile& coded_tile() const { return state_.coded_tile(); }

  // Encoding: the functions for choosing a domain.
  /// Visits the values of a tile without coding them, and adds some of them to `sample`. `place`:
  /// position of the tile's first element in the group. `of`: number of elements in the group.
  void survey(const ColumnTile& tile, std::span<const std::uint64_t> bits, std::size_t place,
              std::size_t of, DomainSample& sample);
  /// Returns the estimated size in bytes of the table of a plan. `before`: see begin_group().
  std::size_t table_bytes(const DomainPlan& plan,
                          std::span<const ScalarColumn<Coder>> before) const;

  /// Returns the state from which later elements are predicted.
  ColumnState& state() { return state_; }

  /// Encoding: a copy of a column, for trying one tile of these items in another domain. Destroying
  /// the trial restores the column. The copy borrows the slots of the column if both domains have
  /// the same states. Otherwise all slots change, so they are copied.
  class Trial;

 private:
  /// Memory that is needed for the current tile only. Components and copies share it because only
  /// one of them is active at a time.
  struct Scratch {
    ModeSamples samples;
    std::vector<ClassModes> wanted;  // by class: modes to encode in the tile
  };
  /// The result of coding one value.
  struct CodedValue {
    double state = 0.0;
    ResidualSize size = 0;
    bool second = false;    // whether the second mode predicted the value
    bool recalled = false;  // whether an earlier value predicted the value
  };
  struct Prediction {
    double state = 0.0;
    std::int64_t index = 0;
    bool second = false;
  };

  template <class Space>
  void choose_modes(const Space& space, const ColumnTile& tile,
                    std::span<const std::uint64_t> bits);
  template <class Space>
  void look_ahead(const Space& space, const ColumnTile& tile, std::span<const std::uint64_t> bits);
  template <class Space>
  void look_at(const Space& space, const ColumnTile& tile, std::size_t i, std::uint64_t bits,
               ModeSample& sample, std::array<double, kFeatures>* differences);
  std::vector<std::int64_t> known_entries(const ValueDomain& domain,
                                          std::span<const ScalarColumn<Coder>> before) const;
  template <class Space>
  bool code_values(Coder& coder, const Space& space, const ColumnTile& tile,
                   std::span<std::uint64_t> bits);
  template <class Space, class Predict>
  std::optional<CodedValue> code_value(Coder& coder, const Space& space, const TileElement& element,
                                       const Predict& predict, std::uint64_t& bits);
  template <class Space, class Predict>
  Prediction code_prediction(Coder& coder, const Space& space, const TileElement& element,
                             const Predict& predict, std::int64_t actual);
  template <class Space, class Predict>
  std::optional<std::int64_t> code_index(Coder& coder, const Space& space,
                                         const TileElement& element, const Predict& predict,
                                         std::int64_t actual, CodedValue& value);
  template <class Space>
  bool code_recalled(Coder& coder, const Space& space, const TileElement& element,
                     const Prediction& expected, std::int64_t& index, CodedValue& value);
  template <class Space>
  bool code_bits(Coder& coder, const Space& space, std::int64_t index, std::uint64_t& bits);

  const ArrayInfo& info() const { return state_.info(); }
  /// Encoding: returns true if `samples` covers the current tile, and the states are already
  /// updated to the end of the tile.
  bool looked_ahead() const {
    if constexpr (Coder::kDecodes) return false;
    return looked_ahead_;
  }
  const ModeSample& sample(std::size_t i) const { return scratch_->samples.samples[i]; }

  ColumnStyle style_;
  // Rank table of the group; empty: indices are coded directly, without ranks
  std::vector<std::int64_t> table_;
  ColumnState state_;
  ColumnModels<Coder> models_;

  // Used for encoding only
  ModeWatch watch_;
  bool looked_ahead_ = false;
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();
};

template <class Coder>
class ScalarColumn<Coder>::Trial {
 public:
  /// The trial refers to both arguments. The column must not be used while the trial exists.
  Trial(ScalarColumn& column, std::span<const Neighbourhood> items, const ValueDomain& domain) {
    if (column.state_.domain().has_states_of(domain)) loan_.emplace(column.state_, items);
    column_.emplace(column);
    if (loan_) loan_->lend(column_->state_);
  }
  ~Trial() {
    if (loan_) loan_->give_back(column_->state_);
  }
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

  ScalarColumn* operator->() { return &*column_; }

 private:
  std::optional<ColumnState::Loan> loan_;
  std::optional<ScalarColumn> column_;
};

extern template class ScalarColumn<SplitEncoder>;
extern template class ScalarColumn<SplitDecoder>;

}  // namespace shm
