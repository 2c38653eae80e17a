// ScalarColumn: one component of an array, in step with the mesh. Of each value: predict it from
// its neighbourhood (value_predictor.h), encode the residual (column_models.h), keep the decoded
// value (column_state.h). The same code runs in both directions. spec: "Value columns"
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "entropy/range_coder.h"
#include "values/column_models.h"
#include "values/column_state.h"
#include "values/mode_choice.h"
#include "values/neighbourhood.h"
#include "values/value_domain.h"

namespace shm {

/// How the components of an array are coded in a group.
struct ColumnStyle {
  Reach reach = Reach::farther;  ///< how far predictions look
  bool matches = true;           ///< whether they look at matches, and at other components
  bool mixes = false;            ///< whether bits are mixed
  bool hurries = false;          ///< encoding: modes are kept while they do well
  bool copies = false;           ///< whether elements may be copies of earlier ones
  /// Bits of Neighbourhood::known that count.
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
  /// `earlier_values`: whether values may be recalled and have partners.
  ScalarColumn(std::shared_ptr<const ArrayInfo> info, std::size_t component, bool earlier_values)
      : state_(std::move(info), component), models_(earlier_values ? kPartnerMode : kStayMode) {}

  /// Its scratch memory is that of another component.
  void share_scratch(const ScalarColumn& other) { scratch_ = other.scratch_; }

  /// How groups from here on are coded. It lasts.
  void set_style(const ColumnStyle& style) {
    style_ = style;
    state_.use_matches(style.matches);
  }

  /// Encoding: whether it may change to that domain.
  bool may_change_to(const ValueDomain& domain) const {
    return state_.may_change_to(domain, kMostMovesForEach / 2);
  }
  /// Begins a group. Encoding: by `plan`; decoding: by the stream. `before`: the components before
  /// this one, which have begun it. A table has `most_entries` at most. False for damage, and for
  /// more changes of domain than a reader goes along with.
  bool begin_group(Coder& coder, const DomainPlan& plan,
                   std::span<const ScalarColumn<Coder>> before, std::uint64_t most_entries);
  /// Codes the values (bits) of one tile. False for damaged data.
  bool code_tile(Coder& coder, const ColumnTile& tile, std::span<std::uint64_t> bits);
  /// What the last tile held.
  const CodedTile& coded_tile() const { return state_.coded_tile(); }

  // Encoding: what domains are chosen by.
  /// Takes note of the values of a tile without coding them, the first of which is the element
  /// `place` of a group `of` so many, and adds to the sample what it takes of them.
  void survey(const ColumnTile& tile, std::span<const std::uint64_t> bits, std::size_t place,
              std::size_t of, DomainSample& sample);
  /// About the bytes of the table of a plan. `before`: as in begin_group().
  std::size_t table_bytes(const DomainPlan& plan,
                          std::span<const ScalarColumn<Coder>> before) const;

  /// What it keeps of its elements.
  ColumnState& state() { return state_; }

  /// Encoding: a copy of a column to try one tile of these items with, in a domain. When it is gone
  /// the column is as it was. It borrows what the column keeps by slot, but where the states of the
  /// domain are others, all of that changes, so it is copied.
  class Trial;

 private:
  /// What only the tile at hand needs: shared by components and copies, which take turns.
  struct Scratch {
    ModeSamples samples;
    std::vector<ClassModes> wanted;  // by class: how the tile will be predicted
  };
  /// What coding makes of a value.
  struct CodedValue {
    double state = 0.0;
    ResidualSize size = 0;
    bool second = false;    // whether the second mode predicted it
    bool recalled = false;  // whether an earlier value did
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
               ModeSample& it, std::array<double, kFeatures>* differences);
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
  /// Encoding: whether the samples are those of the tile at hand, and its states are kept already.
  bool looked_ahead() const {
    if constexpr (Coder::kDecodes) return false;
    return looked_ahead_;
  }
  const ModeSample& sample(std::size_t i) const { return scratch_->samples.samples[i]; }

  ColumnStyle style_;
  std::vector<std::int64_t> table_;  // of the group; empty: no ranks
  ColumnState state_;
  ColumnModels<Coder> models_;

  // encoding
  ModeWatch watch_;
  bool looked_ahead_ = false;
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();
};

template <class Coder>
class ScalarColumn<Coder>::Trial {
 public:
  /// Both are borrowed; the column cannot be used meanwhile.
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
