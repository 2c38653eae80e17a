// Tests that the library and the converters agree about the places of nodes in Lagrange cells. Each
// has its own description, because converters use only public headers of the library.
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "boundary/cell_sides.h"
#include "mesh/node_layout.h"
#include "mesh/node_orders.h"

namespace shm::converters {
namespace {

TEST(NodePlaces, OfGridsAreThoseOfVtk) {
  for (std::uint32_t order = kLeastGridOrder; order <= kMostGridOrder; ++order) {
    const NodePositions expected = vtk_positions(CellShape::hexahedron, order);
    const NodeLayout* const layout =
        node_layout(CellShape::hexahedron, static_cast<std::uint32_t>(expected.size()));
    ASSERT_NE(layout, nullptr);
    EXPECT_EQ(layout->grid.places, expected) << order;
  }
}

// All facets of a flat cell have the same area: a unit square, or half of one.
TEST(NodePlaces, OfFacetsAreThoseOfVtk) {
  for (const CellShape shape : {CellShape::quad, CellShape::triangle})
    for (std::uint32_t order = 3; order <= 10; ++order) {
      const NodePositions at = vtk_positions(shape, order);
      const auto facets = facets_of(shape, static_cast<std::uint32_t>(at.size()));
      ASSERT_EQ(facets.size(), std::size_t{order} * order);
      for (const Facet& facet : facets) {
        int twice_area = 0;
        for (std::size_t i = 0; i < facet.size; ++i) {
          const NodePosition &a = at[facet.at[i]], &b = at[facet.at[(i + 1) % facet.size]];
          twice_area += a[0] * b[1] - a[1] * b[0];
          EXPECT_LE(std::abs(a[0] - b[0]), 1) << order;
          EXPECT_LE(std::abs(a[1] - b[1]), 1) << order;
        }
        EXPECT_EQ(twice_area, shape == CellShape::quad ? 2 : 1) << order;
      }
    }
}

}  // namespace
}  // namespace shm::converters
