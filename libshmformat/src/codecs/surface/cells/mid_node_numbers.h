// Mid-node numbers: predicts the source's number of a mid node. Each program numbers these nodes by
// a different rule. The class tries several rules and stores a moving mean of the errors of each
// rule.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/cell_topology.h"

namespace shm {

class MidNodeNumbers {
 public:
  /// Numbers predicted by the two best rules; both are equal if all rules agree.
  struct Guess {
    std::uint64_t best = 0, second = 0;
  };
  /// Predicts the number of the new node at `position`. `known`: bit i is set if the vertex at
  /// position i of the cell has a number. `numbers`: vertex numbers by slot. `next`: the last coded
  /// number plus 1.
  Guess expect(const CellTopology& cell, const MidNode& node, std::uint32_t position,
               std::uint64_t known, const std::vector<std::uint64_t>& numbers, std::uint64_t next);
  /// Updates the rules with the actual number of the node that the last expect() predicted.
  void learn(std::uint64_t number);

 private:
  /// Rules in order of preference. Rules with a step add the step with which the rule would have
  /// been right last time.
  enum Rule : std::uint8_t {
    follows,       ///< the last coded number plus 1
    follows_kind,  ///< the last number of the same kind (edge, face or body) plus 1
    /// The number of the node of a parallel edge, plus the difference between the corner numbers of
    /// the two edges
    transport,
    parallel,    ///< the number of the node of a parallel edge, plus a step
    square,      ///< extrapolated from the nodes of three parallel edges
    from_first,  ///< the number of the first end, plus a step
    /// The number of the other end (for faces and bodies: of another node), plus a step
    from_other,
    introduced,  ///< the number of the node introduced last at this position, plus a step
    midpoint,    ///< halfway between the numbers of the ends
    kRules
  };
  struct Place {
    std::array<std::uint64_t, kRules> step{};
    std::array<std::uint32_t, kRules>
        missed{};  ///< moving mean of the error's length in bits, in units of 1/256
    std::uint64_t last = 0;
  };
  void add(Rule rule, std::uint64_t base, std::uint64_t step);

  std::array<Place, kMostLayoutNodes> places_{};
  std::array<std::uint64_t, MidNode::kKinds> last_{};  // last coded number, by kind of node

  // Data of the current node
  std::uint32_t position_ = 0, kind_ = 0,
                applied_ = 0;  // applied_: bit set of the rules that apply to the current node
  std::array<std::uint64_t, kRules> base_{}, expected_{};
};

}  // namespace shm
