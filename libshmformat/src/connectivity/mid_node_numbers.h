// Mid-node numbers: what the source's number of a mid node is likely to be. Programs number these
// nodes by rules of their own, so several rules are kept, and of each how far off it was.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "surface/cell_topology.h"

namespace shm {

class MidNodeNumbers {
 public:
  /// What the two best rules expect; the same twice where there is one alone.
  struct Guess {
    std::uint64_t best = 0, second = 0;
  };
  /// Of the new node at `position`. `known`: bit i set where position i of the cell has a number;
  /// `numbers`: by slot; `next`: one above the number that was coded last.
  Guess expect(const CellTopology& cell, const MidNode& node, std::uint32_t position,
               std::uint64_t known, const std::vector<std::uint64_t>& numbers, std::uint64_t next);
  /// The number of the node of the last expect().
  void learn(std::uint64_t number);

 private:
  /// In order of preference. Some add the step that was right last.
  enum Rule : std::uint8_t {
    follows,       ///< the number coded last
    follows_kind,  ///< the last one of an edge, face or body
    transport,     ///< as far from a corner as the node of a parallel edge
    parallel,      ///< from the node of a parallel edge
    square,        ///< from those of three parallel edges
    from_first,    ///< from the first end
    from_other,    ///< from the other end; of faces and bodies from another node
    introduced,    ///< from the node that was introduced here last
    midpoint,      ///< between the ends
    kRules
  };
  struct Place {
    std::array<std::uint64_t, kRules> step{};
    std::array<std::uint32_t, kRules> missed{};  ///< mean bits, in parts of 256
    std::uint64_t last = 0;
  };
  void add(Rule rule, std::uint64_t base, std::uint64_t step);

  std::array<Place, kMostLayoutNodes> places_{};
  std::array<std::uint64_t, MidNode::kKinds> last_{};  // by kind
  // of the node at hand
  std::uint32_t position_ = 0, kind_ = 0, applied_ = 0;  // applied_: bits of rules
  std::array<std::uint64_t, kRules> base_{}, expected_{};
};

}  // namespace shm
