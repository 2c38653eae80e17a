#include "codecs/surface/cells/mid_node_numbers.h"

#include <bit>

#include "base/lists.h"

namespace shm {

void MidNodeNumbers::add(Rule rule, std::uint64_t base, std::uint64_t step) {
  base_[rule] = base;
  expected_[rule] = base + step;
  applied_ |= 1u << rule;
}

auto MidNodeNumbers::expect(const CellTopology& cell, const MidNode& node, std::uint32_t position,
                            std::uint64_t known, bool follows_known,
                            const std::vector<std::uint64_t>& numbers, std::uint64_t next)
    -> Guess {
  position_ = position;
  kind_ = node.kind;
  applied_ = 0;
  const Place& place = at_slot(places_, position);
  const auto number = [&](std::uint32_t stored) {
    return numbers[cell.slots[stored < cell.layout->corners ? cell.framed[stored] : stored]];
  };
  const bool is_edge = node.kind == MidNode::edge;
  const std::uint64_t first = number(node.corner[0]);
  const std::uint64_t other = number(node.continues && follows_known ? position - 1
                                     : is_edge || !node.has_middle   ? node.corner[1]
                                                                     : node.middle[0]);
  std::uint32_t found = 0, nearest = 0;
  for (std::uint32_t i = node.parallels; i-- > 0;) {
    if ((known >> node.parallel[i] & 1) == 0) continue;
    ++found;
    nearest = i;
  }
  add(follows, next, 0);
  add(follows_kind, last_[node.kind], 1);
  if (found > 0) {
    const std::uint64_t there = number(node.parallel[nearest]);
    add(transport, there, first - number(node.beside[nearest]));
    add(parallel, there, place.step[parallel]);
  }
  if (found == 3)
    add(square, number(node.parallel[0]), number(node.parallel[1]) - number(node.parallel[2]));
  add(from_first, first, place.step[from_first]);
  add(from_other, other, place.step[from_other]);
  add(introduced, place.last, place.step[introduced]);
  if (is_edge)
    add(midpoint, first, static_cast<std::uint64_t>(static_cast<std::int64_t>(other - first) / 2));

  const auto best_but = [&](std::uint32_t mask) {
    std::uint32_t best = kRules;
    for (std::uint32_t r = 0; r < kRules; ++r)
      if ((mask >> r & 1) != 0 && (best == kRules || place.missed[r] < place.missed[best]))
        best = r;
    return best;
  };
  const std::uint32_t best = best_but(applied_);
  std::uint32_t others = applied_;
  for (std::uint32_t r = 0; r < kRules; ++r)
    if (expected_[r] == expected_[best]) others &= ~(1u << r);
  const std::uint32_t second = others == 0 ? best : best_but(others);
  return {expected_[best], expected_[second]};
}

void MidNodeNumbers::learn(std::uint64_t number) {
  Place& place = places_[position_];
  for (std::uint32_t r = 0; r < kRules; ++r) {
    if ((applied_ >> r & 1) == 0) continue;
    const std::uint64_t miss = number - expected_[r];
    const auto bits = static_cast<std::uint32_t>(
        std::bit_width(static_cast<std::int64_t>(miss) < 0 ? 0 - miss : miss));
    place.missed[r] = place.missed[r] - place.missed[r] / 8 + 32 * bits;
    place.step[r] = number - base_[r];
  }
  place.last = last_[kind_] = number;
}

}  // namespace shm
