#include "coders/columns.h"

#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

#include "coders/value_domain.h"

namespace shm {
namespace {

/// Coarser with growing surprise, so that contexts stay few: 0..12 apart, then in fours.
std::uint32_t surprise_class(std::uint32_t mean) { return mean <= 12 ? mean : 12 + (mean - 9) / 4; }
constexpr std::uint32_t kSurpriseClasses = 27;

/// Models by context, made when first met: memory follows what a file really uses.
template <class Model, std::size_t kContexts>
class LazyModels {
 public:
  Model& operator[](std::size_t context) {
    auto& model = models_[context];
    if (!model) model = std::make_unique<Model>();
    return *model;
  }

 private:
  std::array<std::unique_ptr<Model>, kContexts> models_;
};

/// Components beyond the third share the third's models.
std::size_t model_component(std::size_t component) { return std::min<std::size_t>(component, 2); }

double combine(const Stencil& s, const double* v, std::size_t stride) {
  const auto at = [&](std::size_t i) { return v[s.at[i] * stride]; };
  switch (s.kind) {
    case Stencil::last: break;
    case Stencil::copy: return at(0);
    case Stencil::midpoint: return (at(0) + at(1)) / 2.0;
    case Stencil::parallelogram: return (at(0) + at(1)) - at(2);
    case Stencil::lorenzo: return (((at(0) + at(1)) + at(2)) - ((at(3) + at(4)) + at(5))) + at(6);
  }
  return 0.0;
}
std::uint64_t combine(const Stencil& s, const std::uint64_t* v, std::size_t stride) {
  const auto at = [&](std::size_t i) { return v[s.at[i] * stride]; };
  switch (s.kind) {
    case Stencil::last: break;
    case Stencil::copy: return at(0);
    case Stencil::midpoint:
      return at(0) + static_cast<std::uint64_t>(static_cast<std::int64_t>(at(1) - at(0)) / 2);
    case Stencil::parallelogram: return at(0) + at(1) - at(2);
    case Stencil::lorenzo: return at(0) + at(1) + at(2) - at(3) - at(4) - at(5) + at(6);
  }
  return 0;
}

template <class Coder, class Domain>
class VertexColumnOf final : public VertexColumn<Coder> {
 public:
  explicit VertexColumnOf(const ArrayInfo& info)
      : components_(info.components), last_(components_), last_surprise_(components_) {
    for (std::size_t c = 0; c < components_; ++c) domains_.emplace_back(info, c);
  }

  void code(Coder& coder, const Stencil& stencil, std::uint32_t slot, std::byte* bytes) override {
    const std::size_t end = (std::size_t{slot} + 1) * components_;
    if (end > values_.size()) {
      values_.resize(std::max(end, values_.size() * 2));
      surprises_.resize(values_.size());
    }
    for (std::size_t c = 0; c < components_; ++c) {
      const State prediction = stencil.kind == Stencil::last
                                   ? last_[c]
                                   : combine(stencil, values_.data() + c, components_);
      auto& models = models_[model_component(c)];
      Surprise surprise = 0;
      last_[c] = domains_[c].code(coder, models[context(stencil, c)], prediction,
                                  bytes + c * Domain::kBytes, surprise);
      values_[slot * components_ + c] = last_[c];
      surprises_[slot * components_ + c] = surprise;
      last_surprise_[c] = surprise;
    }
  }

 private:
  using State = typename Domain::State;

  std::size_t context(const Stencil& stencil, std::size_t c) const {
    const std::uint32_t n = std::min(stencil.size(), 3u);
    std::uint32_t sum = n == 0 ? last_surprise_[c] : 0;
    for (std::uint32_t i = 0; i < n; ++i) sum += surprises_[stencil.at[i] * components_ + c];
    const std::uint32_t mean = n == 0 ? sum : (sum + n / 2) / n;
    return stencil.kind * kSurpriseClasses + surprise_class(mean);
  }

  std::size_t components_;
  std::vector<Domain> domains_;
  std::vector<State> values_, last_;
  std::vector<Surprise> surprises_, last_surprise_;
  std::array<LazyModels<typename Domain::Model, 5 * kSurpriseClasses>, 3> models_;
};

/// The faces of a cell that lead to a known neighbour, with integer weights: 8 for a face whose
/// opposite leads to one too, 7 for one that stands alone. These are the weights that minimise
/// the sum of squared differences along the edges of a 3x3x3 grid (spec, "Cell columns").
struct Neighbours {
  std::array<std::uint32_t, 6> cell{};
  std::array<double, 6> weight{};
  double weight_sum = 0;
  std::uint32_t count = 0;

  template <class Known>
  Neighbours(const CellTopology& topology, Known&& known) {
    constexpr std::array<std::uint8_t, 6> kOpposite = {5, 3, 4, 1, 2, 0};
    const auto has = [&](std::uint32_t k) {
      return (topology.face_mask >> k & 1) != 0 && known(topology.neighbour[k]);
    };
    for (std::uint32_t k = 0; k < 6; ++k) {
      if (!has(k)) continue;
      cell[count] = topology.neighbour[k];
      weight[count] = has(kOpposite[k]) ? 8.0 : 7.0;
      weight_sum += weight[count++];
    }
  }
};

template <class Coder, class Domain>
class CellColumnOf final : public CellColumn<Coder> {
 public:
  explicit CellColumnOf(const ArrayInfo& info)
      : components_(info.components), last_(components_), last_surprise_(components_) {
    for (std::size_t c = 0; c < components_; ++c) domains_.emplace_back(info, c);
  }

  void code(Coder& coder, const CellTopology& cell, std::byte* bytes) override {
    const Neighbours near(cell, [&](std::uint32_t slot) { return known_[slot] != 0; });
    if (cell.cell_slot != kNone) make_room(cell.cell_slot);
    for (std::size_t c = 0; c < components_; ++c) {
      double first_order = 0;
      if constexpr (kSecondOrder) first_order = mean(values_, near, c);
      State prediction = last_[c];
      if (near.count > 0) {
        if constexpr (kSecondOrder)
          prediction = first_order + mean(residuals_, near, c);
        else
          prediction = values_[near.cell[0] * components_ + c];
      }
      Surprise surprise = 0;
      auto& models = models_[model_component(c)];
      last_[c] = domains_[c].code(coder, models[context(near, c)], prediction,
                                  bytes + c * Domain::kBytes, surprise);
      last_surprise_[c] = surprise;
      if (cell.cell_slot == kNone) continue;
      const std::size_t at = cell.cell_slot * components_ + c;
      values_[at] = last_[c];
      surprises_[at] = surprise;
      if constexpr (kSecondOrder) {
        const double residual = near.count > 0 ? last_[c] - first_order : 0.0;
        residuals_[at] = residual == residual ? residual : 0.0;
      }
    }
    if (cell.cell_slot != kNone) known_[cell.cell_slot] = 1;
  }

  void skip(const CellTopology& cell) override {
    if (cell.cell_slot == kNone) return;
    make_room(cell.cell_slot);
    known_[cell.cell_slot] = 0;
  }

 private:
  using State = typename Domain::State;
  static constexpr bool kSecondOrder = std::is_same_v<State, double>;

  void make_room(std::uint32_t slot) {
    if (slot < known_.size()) return;
    const std::size_t cells = std::max<std::size_t>(std::size_t{slot} + 1, known_.size() * 2);
    known_.resize(cells);
    values_.resize(cells * components_);
    surprises_.resize(cells * components_);
    if constexpr (kSecondOrder) residuals_.resize(cells * components_);
  }
  double mean(const std::vector<double>& of, const Neighbours& near, std::size_t c) const {
    double sum = 0;
    for (std::uint32_t i = 0; i < near.count; ++i)
      sum += near.weight[i] * of[near.cell[i] * components_ + c];
    return near.count > 0 ? sum / near.weight_sum : 0.0;
  }
  std::size_t context(const Neighbours& near, std::size_t c) const {
    std::uint32_t sum = near.count == 0 ? last_surprise_[c] : 0;
    for (std::uint32_t i = 0; i < near.count; ++i)
      sum += surprises_[near.cell[i] * components_ + c];
    const std::uint32_t n = std::max(near.count, 1u);
    return std::min(near.count, 3u) * kSurpriseClasses + surprise_class((sum + n / 2) / n);
  }

  std::size_t components_;
  std::vector<Domain> domains_;
  std::vector<State> values_, last_;
  std::vector<double> residuals_;
  std::vector<Surprise> surprises_, last_surprise_;
  std::vector<std::uint8_t> known_;
  std::array<LazyModels<typename Domain::Model, 4 * kSurpriseClasses>, 3> models_;
};

template <template <class, class> class Column, class Coder, class Base>
std::unique_ptr<Base> create_column(const ArrayInfo& info) {
  const bool quantized = info.quantization.bits != 0;
  switch (info.type) {
    case ScalarType::int8: return std::make_unique<Column<Coder, IntegerDomain<std::int8_t>>>(info);
    case ScalarType::uint8:
      return std::make_unique<Column<Coder, IntegerDomain<std::uint8_t>>>(info);
    case ScalarType::int16:
      return std::make_unique<Column<Coder, IntegerDomain<std::int16_t>>>(info);
    case ScalarType::uint16:
      return std::make_unique<Column<Coder, IntegerDomain<std::uint16_t>>>(info);
    case ScalarType::int32:
      return std::make_unique<Column<Coder, IntegerDomain<std::int32_t>>>(info);
    case ScalarType::uint32:
      return std::make_unique<Column<Coder, IntegerDomain<std::uint32_t>>>(info);
    case ScalarType::int64:
      return std::make_unique<Column<Coder, IntegerDomain<std::int64_t>>>(info);
    case ScalarType::uint64:
      return std::make_unique<Column<Coder, IntegerDomain<std::uint64_t>>>(info);
    case ScalarType::float32:
      if (quantized) return std::make_unique<Column<Coder, QuantizedDomain<float>>>(info);
      return std::make_unique<Column<Coder, FloatDomain<float>>>(info);
    case ScalarType::float64:
      if (quantized) return std::make_unique<Column<Coder, QuantizedDomain<double>>>(info);
      return std::make_unique<Column<Coder, FloatDomain<double>>>(info);
  }
  return nullptr;  // a schema is checked before its columns are made
}

}  // namespace

template <class Coder>
std::unique_ptr<VertexColumn<Coder>> VertexColumn<Coder>::create(const ArrayInfo& info) {
  return create_column<VertexColumnOf, Coder, VertexColumn<Coder>>(info);
}
template <class Coder>
std::unique_ptr<CellColumn<Coder>> CellColumn<Coder>::create(const ArrayInfo& info) {
  return create_column<CellColumnOf, Coder, CellColumn<Coder>>(info);
}

template class VertexColumn<RangeEncoder>;
template class VertexColumn<RangeDecoder>;
template class CellColumn<RangeEncoder>;
template class CellColumn<RangeDecoder>;

}  // namespace shm
