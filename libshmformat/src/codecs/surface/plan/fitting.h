// Fitting: computes weights for the fitted predictor by least squares that are robust against
// outliers. Encoder only.
#pragma once

#include <span>

#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// One equation: the sum of weights * terms should equal `target`.
struct FitSample {
  std::array<double, kWeights> terms{};
  double target = 0;
};

/// Returns weights in units of 1 / kWeightParts. All weights are zero if no better weights are
/// found. Samples close to the current fit have more influence (iteratively reweighted least
/// squares).
Weights fit_weights(std::span<const FitSample> samples);

}  // namespace shm
