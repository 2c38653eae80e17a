#include "codecs/shared/stencil.h"

namespace shm {
namespace {

Stencil corner_stencil(const CellTopology& cell, std::uint32_t position, std::uint64_t known) {
  const std::uint32_t bits = kCornerBits[position];
  const auto corner = [&](std::uint32_t flipped) {
    return std::uint32_t{kCornerBits[bits ^ flipped]};
  };
  const auto has = [&](std::uint32_t flipped) { return (known >> corner(flipped) & 1) != 0; };
  const auto slot = [&](std::uint32_t flipped) { return cell.slots[corner(flipped)]; };
  if (has(1) && has(2) && has(4) && has(3) && has(5) && has(6) && has(7))
    return {Stencil::lorenzo, {slot(1), slot(2), slot(4), slot(3), slot(5), slot(6), slot(7)}};
  for (std::uint32_t diagonal : {3u, 5u, 6u}) {
    const std::uint32_t a = diagonal & (0u - diagonal), b = diagonal ^ a;
    if (has(a) && has(b) && has(diagonal))
      return {Stencil::parallelogram, {slot(a), slot(b), slot(diagonal)}};
  }
  for (std::uint32_t edge : {1u, 2u, 4u})
    if (has(edge)) return {Stencil::copy, {slot(edge)}};
  return {};
}

}  // namespace

std::uint64_t spectral(const Stencil& s, const std::vector<std::uint64_t>& v) {
  const auto number = [&](std::size_t i) { return v[s.at[i]]; };
  switch (s.kind) {
    case Stencil::last: break;
    case Stencil::copy: return number(0);
    case Stencil::parallelogram: return number(0) + number(1) - number(2);
    case Stencil::lorenzo:
      return number(0) + number(1) + number(2) - number(3) - number(4) - number(5) + number(6);
  }
  return 0;
}

Stencil stencil_of(const CellTopology& cell, std::uint32_t position, std::uint64_t known) {
  if (cell.hexahedral && position < 8) return corner_stencil(cell, position, known);
  if (position == 0 || position > 64 || (known >> (position - 1) & 1) == 0) return {};
  return {Stencil::copy, {cell.slots[position - 1]}};
}

}  // namespace shm
