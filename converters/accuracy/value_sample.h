// A sample of the values of an array, to recognize ranges that a few values enlarge.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace shm::converters {

// Keeps every n-th of the values that are added: at most kMost values.
class ValueSample {
 public:
  void add(double value) {
    if (number_++ % distance_ == 0) keep(value);
  }
  // Returns true if `range`, the range of all values, is so much larger than the range of the
  // middle 90 percent of the values that a few values probably mark missing data.
  bool has_outliers(double range) const;

 private:
  static constexpr std::size_t kMost = 1 << 13;

  // If the sample becomes too large, drops every other value and doubles the distance.
  void keep(double value);

  std::vector<double> sample_;
  std::uint64_t number_ = 0, distance_ = 1;
};

// Prints a warning that the range of `name` seems to contain fill values. `name` is the name of the
// array, with its block if the range is that of a block.
void warn_of_outliers(const std::string& name);

}  // namespace shm::converters
