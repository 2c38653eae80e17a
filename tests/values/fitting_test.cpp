// Tests of fitting, which computes the weights of a predictor by robust least squares. If enough
// samples were generated with certain weights, fitting must find these weights, even if the other
// samples are outliers.
#include "codecs/surface/plan/fitting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace shm {
namespace {

Weights some_weights() {
  Weights weights{};
  for (std::uint32_t i = 0; i < kWeights; ++i)
    weights[i] =
        static_cast<std::int32_t>(i % 3 == 0 ? 0 : kWeightParts / (i + 1)) * (i % 2 == 0 ? 1 : -1);
  return weights;
}

double noise(std::mt19937_64& random) {
  return static_cast<double>(random() % 2000001) / 1e6 - 1.0;
}

std::vector<FitSample> samples_of(const Weights& weights, std::size_t count, std::uint32_t used) {
  std::mt19937_64 random(3);
  std::vector<FitSample> samples(count);
  for (FitSample& sample : samples)
    for (std::uint32_t i = 0; i < used; ++i) {
      sample.terms[i] = noise(random);
      sample.target += static_cast<double>(weights[i]) / kWeightParts * sample.terms[i];
    }
  return samples;
}

TEST(Fitting, FindsTheWeights) {
  const Weights weights = some_weights();
  const auto samples = samples_of(weights, 200, kWeights);
  const Weights found = fit_weights(samples);
  for (std::uint32_t i = 0; i < kWeights; ++i) EXPECT_NEAR(found[i], weights[i], 1) << i;
}

TEST(Fitting, OutliersDoNotSpoilThem) {
  const Weights weights = some_weights();
  auto samples = samples_of(weights, 400, kWeights);
  std::mt19937_64 random(4);
  for (std::size_t i = 0; i < samples.size(); i += 20) samples[i].target += 100.0 * noise(random);
  const Weights found = fit_weights(samples);
  for (std::uint32_t i = 0; i < kWeights; ++i)
    EXPECT_NEAR(found[i], weights[i], 0.01 * kWeightParts) << i;
}

TEST(Fitting, TermsThatAreNotThereHaveNoWeight) {
  const Weights weights = some_weights();
  const Weights found = fit_weights(samples_of(weights, 100, 5));
  for (std::uint32_t i = 0; i < kWeights; ++i) EXPECT_NEAR(found[i], i < 5 ? weights[i] : 0, 1);
}

/// The targets are rounded combinations of terms with weights such as 1/3 and 1/9. Such values
/// occur in meshes from other programs, in which a node at the centre of a face or cell is the sum
/// of corners divided by three, four or nine.
TEST(Fitting, FractionsOfTemplatesAreExactDespiteRounding) {
  std::mt19937_64 random(5);
  std::vector<FitSample> samples(100);
  for (FitSample& sample : samples) {
    for (double& term : sample.terms) term = static_cast<float>(noise(random));
    sample.target =
        static_cast<float>(sample.terms[3] / 3.0 - sample.terms[6] / 9.0 + 0.75 * sample.terms[9]);
  }
  Weights expected{};
  expected[3] = static_cast<std::int32_t>(kWeightParts) / 3;
  expected[6] = -static_cast<std::int32_t>(kWeightParts) / 9;
  expected[9] = static_cast<std::int32_t>(kWeightParts) * 3 / 4;
  EXPECT_EQ(fit_weights(samples), expected);
}

void expect_in_range(const Weights& weights) {
  for (std::int32_t it : weights) EXPECT_LE(std::abs(it), kMostWeight);
}

// If two terms always have equal values, their separate weights are not determined, only the sum of
// the weights.
TEST(Fitting, EqualTerms) {
  std::mt19937_64 random(5);
  std::vector<FitSample> samples(100);
  for (FitSample& sample : samples) {
    sample.terms.fill(noise(random));
    sample.target = 0.75 * sample.terms[0];
  }
  const Weights found = fit_weights(samples);
  expect_in_range(found);
  std::int32_t sum = 0;
  for (std::int32_t it : found) sum += it;
  EXPECT_NEAR(sum, 0.75 * kWeightParts, kWeights);
}

TEST(Fitting, WhatCannotBeFitted) {
  EXPECT_EQ(fit_weights({}), Weights{});
  EXPECT_EQ(fit_weights(std::vector<FitSample>(50)), Weights{});  // no equations
  std::vector<FitSample> samples = samples_of(some_weights(), 50, kWeights);
  for (FitSample& sample : samples) sample.terms.fill(0.0);
  EXPECT_EQ(fit_weights(samples), Weights{});  // equations without usable terms
  for (double large : {1e-320, 1e-160, 1e160, 1e300, std::numeric_limits<double>::max(),
                       std::numeric_limits<double>::infinity()}) {
    samples = samples_of(some_weights(), 50, kWeights);
    for (FitSample& sample : samples) {
      for (double& term : sample.terms) term *= large;
      sample.target *= large;
    }
    expect_in_range(fit_weights(samples));
    samples = samples_of(some_weights(), 50, kWeights);
    for (FitSample& sample : samples) sample.target *= large;
    expect_in_range(fit_weights(samples));
    samples = samples_of(some_weights(), 50, kWeights);
    for (FitSample& sample : samples) sample.terms[3] *= large;
    expect_in_range(fit_weights(samples));
  }
  samples = samples_of(some_weights(), 50, kWeights);
  samples[7].terms[3] = std::numeric_limits<double>::quiet_NaN();
  expect_in_range(fit_weights(samples));
}

}  // namespace
}  // namespace shm
