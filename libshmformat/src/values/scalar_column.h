// ScalarColumn: one component of an array, in step with the mesh. Says its domain once a group, its
// predictors once a tile for each class of neighbourhoods, and for each value what the prediction
// missed. The same code runs in both directions.
// spec: "Value columns"
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "entropy/models.h"
#include "values/neighbourhood.h"
#include "values/value_domain.h"
#include "values/value_predictor.h"

namespace shm {

/// How a group's values of one component are to be said. Made by the encoder (domain_choice.h).
struct DomainPlan {
  ValueDomain domain;
  std::vector<std::int64_t> table;  ///< what occurs, ascending; empty: no ranks
};

/// Bit length of what a prediction missed, raised by the scale of the prediction; 0 for a hit.
using ValueSurprise = std::uint16_t;

template <class Coder>
class ScalarColumn {
 public:
  ScalarColumn(const ArrayInfo& info, std::size_t component);

  /// Begins a group. Encoding: as `plan` says; decoding: as the stream says. False for damage.
  bool begin_group(Coder& coder, const DomainPlan& plan);
  /// Codes the values (bits) of the elements of one tile, in order. `before`: the surprises of the
  /// component before, by slot; empty for the first. `reference`: bits of the same elements at the
  /// reference step; empty unless use_reference() was called. False for damaged data.
  bool code_tile(Coder& coder, std::span<const Neighbourhood> items, std::span<std::uint64_t> bits,
                 std::span<const ValueSurprise> before,
                 std::span<const std::uint64_t> reference = {});
  /// An element that the array does not cover: takes the state of the last one.
  void skip(const Neighbourhood& item);

  void make_room(std::uint32_t slot);
  /// Before the first element: all tiles will come with a reference.
  void use_reference() {
    has_twins_ = true;
    twins_.resize(states_.size());
  }

  std::span<const ValueSurprise> surprises() const { return surprises_; }

 private:
  using Residual = SignedModel<ResidualModel>;
  /// What is said of a class of neighbourhoods.
  struct Class {
    std::uint64_t tile = 0;  ///< the last one that had it, from 1
    std::uint32_t mode = kLattice;
    Weights weights{};
    std::uint32_t way = kAlone;
  };
  /// An element as the encoder sees it.
  struct Sample {
    std::array<double, kFeatures> state{};
    std::int64_t index = 0;
    bool odd = false;
    std::uint32_t known = 0, of_class = 0;
    std::array<double, kFeatures> difference{};  ///< state - that of the twin
    double reference = 0;
    const std::array<double, kFeatures>& features(std::uint32_t way) const {
      return way == kDifference ? difference : state;
    }
  };
  /// The state of an element at the reference step.
  struct Twin {
    double state = 0, third = 0;
  };
  static constexpr std::uint32_t kSurpriseClasses = 27;

  void change_domain(const ValueDomain& domain);
  bool code_table(Coder& coder, const std::vector<std::int64_t>& table);
  std::uint32_t class_of(const Neighbourhood& item);
  template <class Visit>
  bool with_space(Visit&& visit);
  template <class Space>
  bool code_items(Coder& coder, const Space& space, std::span<const Neighbourhood> items,
                  std::span<std::uint64_t> bits, std::span<const ValueSurprise> before,
                  std::span<const std::uint64_t> reference);
  template <class Space>
  void look_ahead(const Space& space, std::span<const Neighbourhood> items,
                  std::span<const std::uint64_t> bits, std::span<const std::uint64_t> reference);
  double twin_feature(const Neighbourhood& item, std::uint32_t feature) const;
  double reference_state(std::uint64_t bits) const;
  void note_twin(const Neighbourhood& item, double state);
  template <class Space>
  void choose_modes(const Space& space);
  void code_class(Coder& coder, std::uint32_t of_class);
  template <class At>
  double odd_state(const auto& space, const Predictor<At>& predictor) const;
  std::uint32_t context(const Neighbourhood& item, std::int32_t scale,
                        std::span<const ValueSurprise> before) const;
  Residual& residual_model(std::uint32_t context);

  ArrayInfo info_;
  std::size_t component_;
  ValueDomain domain_;
  std::vector<std::int64_t> table_;
  ValueTranslator translator_;
  std::uint64_t tile_ = 0;

  // by slot
  std::vector<double> states_, thirds_;
  std::vector<ValueSurprise> surprises_;
  double last_ = 0, before_last_ = 0;
  ValueSurprise last_surprise_ = 0;
  bool last_odd_ = false, last_negative_ = false;

  // at the reference step
  bool has_twins_ = false;
  std::vector<Twin> twins_;  // by slot
  double twin_last_ = 0, twin_before_last_ = 0;

  std::vector<std::uint16_t> class_numbers_;  // by key, from 1
  std::vector<Class> classes_;
  std::vector<Class> wanted_;    // encoding: what the tile at hand will say
  std::vector<Sample> samples_;  // encoding

  // models
  AdaptiveBit same_domain_, negative_zero_flag_, odd_flag_, table_flag_, same_step_;
  TreeModel<3> kind_;
  SignedModel<NumberModel> exponent_, first_entry_, weight_;
  NumberModel entries_, step_;
  AdaptiveBit same_mode_, same_weights_;
  TreeModel<5> mode_;
  TreeModel<2> way_;
  AdaptiveBit same_odd_;
  std::array<AdaptiveBit, 2> odd_, negative_;
  std::vector<std::uint16_t> residual_numbers_;  // by context, from 1
  std::vector<Residual> residuals_;
};

extern template class ScalarColumn<RangeEncoder>;
extern template class ScalarColumn<RangeDecoder>;

}  // namespace shm
