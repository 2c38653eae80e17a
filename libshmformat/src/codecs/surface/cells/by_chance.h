// sort_by_chance: sorts the candidates of a coder. The most likely candidate comes first.
#pragma once

#include <cstddef>
#include <vector>

namespace shm {

/// Sorts candidates by `chance`; the largest comes first. Candidates with equal chance keep their
/// order. This is an insertion sort, which is fast for a few candidates.
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
