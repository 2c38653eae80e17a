// Value predictor: computes predictions for the next value of a column.
//   ClassNumbers  groups similar neighbourhoods into classes. All elements of a class are predicted
//                 by the same predictor
//   Predictor     computes all predictions from the states of a neighbourhood. A *mode* is one of
//                 these predictions. The encoder chooses a mode for each class, and codes it
//   MatchTables   finds earlier values that occurred next to the same neighbouring values
// All computations use double arithmetic. The operations + - * / are computed in the written order.
// spec: "Predictors", "Classes", "Matches"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "codecs/shared/neighbourhood.h"

namespace shm {

// --- classes

/// The class of each element of a tile, and the family of each class, as numbers.
struct TileClasses {
  std::span<const std::uint16_t> of_item, families;
};

/// Assigns numbers to classes, in the order in which they first occur. A class consists of the
/// neighbourhoods with the same kind, the same corner and the same known neighbours. A family
/// consists of the classes with the same kind and corner and the same known neighbours within the
/// vertex's own hexahedron. Families are numbered in the same way as classes.
class ClassNumbers {
 public:
  static constexpr std::uint32_t kMost = 65535;

  /// Returns the number of an element's class. `counts`: the bits of Neighbourhood::known that
  /// distinguish classes.
  std::uint16_t of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t key = key_of(item, counts);
    std::size_t index = place(key);
    while (entries_[index].key != key) {
      if (entries_[index].key == kFree) return add(key, index);
      index = (index + 1) & (entries_.size() - 1);
    }
    return entries_[index].number;
  }
  /// Returns the number of each class's family.
  std::span<const std::uint16_t> families() const { return families_; }

 private:
  static constexpr std::uint32_t kFree = ~std::uint32_t{0};
  struct Entry {
    std::uint32_t key = kFree;
    std::uint16_t number = 0;
  };

  /// Returns a number that combines the corner, the kind and the known neighbours. Farther
  /// neighbours are not included.
  static std::uint32_t key_of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t known = item.traits(counts);
    return (known & 0x3ffu) | (known >> 13 & 7u) << 10 | std::uint32_t{item.corner} << 13 |
           std::uint32_t{item.kind} << 16;
  }
  /// Returns a number of 14 bits that combines the corner, the kind and the known neighbours within
  /// the hexahedron.
  static std::uint16_t family_key(std::uint32_t key) {
    return static_cast<std::uint16_t>((key & Neighbourhood::kLattice) | (key >> 13 & 127u) << 7);
  }
  std::size_t place(std::uint32_t key) const {
    return (key * 0x9e3779b1u >> 8) & (entries_.size() - 1);
  }
  std::uint16_t add(std::uint32_t key, std::size_t index) {
    const auto number = static_cast<std::uint16_t>(count_ < kMost ? count_++ : count_ - 1);
    entries_[index] = {key, number};
    if (number == families_.size()) {
      const auto found = std::find(family_keys_.begin(), family_keys_.end(), family_key(key));
      families_.push_back(static_cast<std::uint16_t>(found - family_keys_.begin()));
      if (found == family_keys_.end()) family_keys_.push_back(family_key(key));
    }
    if (2 * ++used_ > entries_.size()) grow();
    return number;
  }
  void grow() {
    std::vector<Entry> old(2 * entries_.size());
    old.swap(entries_);
    for (const Entry& entry : old) {
      if (entry.key == kFree) continue;
      std::size_t index = place(entry.key);
      while (entries_[index].key != kFree) index = (index + 1) & (entries_.size() - 1);
      entries_[index] = entry;
    }
  }

  std::vector<Entry> entries_ = std::vector<Entry>(64);
  std::vector<std::uint16_t> families_;     // family number of each class
  std::vector<std::uint16_t> family_keys_;  // keys of the families, at most 16384
  std::uint32_t count_ = 0;
  std::size_t used_ = 0;
};

// --- predictors

/// Features: the states from which an element is predicted. They are the states of, in this order:
/// near elements (0-2), diagonal elements (3-5), the opposite element (6), elements two steps away
/// (7-9), elements three steps away (10-12), thirds (13-15, the residuals of the lattice prediction
/// at near elements 0-2), the two most recently coded elements of the column (16, 17), matches
/// (18-20), the source component of this element (21), and the partner (22).
enum Feature : std::uint32_t {
  kFNear = 0,
  kFDiagonal = 3,
  kFOpposite = 6,
  kFBeyond = 7,
  kFFarther = 10,
  kFThird = 13,
  kFLast = 16,
  kFBeforeLast = 17,
  kFMatch = 18,    // 18-20: matches (earlier values) found by three keys: the values of the near
                   // elements, the two most recent values, and the other components
  kFOther = 21,    // value of the source component of this element
  kFPartner = 22,  // value of this component at the partner
  kFeatures = 23
};

enum Mode : std::uint32_t {
  kLattice = 0,         // prediction by the best rule for the known neighbours
  kNearMode = 1,        // 1..3: the value of the near element along one axis
  kLineMode = 4,        // 4..6: linear extrapolation along one axis
  kCurveMode = 7,       // 7..9: quadratic extrapolation along one axis
  kFaceMode = 10,       // 10..12: the parallelogram rule in one face
  kThirdMode = 13,      // 13..15: the lattice prediction plus the residual of the lattice
                        // prediction at one neighbour
  kMeanThirdMode = 16,  // the lattice prediction plus the mean of the residuals used by kThirdMode
  kMeanNearMode = 17,
  kMeanLineMode = 18,
  kMeanFaceMode = 19,
  kLastMode = 20,
  kLastLineMode = 21,
  kMatchMode = 22,   // 22..24: matches (earlier values) found by three keys: the values of the near
                     // elements, the two most recent values, and the other components
  kOtherMode = 25,   // 25: the value of the source component of this element; 26: the negated value
  kFittedMode = 27,  // linear combination; the encoder determines the weights
  kStayMode = 28,    // prediction 0; with differences as input, this predicts the reference value
  kPartnerMode = 29,
  kModes = 30
};

/// Input of a mode. The input kDifferences is only for arrays with reference values.
enum PredictorInput : std::uint32_t {
  kStates = 0,
  kDifferences = 1,  // the states minus the states of the reference values
};

/// Mode number for "no second mode".
inline constexpr std::uint32_t kNoMode = 31;

inline constexpr std::uint32_t kWeights = 13;
/// Denominator of the weights. With the unit 1 / 36864, halves, thirds, quarters and ninths are
/// exact. These weights occur if a vertex is in the middle of an edge, face or cell.
inline constexpr double kWeightParts = 36864.0;
inline constexpr std::int32_t kMostWeight = 16 * 36864 - 1;
using Weights = std::array<std::int32_t, kWeights>;
inline constexpr std::array<std::uint32_t, kWeights> kTermFeatures = {
    kFThird,        kFThird + 1,    kFThird + 2, kFBeyond,   kFBeyond + 1, kFBeyond + 2, kFDiagonal,
    kFDiagonal + 1, kFDiagonal + 2, kFNear,      kFNear + 1, kFNear + 2,   kFOpposite};

/// How a class of neighbourhoods is predicted.
struct ClassModes {
  std::uint32_t mode = kLattice;
  std::uint32_t second = kNoMode;  ///< mode for elements that the first mode predicts badly
  std::uint32_t input = kStates;
  Weights weights{};
};

/// Axes of each parallelogram (face), as indices of near elements. Face i contains the diagonal
/// element i.
inline constexpr std::array<std::array<std::uint32_t, 2>, 3> kFaceAxes = {{{0, 1}, {0, 2}, {1, 2}}};

/// Computes predictions. `known`: result of Neighbourhood::traits(). `at(feature)` returns the
/// state of a feature; the predictor calls it only for known features.
template <class At>
class Predictor {
 public:
  Predictor(std::uint32_t known, const At& at) : known_(known), at_(at), lattice_(find_lattice()) {}
  /// Constructs a predictor if the result of lattice() is already known.
  Predictor(std::uint32_t known, const At& at, double lattice)
      : known_(known), at_(at), lattice_(lattice) {}

  double predict(std::uint32_t mode, const Weights& weights) const {
    if (mode == kLattice) return lattice();
    if (mode == kFittedMode) return fitted(weights);
    if (mode == kStayMode) return 0.0;
    if (mode < kLineMode) return has(mode - kNearMode) ? at_(mode - kNearMode) : lattice();
    if (mode < kCurveMode) return has_line(mode - kLineMode) ? line(mode - kLineMode) : lattice();
    if (mode < kFaceMode) {
      const std::uint32_t a = mode - kCurveMode;
      if (!has_line(a)) return lattice();
      if (!has(kFFarther + a)) return line(a);
      return 3.0 * (at_(a) - at_(kFBeyond + a)) + at_(kFFarther + a);
    }
    if (mode < kThirdMode) return has_face(mode - kFaceMode) ? face(mode - kFaceMode) : lattice();
    if (mode < kMeanThirdMode) {
      const std::uint32_t a = mode - kThirdMode;
      return has(kFThird + a) ? lattice() + at_(kFThird + a) : lattice();
    }
    switch (mode) {
      case kMeanThirdMode:
        return lattice() + mean([&](std::uint32_t a) { return has(kFThird + a); },
                                [&](std::uint32_t a) { return at_(kFThird + a); }, 0.0);
      case kMeanNearMode: return mean_near(at_(kFLast));
      case kMeanLineMode: return any_line() ? mean_line() : lattice();
      case kMeanFaceMode:
        if (is_mid_node())
          return has_thirds() ? lattice() + (third(0) + third(1) - third(2)) : lattice();
        return any_face() ? mean_face() : lattice();
      case kMatchMode: return at_(kFMatch);
      case kMatchMode + 1: return at_(kFMatch + 1);
      case kMatchMode + 2: return at_(kFMatch + 2);
      case kOtherMode: return at_(kFOther);
      case kOtherMode + 1: return -at_(kFOther);
      case kPartnerMode: return at_(kFPartner);
      case kLastLineMode: return 2.0 * at_(kFLast) - at_(kFBeforeLast);
      default: return at_(kFLast);
    }
  }

  double lattice() const { return lattice_; }
  /// Returns the terms of the weighted sum: the known features relative to `base`. The term of an
  /// unknown feature is 0.0.
  std::array<double, kWeights> terms(double base) const {
    std::array<double, kWeights> x{};
    for (std::uint32_t i = 0; i < kWeights; ++i) x[i] = term(i, base);
    return x;
  }

 private:
  double find_lattice() const {
    if (is_mid_node()) return middle();
    if (kind() == Neighbourhood::simplex) return behind_face();
    if (kind() == Neighbourhood::beside) return mean_near(at_(kFLast));
    if (knows_lattice()) return ((at_(0) + at_(1) + at_(2)) - (at_(3) + at_(4) + at_(5))) + at_(6);
    if (any_face()) return mean_face();
    if (any_line()) return mean_line();
    for (std::uint32_t a = 0; a < 3; ++a)
      if (has(a)) return at_(a);
    return at_(kFLast);
  }
  /// Returns the kind of the neighbourhood. The result is Neighbourhood::lattice for all kinds that
  /// are predicted by the lattice rule, since traits() does not distinguish these kinds.
  std::uint32_t kind() const { return known_ >> Neighbourhood::kKindShift; }
  bool is_mid_node() const {
    return kind() == Neighbourhood::midpoint || kind() == Neighbourhood::centre;
  }
  double mean_near(double none) const {
    return mean([&](std::uint32_t a) { return has(a); }, [&](std::uint32_t a) { return at_(a); },
                none);
  }
  /// Extrapolates across a face. Let m be the mean of the vertices of the face, and v the vertex
  /// (or the mean of the vertices) on the other side of the face. The prediction is m + (m - v) /
  /// 2.
  double behind_face() const {
    const double middle = mean_near(at_(kFLast));
    if (has(kFOpposite)) return middle + (middle - at_(kFOpposite)) * 0.5;
    if (!has(kFBeyond) && !has(kFBeyond + 1) && !has(kFBeyond + 2)) return middle;
    const double behind = mean([&](std::uint32_t a) { return has(kFBeyond + a); },
                               [&](std::uint32_t a) { return at_(kFBeyond + a); }, 0.0);
    return middle + (middle - behind) * 0.5;
  }
  /// Returns the middle of an edge, computed from the ends of the edge, or the middle of a face,
  /// computed from the edges of the face (transfinite interpolation).
  double middle() const {
    if (kind() == Neighbourhood::midpoint) return (at_(kFDiagonal) + at_(kFDiagonal + 1)) * 0.5;
    const std::uint32_t edge = kFDiagonal, corner = kFBeyond;
    return ((at_(edge) + at_(edge + 2)) + (at_(edge + 1) + at_(edge + 3))) * 0.5 -
           ((at_(corner) + at_(corner + 2)) + (at_(corner + 1) + at_(corner + 3))) * 0.25;
  }
  bool has_thirds() const { return has(kFThird) && has(kFThird + 1) && has(kFThird + 2); }
  double third(std::uint32_t a) const { return at_(kFThird + a); }
  bool has(std::uint32_t feature) const { return (known_ >> feature & 1) != 0; }
  bool knows_lattice() const {
    return (known_ & Neighbourhood::kLattice) == Neighbourhood::kLattice;
  }
  bool has_line(std::uint32_t a) const { return has(a) && has(kFBeyond + a); }
  bool has_face(std::uint32_t i) const {
    return has(kFaceAxes[i][0]) && has(kFaceAxes[i][1]) && has(kFDiagonal + i);
  }
  bool any_line() const { return has_line(0) || has_line(1) || has_line(2); }
  bool any_face() const { return has_face(0) || has_face(1) || has_face(2); }
  double line(std::uint32_t a) const { return 2.0 * at_(a) - at_(kFBeyond + a); }
  double face(std::uint32_t i) const {
    return (at_(kFaceAxes[i][0]) + at_(kFaceAxes[i][1])) - at_(kFDiagonal + i);
  }
  double mean_line() const {
    return mean([&](std::uint32_t a) { return has_line(a); },
                [&](std::uint32_t a) { return line(a); }, 0.0);
  }
  double mean_face() const {
    return mean([&](std::uint32_t i) { return has_face(i); },
                [&](std::uint32_t i) { return face(i); }, 0.0);
  }
  double term(std::uint32_t i, double base) const {
    const std::uint32_t feature = kTermFeatures[i];
    if (!has(feature)) return 0.0;
    if (feature >= kFThird) return at_(feature);
    // If all near, diagonal and opposite elements are known, the term of the opposite element is a
    // linear combination of the other terms. It is then omitted.
    if (feature == kFOpposite && knows_lattice()) return 0.0;
    return at_(feature) - base;
  }
  double fitted(const Weights& weights) const {
    const double base = lattice();
    double sum = 0.0;
    for (std::uint32_t i = 0; i < kWeights; ++i)
      if (weights[i] != 0) sum += static_cast<double>(weights[i]) / kWeightParts * term(i, base);
    return base + sum;
  }
  template <class Has, class Get>
  static double mean(Has&& has, Get&& get, double none) {
    double sum = 0.0;
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < 3; ++i) {
      if (!has(i)) continue;
      sum += get(i);
      ++count;
    }
    return count == 0 ? none : count == 1 ? sum : sum / static_cast<double>(count);
  }

  std::uint32_t known_;
  const At& at_;
  double lattice_;
};

/// Computes predictions of an element by the modes of its class. `at`, `difference_at`: functions
/// that return a feature of the inputs kStates and kDifferences. `reference`: state of the
/// element's reference value, if there is one.
template <class At, class DifferenceAt>
class ClassPredictor {
 public:
  ClassPredictor(const ClassModes& modes, std::uint32_t known, const At& at,
                 const DifferenceAt& difference_at, double reference)
      : modes_(modes),
        known_(known),
        states_(known, at),
        difference_at_(difference_at),
        reference_(reference) {}

  const ClassModes& modes() const { return modes_; }
  double lattice() const { return states_.lattice(); }
  double operator()(std::uint32_t mode) const {
    if (modes_.input == kStates) return states_.predict(mode, modes_.weights);
    return reference_ + Predictor(known_, difference_at_).predict(mode, modes_.weights);
  }

 private:
  const ClassModes& modes_;
  std::uint32_t known_;
  Predictor<At> states_;
  const DifferenceAt& difference_at_;
  double reference_;
};

// --- matches

/// Number of kinds of keys by which values are looked up: the values of the near elements, the two
/// most recent values, and the values of the other components.
inline constexpr std::uint32_t kMatchKinds = 3;

/// Finds earlier values that were coded next to the same neighbouring values. Such values occur in
/// meshes with repeated or mirrored parts. The key of a lookup is made of the neighbouring values:
/// their magnitudes, with the lowest 12 bits rounded away. Signs are not part of the key. If the
/// first neighbouring value does not have the same sign as when the entry was stored, the result is
/// negated.
class MatchTables {
 public:
  /// Position of an entry in a table, and the sign of the key.
  struct Place {
    std::uint32_t at = 0;
    bool negative = false;
  };
  using Places = std::array<Place, kMatchKinds>;

  /// Hash of a set of magnitudes. It does not depend on the order of the magnitudes.
  class Key {
   public:
    void add(double value) {
      const std::uint64_t size =
          (std::bit_cast<std::uint64_t>(value) & ~(std::uint64_t{1} << 63)) + (1u << 11);
      std::uint64_t mixed = (size >> 12) * 0x9e3779b97f4a7c15u;
      mixed ^= mixed >> 29;
      hash_ += mixed * 0xbf58476d1ce4e5b9u;
      if (!std::exchange(any_, true)) negative_ = value < 0;
    }
    Place place() const {
      return {static_cast<std::uint32_t>(hash_ * 0xbf58476d1ce4e5b9u >> (64 - kMostBits)),
              negative_};
    }

   private:
    std::uint64_t hash_ = 0;
    bool any_ = false, negative_ = false;
  };

  /// Prepares the tables for `values` further values. Tables that have to grow are cleared.
  void expect(std::size_t values) {
    values_ += values;
    const int wanted = std::clamp<int>(static_cast<int>(std::bit_width(8 * values_)), 8, kMostBits);
    if (bits_ == wanted) return;
    bits_ = wanted;
    for (auto& table : tables_) table.assign(std::size_t{1} << bits_, 0.0);
  }
  // Precondition: expect() has been called.
  double find(std::uint32_t kind, const Place& place) const {
    const double value = tables_[kind][place.at >> (kMostBits - bits_)];
    return place.negative ? -value : value;
  }
  void remember(const Places& places, double value) {
    for (std::uint32_t kind = 0; kind < kMatchKinds; ++kind)
      tables_[kind][places[kind].at >> (kMostBits - bits_)] =
          places[kind].negative ? -value : value;
  }

 private:
  static constexpr int kMostBits = 15;
  std::size_t values_ = 0;
  int bits_ = 0;
  // Values, negated if their key was negative
  std::array<std::vector<double>, kMatchKinds> tables_;
};

}  // namespace shm
