#include "codecs/surface/plan/fitting.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shm {
namespace {

using Vector = std::array<double, kWeights>;
using Matrix = std::array<Vector, kWeights>;

/// The equations, reduced to those terms that are not zero in at least one sample. Usually only a
/// few of the 13 terms remain.
struct Equations {
  explicit Equations(std::span<const FitSample> samples) {
    std::array<bool, kWeights> any{};
    for (const FitSample& sample : samples)
      for (std::uint32_t i = 0; i < kWeights; ++i) any[i] = any[i] || sample.terms[i] != 0.0;
    for (std::uint32_t i = 0; i < kWeights; ++i)
      if (any[i]) terms[count++] = i;
    rows.reserve(samples.size() * count);
    for (const FitSample& sample : samples)
      for (std::uint32_t i = 0; i < count; ++i) rows.push_back(sample.terms[terms[i]]);
  }
  const double* row(std::size_t sample) const { return rows.data() + sample * count; }

  std::uint32_t count = 0;
  std::array<std::uint32_t, kWeights> terms{};  // indices of the terms that occur, ascending
  std::vector<double> rows;
};

double dot(const double* row, const Vector& x, std::uint32_t count) {
  double sum = 0.0;
  for (std::uint32_t i = 0; i < count; ++i) sum += row[i] * x[i];
  return sum;
}

/// Solves the equation a * x = b for a symmetric positive definite matrix `a` by Cholesky
/// decomposition. An unknown without data remains 0.
Vector solve(Matrix a, const Vector& b, std::uint32_t count) {
  std::array<bool, kWeights> used{};
  for (std::uint32_t i = 0; i < count; ++i) {
    const double whole = a[i][i];
    for (std::uint32_t k = 0; k < i; ++k)
      if (used[k]) a[i][i] -= a[i][k] * a[i][k];
    used[i] = whole > 0.0 && a[i][i] > 1e-10 * whole;
    if (!used[i]) continue;
    a[i][i] = std::sqrt(a[i][i]);
    for (std::uint32_t j = i + 1; j < count; ++j) {
      for (std::uint32_t k = 0; k < i; ++k)
        if (used[k]) a[j][i] -= a[j][k] * a[i][k];
      a[j][i] /= a[i][i];
    }
  }
  Vector x{};
  for (std::uint32_t i = 0; i < count; ++i) {
    if (!used[i]) continue;
    x[i] = b[i];
    for (std::uint32_t k = 0; k < i; ++k)
      if (used[k]) x[i] -= a[i][k] * x[k];
    x[i] /= a[i][i];
  }
  for (std::uint32_t i = count; i-- > 0;) {
    if (!used[i]) continue;
    for (std::uint32_t k = i + 1; k < count; ++k)
      if (used[k]) x[i] -= a[k][i] * x[k];
    x[i] /= a[i][i];
  }
  return x;
}

}  // namespace

Weights fit_weights(std::span<const FitSample> samples) {
  constexpr int kRounds = 4;
  const Equations equations(samples);
  const std::uint32_t count = equations.count;
  Vector x{};
  std::vector<double> missed(samples.size());
  for (int round = 0; round < kRounds; ++round) {
    double mean = 0.0;
    for (std::size_t s = 0; s < samples.size(); ++s) {
      missed[s] = std::fabs(samples[s].target - dot(equations.row(s), x, count));
      mean += missed[s];
    }
    mean /= static_cast<double>(samples.size());
    if (!(mean > 0.0 && mean < 1e300)) break;
    Matrix a{};
    Vector b{};
    for (std::size_t s = 0; s < samples.size(); ++s) {
      const double weight = 1.0 / (missed[s] + mean * 0.05);
      const double* row = equations.row(s);
      for (std::uint32_t i = 0; i < count; ++i) {
        const double weighted = weight * row[i];
        b[i] += weighted * samples[s].target;
        for (std::uint32_t j = 0; j <= i; ++j) a[i][j] += weighted * row[j];
      }
    }
    x = solve(a, b, count);
  }
  Weights weights{};
  for (std::uint32_t i = 0; i < count; ++i) {
    constexpr double kMost = kMostWeight;
    const double scaled = std::clamp(x[i] * kWeightParts, -kMost, kMost);
    weights[equations.terms[i]] =
        scaled == scaled ? static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5) : 0;
  }
  return weights;
}

}  // namespace shm
