#include "codecs/shifts/differences.h"

#include <map>

namespace shm {

std::vector<Tap> taps_of(std::span<const Factor> factors) {
  std::map<std::uint64_t, std::int64_t> product = {{0, 1}};
  for (const Factor& factor : factors)
    for (std::uint32_t i = 0; i < factor.order; ++i) {
      std::map<std::uint64_t, std::int64_t> next = product;
      for (const auto& [power, count] : product) next[power + factor.lag] -= count;
      product = std::move(next);
    }
  std::vector<Tap> taps;
  for (auto it = product.rbegin(); it != product.rend(); ++it)
    if (it->first > 0 && it->second != 0) taps.push_back({it->first, -it->second});
  return taps;
}

}  // namespace shm
