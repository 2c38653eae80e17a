// Mid-node numbers: predicts the number of a mid node in the source mesh. Programs number mid nodes
// by different rules. The class tries several rules, and for each rule keeps a moving mean of its
// errors.
// spec: "Mid nodes"
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "mesh/cell_topology.h"

namespace shm {

class MidNodeNumbers {
 public:
  /// Numbers predicted by the two best rules. If all rules agree, both numbers are equal.
  struct Guess {
    std::uint64_t best = 0, second = 0;
  };
  /// Predicts the number of the new node at `position`. `known`: bit i is set if the number of the
  /// vertex at position i of the cell is known. `follows_known`: true if the number of the vertex
  /// at position - 1 is known. `numbers`: vertex numbers by slot. `next`: the most recently coded
  /// number plus 1.
  Guess expect(const CellTopology& cell, const MidNode& node, std::uint32_t position,
               std::uint64_t known, bool follows_known, const std::vector<std::uint64_t>& numbers,
               std::uint64_t next);
  /// Updates the mean error of each rule. `number`: the actual number of the node for which
  /// expect() was called most recently.
  void learn(std::uint64_t number);

 private:
  /// Rules that predict the number of a mid node, in order of preference. Some rules add a step:
  /// the number that would have made the previous prediction of the same rule exact.
  enum Rule : std::uint8_t {
    follows,       ///< the most recently coded number plus 1
    follows_kind,  ///< the most recent number of a node of the same kind (edge, face or body), plus
                   ///< 1
    /// The number of the mid node of a parallel edge, plus the difference between the numbers of
    /// the corresponding corners of the two edges
    transport,
    parallel,    ///< the number of the mid node of a parallel edge, plus a step
    square,      ///< extrapolation from the mid nodes of three parallel edges
    from_first,  ///< the vertex number at the first end of the edge, plus a step
    /// For an edge node: the vertex number at the second end of the edge, plus a step. For a face
    /// node or body node: the number of the second known node around it, plus a step. For a node of
    /// a grid that continues an edge, a face or a body: the number of the node before it, plus a
    /// step
    from_other,
    introduced,  ///< the number of the most recent new node at this position, plus a step
    midpoint,    ///< halfway between the numbers of the ends
    kRules
  };
  struct Place {
    std::array<std::uint64_t, kRules> step{};
    std::array<std::uint32_t, kRules> missed{};  ///< for each rule: moving mean of the bit length
                                                 ///< of its prediction error, in units of 1/256
    std::uint64_t last = 0;
  };
  void add(Rule rule, std::uint64_t base, std::uint64_t step);

  std::vector<Place> places_;
  std::array<std::uint64_t, MidNode::kKinds>
      last_{};  // most recently coded number, by kind of node

  // Data of the current node
  std::uint32_t position_ = 0, kind_ = 0,
                applied_ = 0;  // applied_: bit set of the rules that apply to the current node
  std::array<std::uint64_t, kRules> base_{}, expected_{};
};

}  // namespace shm
