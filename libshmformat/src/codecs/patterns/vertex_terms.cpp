#include "codecs/patterns/vertex_terms.h"

#include <algorithm>
#include <bit>
#include <optional>

#include "mesh/cell_shapes.h"
#include "mesh/node_layout.h"

namespace shm {
namespace {

/// Maps each corner of a hexahedron to the bit mask x + 2y + 4z of its position on the three axes
/// (each 0 or 1). The map is its own inverse.
constexpr std::array<std::uint8_t, 8> kPlaceOfCorner = {0, 1, 3, 2, 4, 5, 7, 6};
constexpr std::array<std::uint8_t, 8> kCornerAtPlace = kPlaceOfCorner;

bool has_bit(std::uint64_t mask, std::uint32_t i) { return (mask >> i & 1) != 0; }

/// Takes the terms of a node of a grid. Along an axis on which the node is not at an end, its
/// neighbour is one step back; along any other axis, the neighbour is at the other end. Returns
/// false if too few neighbours exist and are known.
template <class Take>
bool take_along_grid(const NodeGrid& grid, std::uint32_t node, const Take& take) {
  const NodeGrid::Place here = grid.places[node];
  const auto is_end = [&](std::uint32_t axis) { return here[axis] % grid.order == 0; };
  std::array<std::uint32_t, 3> axes{};  // axes on which the node is not at an end first
  std::uint32_t count = 0;
  for (const bool ends : {false, true})
    for (std::uint32_t axis = 0; axis < 3; ++axis)
      if (is_end(axis) == ends) axes[count++] = axis;
  // In place of a node that does not exist: this node, which is not known.
  const auto existing = [&](const NodeGrid::Place& place) {
    const std::uint32_t found = grid.position(place);
    return found == NodeGrid::kNowhere ? node : found;
  };
  // Nodes that differ from this one along the axes whose bits are set. Bit i belongs to axes[i].
  std::array<std::uint32_t, 8> at{};
  for (std::uint32_t moved = 1; moved < 8; ++moved) {
    NodeGrid::Place place = here;
    for (std::uint32_t i = 0; i < 3; ++i)
      if ((moved >> i & 1) != 0)
        place[axes[i]] = static_cast<std::uint8_t>(is_end(axes[i]) ? grid.order - here[axes[i]]
                                                                   : here[axes[i]] - 1);
    at[moved] = existing(place);
  }
  if (take({at[1], at[2], at[4], at[3], at[5], at[6], at[7]}) || take({at[1], at[2], at[3]}) ||
      take({at[1], at[4], at[5]}) || take({at[2], at[4], at[6]}))
    return true;
  NodeGrid::Place before = here;  // two steps back; if that is less than 0, it is nowhere
  before[axes[0]] = static_cast<std::uint8_t>(before[axes[0]] - 2);
  return take({at[1], at[1], existing(before)});
}

}  // namespace

TermFinder::TermFinder(const Schema& schema) {
  for (const BlockInfo& block : schema.blocks) {
    blocks_.emplace_back();
    blocks_.back().shape = block.shape;
    blocks_.back().nodes = block.nodes_per_cell;
    blocks_.back().scheme = block.scheme;
    blocks_.back().corners = corner_count(block.shape, block.nodes_per_cell);
  }
}

/// Returns the recipe that predicts a node from other nodes. `known`: bit mask of the nodes whose
/// vertices are already known.
auto TermFinder::recipe_of(Block& block, std::uint32_t node, std::uint64_t known) -> Recipe {
  Recipe recipe;
  recipe.node = static_cast<std::uint8_t>(node);
  const auto take = [&](std::initializer_list<std::uint32_t> nodes) {
    if (!std::all_of(nodes.begin(), nodes.end(), [&](auto other) { return has_bit(known, other); }))
      return false;
    for (std::uint32_t other : nodes)
      recipe.nodes[recipe.count++] = static_cast<std::uint8_t>(other);
    return true;
  };
  if (block.shape == CellShape::hexahedron && node < 8 && block.corners == 8) {
    const auto across = [&](std::uint32_t axes) -> std::uint32_t {
      return kCornerAtPlace[kPlaceOfCorner[node] ^ axes];
    };
    if (take({across(1), across(2), across(4), across(3), across(5), across(6), across(7)}) ||
        take({across(1), across(2), across(3)}) || take({across(1), across(4), across(5)}) ||
        take({across(2), across(4), across(6)}) || take({across(4)}) || take({across(2)}) ||
        take({across(1)}))
      return recipe;
  } else if (node < block.corners) {
    const auto faces = faces_of(flat_shape(block.shape, block.corners), block.corners);
    for (const std::uint32_t wanted : {4u, 0u})  // look for quadrilaterals first
      for (const ShapeFace& face : faces) {
        for (std::uint32_t i = 0; i < face.size; ++i) {
          if (face.at[i] != node || (wanted != 0 && face.size != wanted)) continue;
          const std::uint32_t after = face.at[(i + 1) % face.size],
                              before = face.at[(i + face.size - 1) % face.size];
          if (wanted != 0 ? take({after, before, face.at[(i + 2) % 4]})
                          : take({before}) || take({after}))
            return recipe;
        }
      }
  } else if (const NodeLayout* const layout =
                 block.layout.get({0, {}, block.shape, block.nodes, block.scheme})) {
    if (layout->is_grid() && take_along_grid(layout->grid, node, take)) return recipe;
    if (const MidNode* const mid = layout->at(node))
      if (take({mid->corner[0], mid->corner[mid->kind == MidNode::edge ? 1 : 2]})) return recipe;
  }
  if (node > 0) take({node - 1});
  return recipe;
}

auto TermFinder::recipes_of(Block& block, const PatternCell& cell) -> std::vector<Recipe> {
  std::vector<Recipe> recipes;
  const std::uint64_t all =
      block.nodes == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << block.nodes) - 1;
  for (std::uint64_t left = cell.introduced; left != 0; left &= left - 1) {
    const auto node = static_cast<std::uint32_t>(std::countr_zero(left));
    const std::uint64_t below = (std::uint64_t{1} << node) - 1;
    recipes.push_back(recipe_of(block, node, all & (~(cell.introduced | cell.again) | below)));
  }
  return recipes;
}

/// Returns the recipes of a cell. A recipe states which nodes predict a new node. If no vertex
/// occurs twice in the cell, the recipes depend only on which nodes the cell introduces.
auto TermFinder::known_recipes_of(Block& block, const PatternCell& cell)
    -> const std::vector<Recipe>& {
  if (cell.again != 0) return recipes_ = recipes_of(block, cell);
  const bool is_first = cell.introduced < block.of_first_eight.size();
  if (is_first)
    if (const auto* const known = block.of_first_eight[static_cast<std::size_t>(cell.introduced)])
      return *known;
  const auto [it, is_new] = block.recipes.try_emplace(cell.introduced);
  if (is_new) it->second = recipes_of(block, cell);
  if (is_first) block.of_first_eight[static_cast<std::size_t>(cell.introduced)] = &it->second;
  return it->second;
}

void TermFinder::add_cell(const PatternCell& cell, std::vector<VertexTerms>& terms) {
  if (cell.introduced == 0) return;
  for (const Recipe& recipe : known_recipes_of(blocks_[cell.block], cell)) {
    VertexTerms& vertex = terms.emplace_back();
    vertex.slot = cell.slots[recipe.node];
    vertex.count = recipe.count;
    // Copying all kMostTerms slots is faster than copying only `count` slots.
    for (std::uint32_t t = 0; t < kMostTerms; ++t) vertex.slots[t] = cell.slots[recipe.nodes[t]];
  }
}

}  // namespace shm
