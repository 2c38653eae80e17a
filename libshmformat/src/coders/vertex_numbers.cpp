#include "coders/vertex_numbers.h"

#include <algorithm>

#include "front/hexahedron.h"

namespace shm {
/// Along which side of the frame the vertex lies from the one that it is copied from.
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
void VertexNumbers<Coder>::know(std::uint32_t slot, std::uint64_t number) {
  if (slot >= numbers_.size())
    numbers_.resize(std::max<std::size_t>(slot + 1, 2 * numbers_.size()));
  last_ = number;
  if (largest_ + 1 <= number) largest_ = number;
  numbers_[slot] = number;
}

template <class Coder>
std::uint64_t VertexNumbers<Coder>::code(Coder& coder, const Stencil& stencil,
                                         std::uint32_t direction, std::uint32_t slot,
                                         std::uint64_t number) {
  const std::uint64_t next = last_ + 1, beyond = largest_ + 1;
  std::uint64_t near = stencil.kind == Stencil::last ? next : spectral(stencil, numbers_);
  if (direction != kNone) near += stride_[direction];
  const std::uint32_t kind = stencil.kind == Stencil::lorenzo         ? 2
                             : stencil.kind == Stencil::parallelogram ? 1
                                                                      : 0;
  auto& model = guess_[kind][history_];
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
  } else if (coder.bit(missed_as_before_[kind][history_ & 3], number == near + miss_[kind])) {
    number = near + miss_[kind];
  } else {
    const auto step = static_cast<std::int64_t>(number - near);
    miss_[kind] = static_cast<std::uint64_t>(code_signed(coder, residual_[kind], step));
    number = near + miss_[kind];
  }
  history_ = (history_ << 2 | guess) & 63;
  if (direction != kNone) {
    const std::uint64_t step = number - numbers_[stencil.at[0]];
    stride_[direction] = step;
    stride_[direction ^ 1] = 0 - step;
  }
  know(slot, number);
  return number;
}

template class VertexNumbers<RangeEncoder>;
template class VertexNumbers<RangeDecoder>;

}  // namespace shm
