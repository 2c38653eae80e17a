#include "accuracy/value_sample.h"

#include <algorithm>
#include <cstdio>

namespace shm::converters {

bool ValueSample::has_outliers(double range) const {
  constexpr double kFar = 1e6;
  if (sample_.empty()) return false;
  std::vector<double> sorted = sample_;
  std::sort(sorted.begin(), sorted.end());
  const double low = sorted[sorted.size() / 20], high = sorted[sorted.size() * 19 / 20];
  return high > low && range > kFar * (high - low);
}

void ValueSample::keep(double value) {
  sample_.push_back(value);
  if (sample_.size() < kMost) return;
  for (std::size_t i = 0; 2 * i < sample_.size(); ++i) sample_[i] = sample_[2 * i];
  sample_.resize(sample_.size() / 2);
  distance_ *= 2;
}

void warn_of_outliers(const std::string& name) {
  std::fputs(("shm: warning: the range of '" + name +
              "' is more than a million times that of most of its values. If it contains fill "
              "values, give them with --fill or --array NAME:fill=VALUE\n")
                 .c_str(),
             stderr);
}

}  // namespace shm::converters
