// A function that sorts the candidates of a coder, the most likely candidate first.
#pragma once

#include <cstddef>
#include <vector>

namespace shm {

/// Sorts candidates by `chance`, largest first. Equal candidates keep their order. There are few
/// candidates, so insertion sort is fast.
template <class Candidate>
void sort_by_chance(std::vector<Candidate>& candidates) {
  for (std::size_t i = 1; i < candidates.size(); ++i) {
    const Candidate moved = candidates[i];
    std::size_t to = i;
    for (; to > 0 && candidates[to - 1].chance < moved.chance; --to)
      candidates[to] = candidates[to - 1];
    candidates[to] = moved;
  }
}

}  // namespace shm
