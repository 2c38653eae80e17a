// Fitting: weights for the fitted predictor, by least squares that trusts no outlier. Encoder only.
#pragma once

#include <span>

#include "values/value_predictor.h"

namespace shm {

/// One equation: sum of weights * terms should be target.
struct FitSample {
  std::array<double, kWeights> terms{};
  double target = 0;
};

/// Weights in parts of kWeightParts; all zero where nothing better is found. The samples weigh by
/// how near the fit comes to them.
Weights fit_weights(std::span<const FitSample> samples);

}  // namespace shm
