// Fitting: computes the weights of the fitted predictor by a least squares method that is robust
// against outliers. Only the encoder uses it.
#pragma once

#include <span>

#include "codecs/surface/values/value_predictor.h"

namespace shm {

/// An equation: the sum of weights * terms should be equal to `target`.
struct FitSample {
  std::array<double, kWeights> terms{};
  double target = 0;
};

/// Returns the weights in units of 1 / kWeightParts. If no better weights are found, all weights
/// are zero. The method is iteratively reweighted least squares: samples close to the current fit
/// have more influence.
Weights fit_weights(std::span<const FitSample> samples);

}  // namespace shm
