#include "codecs/surface/values/column_models.h"

#include <algorithm>

#include "codecs/shared/value_domain.h"

namespace shm {
namespace {

constexpr std::uint32_t kSizeClasses = 27;

/// Assigns a mean residual size to one of kSizeClasses classes. The class is part of the context in
/// which a residual is coded.
std::uint32_t size_class(std::uint32_t mean) {
  return mean <= 12 ? mean : std::min(12 + (mean - 9) / 4, kSizeClasses - 1);
}

/// Returns the index of the model for a residual in this context.
std::uint32_t number_of(const ResidualContext& context, bool second) {
  return (size_class(context.mean) * 3 + context.before) * 2 + (second ? 1 : 0);
}

/// Codes a residual. The bit length is coded with a model centred on `guess`. The sign and the bits
/// below the leading bit follow as plain bits.
template <class Coder>
std::int64_t code_near_length(Coder& coder, NearModel& model, std::uint32_t guess,
                              std::int64_t residual) {
  const std::uint32_t length = code_near(coder, model, guess, bit_length(residual));
  if (length == 0) return 0;
  const auto bits = static_cast<std::uint64_t>(residual);
  const std::uint64_t low = (std::uint64_t{1} << (length - 1)) - 1;
  std::uint64_t size = residual < 0 ? 0 - bits : bits;
  // Code `length` bits without a model. The leading bit of the magnitude is always 1 and need not
  // be coded, so the sign takes its position
  std::uint64_t plain = (size & low) | (residual < 0 ? low + 1 : 0);
  plain = coder.raw(plain, static_cast<int>(length));
  size = (plain & low) | (low + 1);
  return static_cast<std::int64_t>((plain & (low + 1)) != 0 ? 0 - size : size);
}

}  // namespace

// --- once per group

template <class Coder>
std::optional<ValueDomain> ColumnModels<Coder>::code_domain(Coder& coder, const ArrayInfo& info,
                                                            const ValueDomain& now,
                                                            ValueDomain domain) {
  if (coder.bit(same_domain_, domain == now)) return now;
  DomainModels& models = domain_.get();
  const auto code_kind = [&](std::uint32_t kind) { return code_tree(coder, models.kind, kind); };
  const bool more = domain.recalls || domain.partners;
  std::uint32_t kind = code_kind(more ? kDomainKinds : static_cast<std::uint32_t>(domain.kind));
  if (kind == kDomainKinds && last_mode_ == kPartnerMode) {
    domain.recalls = coder.bit(models.recalls, domain.recalls);
    domain.partners = coder.bit(models.partners, domain.partners);
    kind = code_kind(static_cast<std::uint32_t>(domain.kind));
  }
  domain.kind = static_cast<DomainKind>(kind);
  if (static_cast<std::uint32_t>(domain.kind) >= kDomainKinds) return std::nullopt;
  domain.exponent = static_cast<std::int32_t>(code_signed(coder, models.exponent, domain.exponent));
  domain.negative_zero = coder.bit(models.negative_zero, domain.negative_zero);
  domain.escapes = coder.bit(models.escapes, domain.escapes);
  return domain.fits(info) ? std::optional(domain) : std::nullopt;
}

// --- once per tile

template <class Coder>
void ColumnModels<Coder>::begin_tile(const TileClasses& classes) {
  ++tile_;
  tile_classes_ = classes;
  std::uint32_t most = 0;
  for (std::uint32_t number : classes.of_item) most = std::max(most, number);
  for (std::size_t c = classes_.size(); c <= most; ++c) {
    const std::uint16_t family = classes.families[c];
    if (family >= last_coded_.size()) last_coded_.resize(std::size_t{family} + 1);
    const ClassModes modes =
        last_coded_[family] == 0 ? ClassModes() : classes_[last_coded_[family] - 1u].modes;
    classes_.emplace_back().modes = modes;
  }
}

template <class Coder>
void ColumnModels<Coder>::copy_modes(std::vector<ClassModes>& modes) const {
  modes.clear();
  for (const Class& entry : classes_) modes.push_back(entry.modes);
}

template <class Coder>
void ColumnModels<Coder>::code_modes(Coder& coder, std::uint32_t of_class, bool has_reference,
                                     std::span<const ClassModes> wanted_modes) {
  classes_[of_class].tile = tile_;
  ClassModes& modes = classes_[of_class].modes;
  const ClassModes& wanted = Coder::kDecodes ? modes : wanted_modes[of_class];
  if (has_reference && !coder.bit(same_input_, wanted.input == modes.input))
    modes.input = modes.input == kStates ? kDifferences : kStates;
  if (!coder.bit(same_mode_, wanted.mode == modes.mode))
    modes.mode = std::min(code_tree(coder, mode_, wanted.mode), last_mode_);
  if (!coder.bit(same_second_, wanted.second == modes.second)) {
    modes.second = code_tree(coder, second_, wanted.second);
    if (modes.second > last_mode_) modes.second = kNoMode;
  }
  std::uint16_t& last = last_coded_[tile_classes_.families[of_class]];
  if (modes.mode == kFittedMode || modes.second == kFittedMode)
    code_weights(coder, wanted.weights,
                 last == 0 ? modes.weights : classes_[last - 1u].modes.weights, modes.weights);
  last = static_cast<std::uint16_t>(of_class + 1);
}

/// Codes the fitted weights of a class. `family`: the weights of the most recently coded class of
/// the same family.
template <class Coder>
void ColumnModels<Coder>::code_weights(Coder& coder, const Weights& wanted, const Weights& family,
                                       Weights& weights) {
  if (coder.bit(same_weights_, wanted == weights)) return;
  if (coder.bit(family_weights_, wanted == family)) {
    weights = family;
    return;
  }
  for (std::uint32_t i = 0; i < kWeights; ++i) {
    const std::int64_t weight =
        plus(weights[i], code_signed(coder, weight_.get(), wanted[i] - weights[i]));
    weights[i] =
        static_cast<std::int32_t>(std::clamp<std::int64_t>(weight, -kMostWeight, kMostWeight));
  }
}

// --- once per element

template <class Coder>
std::int64_t ColumnModels<Coder>::code_residual(Coder& coder, const ResidualContext& context,
                                                bool second, std::int64_t residual) {
  return code_near_length(coder, residuals_.of(number_of(context, second)), context.mean, residual);
}

template <class Coder>
std::int64_t ColumnModels<Coder>::code_rank(Coder& coder, bool by_source, std::int64_t by) {
  auto& from = recall_.get().from[by_source ? 1 : 0];
  by = code_near_length(coder, from.ranks, from.length, by);
  from.length = bit_length(by);
  return by;
}

template <class Coder>
std::int64_t ColumnModels<Coder>::code_recalled(Coder& coder, std::int64_t residual) {
  RecallModels& models = recall_.get();
  residual = code_near_length(coder, models.residuals, models.length, residual);
  models.length = bit_length(residual);
  return residual;
}

template <class Coder>
std::int64_t ColumnModels<Coder>::code_mixed_residual(Coder& coder, const ResidualContext& context,
                                                      bool second, const SizesAround& sizes,
                                                      std::uint32_t of_class,
                                                      const OtherPredictions& others,
                                                      std::int64_t residual) {
  Mixed& mixed = mixed_.get();
  const auto how_far = [](std::int64_t other) {
    return 2 * bit_length(other) + (other < 0 ? 1 : 0);
  };
  const auto& near = sizes.near;
  mixed.coder.use(coder);
  mixed.coder.about(0, clue(near[0] + near[1] + near[2], sizes.before, second),
                    clue(near[0], near[1], near[2]), clue(of_class, sizes.last, second),
                    clue(how_far(others[0]), how_far(others[1])),
                    clue(sizes.before, sizes.two_before, how_far(others[2])));
  return code_signed(mixed.coder, mixed.residuals.of(number_of(context, second)), residual);
}

template class ColumnModels<SplitEncoder>;
template class ColumnModels<SplitDecoder>;

}  // namespace shm
