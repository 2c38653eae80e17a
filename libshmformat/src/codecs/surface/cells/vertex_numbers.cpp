#include "codecs/surface/cells/vertex_numbers.h"

#include <algorithm>

#include "base/lists.h"
#include "mesh/hexahedron.h"

namespace shm {
/// If the only prediction for a new vertex of a hexahedron is to copy the value of one neighbour
/// (Stencil::copy), returns the direction from this neighbour to the new vertex: 2 * axis, plus 1
/// in positive direction. Otherwise returns kNone.
template <class Coder>
std::uint32_t VertexNumbers<Coder>::direction_of(const CellTopology& cell, std::uint32_t position,
                                                 const Stencil& stencil) {
  if (stencil.kind != Stencil::copy || !cell.hexahedral || position >= 8) return kNone;
  const std::uint32_t here = kCornerBits[position];
  for (std::uint32_t axis = 0; axis < 3; ++axis)
    if (cell.slots[kCornerBits[here ^ (1u << axis)]] == stencil.at[0])
      return 2 * axis + (here >> axis & 1);
  return kNone;
}

template <class Coder>
void VertexNumbers<Coder>::add(std::uint32_t slot, std::uint64_t number) {
  last_ = number;
  if (largest_ + 1 <= number) largest_ = number;
  at_slot(numbers_, slot) = number;
}

template <class Coder>
auto VertexNumbers<Coder>::expect(const CellTopology& cell, std::uint32_t position,
                                  const Stencil& stencil, std::uint64_t known) -> Expectation {
  Expectation expected;
  if (const MidNode* node = cell.layout == nullptr ? nullptr : cell.layout->at(position)) {
    const bool follows_known = node->continues && is_coming_[cell.slots[position - 1]] == 0;
    const MidNodeNumbers::Guess guess =
        mid_node_numbers_.expect(cell, *node, position, known, follows_known, numbers_, last_ + 1);
    return {guess.best, guess.second, 3u + node->kind};
  }
  if (stencil.kind == Stencil::last) {
    expected.near = last_ + 1;
  } else {
    expected.near = spectral(stencil, numbers_);
    expected.kind = stencil.kind == Stencil::lorenzo         ? 2
                    : stencil.kind == Stencil::parallelogram ? 1
                                                             : 0;
    expected.direction = direction_of(cell, position, stencil);
    expected.from = stencil.at[0];
    if (expected.direction != kNone) expected.near += stride_[expected.direction];
  }
  expected.second = expected.near;
  return expected;
}

template <class Coder>
std::uint64_t VertexNumbers<Coder>::code(Coder& coder, const Expectation& expected,
                                         std::uint32_t slot, std::uint64_t number) {
  const std::uint64_t next = last_ + 1, beyond = largest_ + 1;
  const auto [near, second, kind, direction, from] = expected;
  const bool is_mid_node = kind >= 3;
  std::uint32_t& history = history_[is_mid_node ? 1 : 0];
  auto& model = guess_[kind][history];
  std::uint32_t guess = 3;
  if (coder.bit(model[0], number == near)) {
    number = near;
    guess = 0;
  } else if (next != near && coder.bit(model[1], number == next)) {
    number = next;
    guess = 1;
  } else if (beyond != near && beyond != next && coder.bit(model[2], number == beyond)) {
    number = beyond;
    guess = 2;
  } else if (second != near && second != next && second != beyond &&
             coder.bit(model[3], number == second)) {
    number = second;
    guess = 4;
  } else if (coder.bit(missed_as_before_[kind][history & 3], number == near + miss_[kind])) {
    number = near + miss_[kind];
  } else {
    const auto step = static_cast<std::int64_t>(number - near);
    miss_[kind] = static_cast<std::uint64_t>(code_signed(coder, residual_[kind], step));
    number = near + miss_[kind];
  }
  history = (history << (is_mid_node ? 3 : 2) | guess) & 63;
  if (is_mid_node) mid_node_numbers_.learn(number);
  if (direction != kNone) {
    const std::uint64_t step = number - numbers_[from];
    stride_[direction] = step;
    stride_[direction ^ 1] = 0 - step;
  }
  add(slot, number);
  return number;
}

template class VertexNumbers<RangeEncoder>;
template class VertexNumbers<RangeDecoder>;

}  // namespace shm
