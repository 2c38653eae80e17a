#include "values/fitting.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shm {
namespace {

using Vector = std::array<double, kWeights>;
using Matrix = std::array<Vector, kWeights>;

double dot(const Vector& a, const Vector& b) {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < kWeights; ++i) sum += a[i] * b[i];
  return sum;
}

/// Solves a x = b for a symmetric, positive matrix (Cholesky); directions without data stay 0.
Vector solve(Matrix a, Vector b) {
  std::array<bool, kWeights> used{};
  for (std::uint32_t i = 0; i < kWeights; ++i) {
    const double whole = a[i][i];
    for (std::uint32_t k = 0; k < i; ++k)
      if (used[k]) a[i][i] -= a[i][k] * a[i][k];
    used[i] = whole > 0.0 && a[i][i] > 1e-10 * whole;
    if (!used[i]) continue;
    a[i][i] = std::sqrt(a[i][i]);
    for (std::uint32_t j = i + 1; j < kWeights; ++j) {
      for (std::uint32_t k = 0; k < i; ++k)
        if (used[k]) a[j][i] -= a[j][k] * a[i][k];
      a[j][i] /= a[i][i];
    }
  }
  Vector x{};
  for (std::uint32_t i = 0; i < kWeights; ++i) {
    if (!used[i]) continue;
    x[i] = b[i];
    for (std::uint32_t k = 0; k < i; ++k)
      if (used[k]) x[i] -= a[i][k] * x[k];
    x[i] /= a[i][i];
  }
  for (std::uint32_t i = kWeights; i-- > 0;) {
    if (!used[i]) continue;
    for (std::uint32_t k = i + 1; k < kWeights; ++k)
      if (used[k]) x[i] -= a[k][i] * x[k];
    x[i] /= a[i][i];
  }
  return x;
}

}  // namespace

Weights fit_weights(std::span<const FitSample> samples) {
  constexpr int kRounds = 4;
  Vector x{};
  for (int round = 0; round < kRounds; ++round) {
    double mean = 0.0;
    for (const FitSample& sample : samples) mean += std::fabs(sample.target - dot(sample.terms, x));
    mean /= static_cast<double>(samples.size());
    if (!(mean > 0.0 && mean < 1e300)) break;
    Matrix a{};
    Vector b{};
    for (const FitSample& sample : samples) {
      const double missed = std::fabs(sample.target - dot(sample.terms, x));
      const double weight = 1.0 / (missed + mean * 0.05);
      for (std::uint32_t i = 0; i < kWeights; ++i) {
        const double weighted = weight * sample.terms[i];
        if (weighted == 0.0) continue;
        b[i] += weighted * sample.target;
        for (std::uint32_t j = 0; j <= i; ++j) a[i][j] += weighted * sample.terms[j];
      }
    }
    x = solve(a, b);
  }
  Weights weights{};
  for (std::uint32_t i = 0; i < kWeights; ++i) {
    constexpr double kMost = kMostWeight;
    const double scaled = std::clamp(x[i] * kWeightParts, -kMost, kMost);
    weights[i] =
        scaled == scaled ? static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5) : 0;
  }
  return weights;
}

}  // namespace shm
