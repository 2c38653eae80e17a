// Value predictor: what the next value of a column is predicted from, and how.
//   ClassNumbers  which neighbourhoods are alike: they are predicted alike
//   Predictor     candidates, from the states of a neighbourhood. A *mode* names one; the encoder
//                 chooses one for each class, and a decoder computes only that one
//   MatchTables   what a component was when it stood among the same values
// Double arithmetic, + - * / in the order written. spec: "Predictors", "Classes", "Matches"
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "values/neighbourhood.h"

namespace shm {

// --- classes

/// Of the elements of a tile the numbers of their classes, and of each class that of its family.
struct TileClasses {
  std::span<const std::uint16_t> of_item, families;
};

/// Neighbourhoods of which the same is known and that stand alike are a class; its number is how
/// many other classes came before it. Classes of one family know the same of their own hexahedron,
/// and differ in what is beyond it; families are numbered likewise.
class ClassNumbers {
 public:
  static constexpr std::uint32_t kMost = 65535;

  /// `counts`: bits of Neighbourhood::known that count.
  std::uint16_t of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t key = key_of(item, counts);
    std::size_t at = place(key);
    while (entries_[at].key != key) {
      if (entries_[at].key == kFree) return add(key, at);
      at = (at + 1) & (entries_.size() - 1);
    }
    return entries_[at].number;
  }
  /// By class: the number of its family.
  std::span<const std::uint16_t> families() const { return families_; }

 private:
  static constexpr std::uint32_t kFree = ~std::uint32_t{0};
  struct Entry {
    std::uint32_t key = kFree;
    std::uint16_t number = 0;
  };

  /// What is known but for what is farther; the corner; the kind.
  static std::uint32_t key_of(const Neighbourhood& item, std::uint32_t counts) {
    const std::uint32_t known = item.traits(counts);
    return (known & 0x3ffu) | (known >> 13 & 7u) << 10 | std::uint32_t{item.corner} << 13 |
           std::uint32_t{item.kind} << 16;
  }
  /// What is known within the hexahedron; the corner; the kind: 13 bits.
  static std::uint16_t family_key(std::uint32_t key) {
    return static_cast<std::uint16_t>((key & Neighbourhood::kLattice) | (key >> 13 & 63u) << 7);
  }
  std::size_t place(std::uint32_t key) const {
    return (key * 0x9e3779b1u >> 8) & (entries_.size() - 1);
  }
  std::uint16_t add(std::uint32_t key, std::size_t at) {
    const auto number = static_cast<std::uint16_t>(count_ < kMost ? count_++ : count_ - 1);
    entries_[at] = {key, number};
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
      std::size_t at = place(entry.key);
      while (entries_[at].key != kFree) at = (at + 1) & (entries_.size() - 1);
      entries_[at] = entry;
    }
  }

  std::vector<Entry> entries_ = std::vector<Entry>(64);
  std::vector<std::uint16_t> families_;     // by class
  std::vector<std::uint16_t> family_keys_;  // in order of number: at most 8192
  std::uint32_t count_ = 0;
  std::size_t used_ = 0;
};

// --- predictors

/// States around an element, in this order: near 0-2, diagonal 3-5, opposite 6, beyond 7-9,
/// farther 10-12, thirds 13-15 (what the lattice missed at near 0-2), and the two elements coded
/// last in the column.
enum Feature : std::uint32_t {
  kFNear = 0,
  kFDiagonal = 3,
  kFOpposite = 6,
  kFBeyond = 7,
  kFFarther = 10,
  kFThird = 13,
  kFLast = 16,
  kFBeforeLast = 17,
  kFMatch = 18,    // 18-20: what came when the same stood near, before, or in the other components
  kFOther = 21,    // what the component before is here
  kFPartner = 22,  // what the component is at the partner
  kFeatures = 23
};

enum Mode : std::uint32_t {
  kLattice = 0,         // the best rule that the known corners allow
  kNearMode = 1,        // 1..3: a copy along one axis
  kLineMode = 4,        // 4..6: a straight line along one axis
  kCurveMode = 7,       // 7..9: a parabola along one axis
  kFaceMode = 10,       // 10..12: a parallelogram
  kThirdMode = 13,      // 13..15: the lattice, corrected by what it missed at one neighbour
  kMeanThirdMode = 16,  // by the mean of these
  kMeanNearMode = 17,
  kMeanLineMode = 18,
  kMeanFaceMode = 19,
  kLastMode = 20,
  kLastLineMode = 21,
  kMatchMode = 22,   // 22-24: what came when the same stood near, before, in other components
  kOtherMode = 25,   // 25, 26: what the component before is here, or its negative
  kFittedMode = 27,  // weights that the encoder has fitted
  kStayMode = 28,    // nothing: of differences only
  kPartnerMode = 29,
  kModes = 30
};

/// What modes are applied to: where there is a reference, one of two.
enum PredictorInput : std::uint32_t {
  kStates = 0,
  kDifferences = 1,  // of the states from those of the reference
};

/// As a second predictor: there is none.
inline constexpr std::uint32_t kNoMode = 31;

inline constexpr std::uint32_t kWeights = 13;
/// Weights are multiples of one part in so many: halves, thirds, quarters and ninths, of which
/// vertices in the middle of others are made, are exact.
inline constexpr double kWeightParts = 36864.0;
inline constexpr std::int32_t kMostWeight = 16 * 36864 - 1;
using Weights = std::array<std::int32_t, kWeights>;
inline constexpr std::array<std::uint32_t, kWeights> kTermFeatures = {
    kFThird,        kFThird + 1,    kFThird + 2, kFBeyond,   kFBeyond + 1, kFBeyond + 2, kFDiagonal,
    kFDiagonal + 1, kFDiagonal + 2, kFNear,      kFNear + 1, kFNear + 2,   kFOpposite};

/// How a class of neighbourhoods is predicted.
struct ClassModes {
  std::uint32_t mode = kLattice;
  std::uint32_t second = kNoMode;  ///< a mode that may be right where the first is wrong
  std::uint32_t input = kStates;
  Weights weights{};
};

/// The axes of each parallelogram, as near[..] indices; its diagonal has the number of the face.
inline constexpr std::array<std::array<std::uint32_t, 2>, 3> kFaceAxes = {{{0, 1}, {0, 2}, {1, 2}}};

/// `known`: Neighbourhood::traits(). `at(feature)` is the state of a feature; called for known
/// ones only.
template <class At>
class Predictor {
 public:
  Predictor(std::uint32_t known, const At& at) : known_(known), at_(at), lattice_(find_lattice()) {}
  /// Where lattice() is known.
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
  /// What the weights multiply, beside `base`: 0.0 where it is not known.
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
  /// lattice also where the rule is that of corners of hexahedra.
  std::uint32_t kind() const { return known_ >> Neighbourhood::kKindShift; }
  bool is_mid_node() const {
    return kind() == Neighbourhood::midpoint || kind() == Neighbourhood::centre;
  }
  double mean_near(double none) const {
    return mean([&](std::uint32_t a) { return has(a); }, [&](std::uint32_t a) { return at_(a); },
                none);
  }
  /// Half as far before the middle of a face as what is known behind it.
  double behind_face() const {
    const double middle = mean_near(at_(kFLast));
    if (has(kFOpposite)) return middle + (middle - at_(kFOpposite)) * 0.5;
    if (!has(kFBeyond) && !has(kFBeyond + 1) && !has(kFBeyond + 2)) return middle;
    const double behind = mean([&](std::uint32_t a) { return has(kFBeyond + a); },
                               [&](std::uint32_t a) { return at_(kFBeyond + a); }, 0.0);
    return middle + (middle - behind) * 0.5;
  }
  /// Between the ends of an edge; in a face from its edges: a transfinite interpolation.
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
    // Where all of the lattice is known, the others determine the opposite one.
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

/// What modes predict for an element of a class. `at` and `difference_at`: both inputs;
/// `reference`: the state of the reference, if there is one.
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

/// Keys to look up by: what is near, the two elements before, the other components.
inline constexpr std::uint32_t kMatchKinds = 3;

/// In a part of the mesh that is a copy, mirrored or not, the same values come again. Magnitudes
/// are compared, but for their last bits; the sign follows.
class MatchTables {
 public:
  /// Where a table has the value of a key, and the key's sign.
  struct Place {
    std::uint32_t at = 0;
    bool negative = false;
  };
  using Places = std::array<Place, kMatchKinds>;

  /// Magnitudes, in any number; their order does not matter.
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

  /// Makes room for so many more values. Where the tables grow they forget.
  void expect(std::size_t values) {
    values_ += values;
    const int wanted = std::clamp<int>(static_cast<int>(std::bit_width(8 * values_)), 8, kMostBits);
    if (bits_ == wanted) return;
    bits_ = wanted;
    for (auto& table : tables_) table.assign(std::size_t{1} << bits_, 0.0);
  }
  // Must hold: expect() came before.
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
  std::array<std::vector<double>, kMatchKinds> tables_;  // values as after a positive key
};

}  // namespace shm
