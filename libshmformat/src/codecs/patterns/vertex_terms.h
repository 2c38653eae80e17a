// Vertex terms: for each new vertex, the vertices from which it is predicted (its terms). The terms
// belong to the cell that introduces the new vertex. The new vertex and its terms form a
// hexahedron, a quadrilateral or an edge.
// spec: "Values by terms"
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "codecs/patterns/pattern_cells.h"
#include "mesh/node_layout.h"
#include "shm/schema.h"

namespace shm {

/// Largest number of terms of a vertex. Frozen: part of the format.
inline constexpr std::uint32_t kMostTerms = 7;

/// A new vertex, and the slots of the vertices that predict it (its terms). The number of terms
/// determines how the prediction is computed:
///   7   corners of a hexahedron: the three neighbours, minus the three vertices that are
///   diagonally
///       opposite in a face, plus the opposite vertex of the hexahedron
///   3   corners of a quadrilateral: both neighbours, minus the opposite corner
///   2   the middle between two vertices
///   1   a copy of the vertex
///   0   a copy of the previous element
struct VertexTerms {
  std::uint32_t slot = 0;
  std::uint32_t count = 0;
  std::array<std::uint32_t, kMostTerms> slots{};  ///< entries from `count` on are unused
};

class TermFinder {
 public:
  explicit TermFinder(const Schema& schema);

  /// Appends the terms of each vertex that the cell introduces, in the order of the nodes.
  void add_cell(const PatternCell& cell, std::vector<VertexTerms>& terms);

 private:
  struct Recipe {
    std::uint8_t node = 0, count = 0;
    std::array<std::uint8_t, kMostTerms> nodes{};
  };
  struct Block {
    CellShape shape = CellShape::other;
    std::uint32_t nodes = 0, corners = 0;
    NodeScheme scheme = NodeScheme::lagrange;
    LayoutOfBlock layout;
    // Recipes of the new nodes, by PatternCell::introduced
    std::unordered_map<std::uint64_t, std::vector<Recipe>> recipes;
    // Recipes (which nodes predict each new node) for cells that introduce only nodes with
    // positions 0 to 7, indexed by the bit mask of these nodes. This table avoids a search in
    // `recipes`
    std::array<const std::vector<Recipe>*, 256> of_first_eight{};
  };
  static Recipe recipe_of(Block& block, std::uint32_t node, std::uint64_t known);
  static std::vector<Recipe> recipes_of(Block& block, const PatternCell& cell);
  const std::vector<Recipe>& known_recipes_of(Block& block, const PatternCell& cell);

  std::vector<Block> blocks_;
  std::vector<Recipe> recipes_;  // which nodes predict each new node of the current cell; used if a
                                 // vertex occurs at several nodes of the cell
};

}  // namespace shm
