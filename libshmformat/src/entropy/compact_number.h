// CompactNumberModel: a number model for contexts that see few numbers: a sixth of the memory of
// NumberModel, since low bits are told apart by their position alone.
// spec: "Models"
#pragma once

#include <array>

#include "entropy/models.h"

namespace shm {

struct CompactNumberModel {
  AdaptiveBit zero;
  TreeModel<6> length;                               // as in NumberModel
  std::array<std::array<AdaptiveBit, 4>, 64> first;  // as in NumberModel
  std::array<AdaptiveBit, 64> rest;                  // further bits, by the number of bits below
  AdaptiveBit& rest_bit(int, int left) { return rest[static_cast<std::size_t>(left)]; }
};

}  // namespace shm
