// Functions that compute keys (hashes) of cells from their node numbers. Rotating a cell does not
// change its key.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/cell_rotations.h"
#include "shm/schema.h"

namespace shm::converters {

// The finalizer of splitmix64 (Sebastiano Vigna, public domain).
inline std::uint64_t scrambled(std::uint64_t x) {
  x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
  x = (x ^ x >> 27) * 0x94d049bb133111ebu;
  return x ^ x >> 31;
}

template <class Names>
std::uint64_t hash_of(std::uint64_t seed, const Names& names) {
  std::uint64_t hash = scrambled(seed + 0x9e3779b97f4a7c15u);
  for (const std::uint64_t name : names) hash = scrambled(hash ^ scrambled(name)) + name;
  return hash;
}

// Returns the position at which the lexicographically least rotation of `names` begins (Duval's
// algorithm, linear time).
inline std::size_t least_rotation(std::span<const std::uint64_t> names) {
  const std::size_t n = names.size();
  std::size_t i = 0, k = 1, length = 0;
  while (i < n && k < n && length < n) {
    const std::uint64_t x = names[(i + length) % n], y = names[(k + length) % n];
    if (x == y) {
      ++length;
      continue;
    }
    (x > y ? i : k) += length + 1;
    if (i == k) ++k;
    length = 0;
  }
  return i < k ? i : k;
}

// Replaces `names`, the nodes of a cell, with the nodes of the rotated cell. Chooses the rotation
// with the lexicographically least list of nodes.
inline void make_canonical(CellShape shape, std::vector<std::uint64_t>& names) {
  const std::size_t n = names.size();
  if (n == 0) return;
  std::vector<std::uint64_t> rotated(n);
  if (rotates_by_counting(shape)) {
    const std::size_t by = least_rotation(names);
    for (std::size_t i = 0; i < n; ++i) rotated[i] = names[(i + by) % n];
    names.swap(rotated);
    return;
  }
  const std::vector<Rotation>& rotations = rotations_of(shape, n);
  const Rotation* best = nullptr;
  for (const Rotation& rotation : rotations) {
    if (best == nullptr) {
      best = &rotation;
      continue;
    }
    std::size_t i = 0;
    while (i < n && names[rotation[i]] == names[(*best)[i]]) ++i;
    if (i < n && names[rotation[i]] < names[(*best)[i]]) best = &rotation;
  }
  if (best == nullptr) return;
  for (std::size_t i = 0; i < n; ++i) rotated[i] = names[(*best)[i]];
  names.swap(rotated);
}

}  // namespace shm::converters
