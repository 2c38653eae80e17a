// ScalarColumn: one component of an array, in step with the mesh. Says its domain once a group, its
// predictors once a tile for each class of neighbourhoods, and for each value what the prediction
// missed. The same code runs in both directions.
// spec: "Value columns"
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bytes/lists.h"
#include "entropy/compact_number.h"
#include "entropy/lazy_models.h"
#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/split_coder.h"
#include "values/class_numbers.h"
#include "values/match_tables.h"
#include "values/mode_choice.h"
#include "values/neighbourhood.h"
#include "values/rank_table.h"
#include "values/value_domain.h"
#include "values/value_predictor.h"

namespace shm {

/// How a group's values of one component are to be said. Made by the encoder (domain_choice.h).
struct DomainPlan {
  ValueDomain domain;
  std::vector<std::int64_t> table;  ///< what occurs, ascending; empty: no ranks
};

/// How the components of an array are said in a group.
struct ColumnStyle {
  Reach reach = Reach::farther;  ///< how far predictions look
  bool matches = true;           ///< whether they look at matches, and at other components
  bool mixes = false;            ///< whether bits are mixed
  bool hurries = false;          ///< encoding: modes are kept while they do well
  /// Bits of Neighbourhood::known that count.
  std::uint32_t known() const {
    constexpr std::uint32_t kNearest = Neighbourhood::kLattice | 7 * Neighbourhood::kThird;
    constexpr std::uint32_t kToBeyond = kNearest | 7 * Neighbourhood::kBeyond;
    if (reach == Reach::lattice) return kNearest;
    return reach == Reach::beyond ? kToBeyond : kToBeyond | 7 * Neighbourhood::kFarther;
  }
};

/// Steps of translating what is kept by slot into other domains, for each element of a column: a
/// reader refuses more. Writers take half, since they may keep fewer slots. spec: "Limits"
inline constexpr std::uint64_t kMostMovesForEach = 4096;

/// Bit length of what a prediction missed, raised by the scale of the prediction; 0 for a hit.
using ValueSurprise = std::uint16_t;
inline constexpr std::uint32_t kSurpriseClasses = 27;

template <class Coder>
class ScalarColumn {
 public:
  ScalarColumn(std::shared_ptr<const ArrayInfo> info, std::size_t component);

  /// Its scratch memory is that of another component.
  void share_scratch(const ScalarColumn& other) { scratch_ = other.scratch_; }

  /// How groups from here on are said. It lasts.
  void set_style(const ColumnStyle& style);

  /// Encoding: whether it may change to that domain. Translating what it keeps by slot must stay in
  /// proportion to the elements that it was told: groups of few elements may not do it at will.
  bool may_change_to(const ValueDomain& domain) const {
    return domain.has_states_of(domain_) || moved_ <= elements_ * kMostMovesForEach / 2;
  }
  /// Begins a group. Encoding: as `plan` says; decoding: as the stream says. `before`: the
  /// components before this one, which have begun it. A table has `most_entries` at most. False
  /// for damage, and for more changes of domain than a reader goes along with.
  bool begin_group(Coder& coder, const DomainPlan& plan,
                   std::span<const ScalarColumn<Coder>> before, std::uint64_t most_entries);
  /// What the last tile held, by element.
  struct Trace {
    std::vector<double> values;
    std::vector<ValueSurprise> surprises;
  };
  /// Codes the values (bits) of the elements of one tile, in order. `classes`: the same for all
  /// components. `before`: what the components before this one held in this tile. `reference`: bits
  /// that these values refer to; empty unless use_reference() was called. False for damaged data.
  bool code_tile(Coder& coder, std::span<const Neighbourhood> items, const TileClasses& classes,
                 std::span<std::uint64_t> bits, std::span<const Trace* const> before,
                 std::span<const std::uint64_t> reference = {});
  /// Takes note of values that were said otherwise.
  void note(std::span<const Neighbourhood> items, std::span<const std::uint64_t> bits);
  /// An element that the array does not cover: takes the state of the last one.
  void skip(const Neighbourhood& item);

  void make_room(std::uint32_t slot);
  // Where elements were left out that nobody looks at: as if they had been skipped, and as if there
  // were room for this slot.
  void count_left_out(std::uint64_t elements) { elements_ += elements; }
  void count_room(std::uint32_t slot) { room_ = size_with_room(room_, slot); }
  /// Before the first element: all tiles will come with a reference.
  void use_reference() { has_twins_ = true; }

  const Trace& trace() const { return trace_; }

  /// Encoding: a copy of a column to try one tile of these items with, in a domain. When it is gone
  /// the column is as it was. It borrows what the column keeps by slot, which is much, and puts
  /// that of the items back; but where the states of the domain are others, all of it changes, so
  /// it is copied.
  class Trial;

 private:
  using MixedResidual = SignedModel<ResidualModelOf<MixedBit>>;
  /// What is said of another domain.
  struct DomainModels {
    AdaptiveBit negative_zero, odd;
    TreeModel<3> kind;
    SignedModel<CompactNumberModel> exponent;
  };
  /// Codec mixed.
  struct Mixed {
    MixingCoder<Coder> coder{1};
    LazyModels<MixedResidual> residuals;  // by context
  };
  /// What is said of a class of neighbourhoods.
  struct Class {
    std::uint64_t tile = 0;  ///< the last one that had it, from 1
    ClassModes modes;
    std::array<AdaptiveBit, 4> takes_second;  ///< by how many near ones did
  };
  /// The state of what an element refers to.
  struct Twin {
    double state = 0, third = 0;
  };
  /// What is kept of the elements that neighbourhoods name.
  struct BySlot {
    std::vector<double> states, thirds;
    std::vector<ValueSurprise> surprises;
    std::vector<std::uint8_t> seconds;  // whether the second predictor was taken
    std::vector<Twin> twins;            // with a reference

    void make_room(std::uint32_t slot, bool has_twins);
  };
  /// What only the tile at hand needs: shared by components and copies, which take turns.
  struct Scratch {
    ModeSamples samples;
    std::vector<ClassModes> wanted;  // by class: what the tile will say
  };

  bool change_domain(const ValueDomain& domain);
  std::optional<std::int64_t> index_of(const auto& space, std::uint64_t bits) const;
  template <class Visit>
  bool with_space(Visit&& visit);
  template <class Space>
  bool code_items(Coder& coder, const Space& space, std::span<const Neighbourhood> items,
                  std::span<std::uint64_t> bits, std::span<const std::uint64_t> reference);
  void settle(const Neighbourhood& item, std::size_t i, double state, double lattice,
              const MatchTables::Places& places);
  template <class Space>
  void look_ahead(const Space& space, std::span<const Neighbourhood> items,
                  std::span<const std::uint64_t> bits, std::span<const std::uint64_t> reference);
  double twin_feature(const Neighbourhood& item, std::uint32_t feature, double then) const;
  double reference_state(std::uint64_t bits) const;
  void note_twin(const Neighbourhood& item, double state);
  template <class At>
  MatchTables::Places match_places(const Neighbourhood& item, const At& at, std::size_t i) const;
  double from_match(std::uint32_t kind, const MatchTables::Places& places) const {
    return style_.matches ? translator_.from_value(matches_.find(kind, places[kind])) : 0.0;
  }
  /// What the component before is at this element.
  double other_value(std::size_t i) const {
    return before_.empty() || !style_.matches ? 0.0
                                              : translator_.from_value(before_.back()->values[i]);
  }
  const ModeSample& sample(std::size_t i) const { return scratch_->samples.samples[i]; }
  void meet_classes(const TileClasses& classes);
  void code_class(Coder& coder, std::uint32_t of_class);
  template <class At>
  double odd_state(const auto& space, const Predictor<At>& predictor) const;
  struct Context {
    std::uint32_t number = 0;
    std::uint32_t mean = 0;  ///< of the surprises near
  };
  Context context(const Neighbourhood& item, std::int32_t scale, bool second, std::size_t i) const;
  void ask_about(Mixed& mixed, const Neighbourhood& item, std::int32_t scale, std::size_t i,
                 std::uint32_t of_class, std::int64_t expected,
                 const std::array<std::int64_t, 3>& others, bool second);

  std::shared_ptr<const ArrayInfo> info_;
  std::size_t component_;
  ValueDomain domain_;
  std::vector<std::int64_t> table_;
  ValueTranslator translator_;
  std::uint64_t tile_ = 0;
  Trace trace_;
  std::span<const Trace* const> before_;  // during code_tile
  TileClasses tile_classes_;              // during code_tile

  BySlot slots_;
  std::uint64_t elements_ = 0;  ///< told so far
  std::size_t room_ = 0;        ///< slots of all elements, where some are left out
  std::uint64_t moved_ = 0;     ///< slots that were translated into another domain, in all
  double last_ = 0, before_last_ = 0;
  MatchTables matches_;
  ValueSurprise last_surprise_ = 0;
  bool last_odd_ = false, last_negative_ = false;

  ColumnStyle style_;
  // of the reference
  bool has_twins_ = false;
  double twin_last_ = 0, twin_before_last_ = 0;

  std::vector<Class> classes_;
  std::vector<std::uint16_t> said_last_;  // by family: the class, from 1; 0: none so far
  ModeWatch watch_;                       // encoding
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();  // encoding

  // models
  AdaptiveBit same_domain_, table_flag_;
  LazyModel<DomainModels> domain_models_;
  LazyModel<RankTableModels> table_models_;
  LazyModel<SignedModel<CompactNumberModel>> weight_;
  AdaptiveBit same_mode_, same_second_, same_weights_, family_weights_, same_way_, same_odd_;
  TreeModel<5> mode_, second_;
  std::array<AdaptiveBit, 2> odd_, negative_;
  LazyModels<NearModel> residuals_;  // by context
  LazyModel<Mixed> mixed_;
  bool looked_ahead_ = false;  // encoding: the samples are those of the tile at hand
};

template <class Coder>
class ScalarColumn<Coder>::Trial {
 public:
  /// Both are borrowed; the column is not to be used meanwhile.
  Trial(ScalarColumn& column, std::span<const Neighbourhood> items, const ValueDomain& domain);
  ~Trial();
  Trial(const Trial&) = delete;
  Trial& operator=(const Trial&) = delete;

  ScalarColumn* operator->() { return &*column_; }

 private:
  struct Slot {
    double state, third;
    ValueSurprise surprise;
    std::uint8_t second;
    Twin twin;
  };

  ScalarColumn& lender_;
  std::span<const Neighbourhood> items_;
  bool lends_;
  std::vector<Slot> before_;  // by item
  std::optional<ScalarColumn> column_;
};

extern template class ScalarColumn<SplitEncoder>;
extern template class ScalarColumn<SplitDecoder>;

}  // namespace shm
