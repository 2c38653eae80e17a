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

#include "entropy/mixing.h"
#include "entropy/models.h"
#include "entropy/split_coder.h"
#include "values/match_tables.h"
#include "values/neighbourhood.h"
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

/// Bit length of what a prediction missed, raised by the scale of the prediction; 0 for a hit.
using ValueSurprise = std::uint16_t;
inline constexpr std::uint32_t kSurpriseClasses = 27;

template <class Coder>
class ScalarColumn {
 public:
  ScalarColumn(const ArrayInfo& info, std::size_t component);

  /// Its scratch memory is that of another component.
  void share_scratch(const ScalarColumn& other) { scratch_ = other.scratch_; }

  /// How groups from here on are said. It lasts.
  void set_style(const ColumnStyle& style);

  /// Begins a group. Encoding: as `plan` says; decoding: as the stream says. `before`: the
  /// components before this one, which have begun it. A table has `most_entries` at most. False
  /// for damage.
  bool begin_group(Coder& coder, const DomainPlan& plan,
                   std::span<const ScalarColumn<Coder>> before, std::uint64_t most_entries);
  /// What the last tile held, by element.
  struct Trace {
    std::vector<double> values;
    std::vector<ValueSurprise> surprises;
  };
  /// Codes the values (bits) of the elements of one tile, in order. `classes`: their classes'
  /// numbers, the same for all components. `before`: what the components
  /// before this one held in this tile. `reference`: bits that these values refer to; empty unless
  /// use_reference() was called. False for damaged data.
  bool code_tile(Coder& coder, std::span<const Neighbourhood> items,
                 std::span<const std::uint16_t> classes, std::span<std::uint64_t> bits,
                 std::span<const Trace* const> before,
                 std::span<const std::uint64_t> reference = {});
  /// Takes note of values that were said otherwise.
  void note(std::span<const Neighbourhood> items, std::span<const std::uint64_t> bits);
  /// An element that the array does not cover: takes the state of the last one.
  void skip(const Neighbourhood& item);

  void make_room(std::uint32_t slot);
  /// Before the first element: all tiles will come with a reference.
  void use_reference() { has_twins_ = true; }

  const Trace& trace() const { return trace_; }

 private:
  using Residual = NearModel;
  using MixedResidual = SignedModel<ResidualModelOf<MixedBit>>;
  /// Of residuals: by class of surprises, what the component before was, and the predictor.
  static constexpr std::uint32_t kContexts = kSurpriseClasses * 3 * 2;
  /// Codec mixed: one for each component.
  struct Mixed {
    MixingCoder<Coder> coder{1};
    std::vector<MixedResidual> residuals{kContexts};
  };
  /// What is said of a class of neighbourhoods.
  struct Class {
    std::uint64_t tile = 0;  ///< the last one that had it, from 1
    std::uint32_t mode = kLattice;
    std::uint32_t second = kNoMode;  ///< a mode that may be right where the first is wrong
    Weights weights{};
    std::uint32_t way = kAlone;
    std::array<AdaptiveBit, 4> takes_second;  ///< by how many near ones did
    // Encoding: elements and bits in the last tile that had it, and bits an element when the
    // modes were chosen; negative: never.
    double count = 0, bits = 0, bits_then = -1;
    std::uint32_t tiles_since = 0;
  };
  /// An element as the encoder sees it.
  struct Sample {
    std::array<double, kFeatures> state{};
    std::optional<std::int64_t> index;
    std::uint32_t known = 0, of_class = 0;
    double reference = 0;  ///< state of the reference
  };
  /// The state of what an element refers to.
  struct Twin {
    double state = 0, third = 0;
  };
  /// What only the tile at hand needs: shared by components and copies, which take turns.
  struct Scratch {
    std::vector<Sample> samples;
    std::vector<std::array<double, kFeatures>> differences;  // from the twins, where there are any
  };

  void change_domain(const ValueDomain& domain);
  bool code_table(Coder& coder, const std::vector<std::int64_t>& table,
                  std::vector<std::int64_t> known, std::uint64_t most_entries);
  std::int64_t opposite(std::int64_t index) const;
  void add_known_entries(const ScalarColumn& other, std::vector<std::int64_t>& known) const;
  bool needs_search();
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
  template <class Space>
  void choose_modes(const Space& space);
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
  void code_class(Coder& coder, std::uint32_t of_class);
  template <class At>
  double odd_state(const auto& space, const Predictor<At>& predictor) const;
  struct Context {
    std::uint32_t number = 0;
    std::uint32_t mean = 0;  ///< of the surprises near
  };
  Context context(const Neighbourhood& item, std::int32_t scale, bool second, std::size_t i) const;
  Residual& residual_model(std::uint32_t context);
  void ask_about(Mixed& mixed, const Neighbourhood& item, std::int32_t scale, std::size_t i,
                 std::uint32_t of_class, std::int64_t expected,
                 const std::array<std::int64_t, 3>& others, bool second);

  ArrayInfo info_;
  std::size_t component_;
  ValueDomain domain_;
  std::vector<std::int64_t> table_;
  ValueTranslator translator_;
  std::uint64_t tile_ = 0;
  Trace trace_;
  std::span<const Trace* const> before_;         // during code_tile
  std::span<const std::uint16_t> item_classes_;  // during code_tile

  // by slot
  std::vector<double> states_, thirds_;
  std::vector<ValueSurprise> surprises_;
  std::vector<std::uint8_t> seconds_;  // whether the second predictor was taken
  double last_ = 0, before_last_ = 0;
  MatchTables matches_;
  ValueSurprise last_surprise_ = 0;
  bool last_odd_ = false, last_negative_ = false;

  ColumnStyle style_;
  // of the reference
  bool has_twins_ = false;
  std::vector<Twin> twins_;  // by slot
  double twin_last_ = 0, twin_before_last_ = 0;

  std::vector<Class> classes_;
  std::vector<Class> wanted_;  // encoding: what the tile at hand will say
  std::shared_ptr<Scratch> scratch_ = std::make_shared<Scratch>();  // encoding

  // models
  AdaptiveBit same_domain_, negative_zero_flag_, odd_flag_, table_flag_, same_step_;
  TreeModel<3> kind_;
  SignedModel<NumberModel> exponent_, first_entry_, weight_;
  NumberModel entries_, step_, skipped_;
  std::array<AdaptiveBit, 8> known_entry_;
  AdaptiveBit same_mode_, same_second_, same_weights_, same_way_, same_odd_;
  TreeModel<5> mode_, second_;
  std::array<AdaptiveBit, 2> odd_, negative_;
  std::vector<std::uint16_t> residual_numbers_;  // by context, from 1
  std::vector<Residual> residuals_;
  std::vector<Mixed> mixed_;   // one where mixed bits have been used
  bool looked_ahead_ = false;  // encoding: samples_ are those of the tile at hand
};

extern template class ScalarColumn<SplitEncoder>;
extern template class ScalarColumn<SplitDecoder>;

}  // namespace shm
