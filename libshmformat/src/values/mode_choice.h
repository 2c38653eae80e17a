// Mode choice: with which predictors the classes of a tile are coded. Encoder only: it looks at all
// elements of the tile before it codes any.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "values/value_predictor.h"

namespace shm {

/// An element as the encoder sees it.
struct ModeSample {
  std::array<double, kFeatures> state{};
  std::optional<std::int64_t> index;
  std::uint32_t known = 0, of_class = 0;
  double reference = 0;  ///< state of the reference
};
/// The elements of a tile.
struct ModeSamples {
  std::vector<ModeSample> samples;
  /// From the states of the reference; of all samples or of none.
  std::vector<std::array<double, kFeatures>> differences;
};

/// How each class of these elements is best predicted. `families`: by class. `modes`, by class: as
/// it is predicted now, on input. `matches`: whether modes may look at matches and other
/// components.
template <class Space>
void choose_modes(const Space& space, const ModeSamples& samples,
                  std::span<const std::uint16_t> families, bool matches,
                  std::vector<ClassModes>& modes);

/// Knows when to choose anew.
class ModeWatch {
 public:
  /// Before each tile, of elements of these classes: whether modes are to be chosen for it. If it
  /// `hurries`, only where a class is new, has done worse than when its modes were chosen, or has
  /// kept them for long.
  bool begin_tile(std::span<const std::uint16_t> classes, bool hurries);
  /// An element of the tile took so many bits.
  void note(std::uint32_t of_class, std::uint32_t bits) {
    records_[of_class].count += 1;
    records_[of_class].bits += bits;
  }

 private:
  struct Record {
    double count = 0, bits = 0;  // elements and bits in the tile at hand
    double bits_then = -1;       // an element, when the modes were chosen; negative: never
    std::uint32_t tiles_since = 0;
  };
  bool does_worse(std::span<const std::uint32_t> count, std::size_t elements);

  std::vector<Record> records_;  // by class
};

}  // namespace shm
