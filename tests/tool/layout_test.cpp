// Tests of layout diagrams. The computed width of the mesh, i.e. the largest number of vertices
// that are active at the same time, must be exact. The picture must be small and well-formed.
#include "tool/layout.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

Layout measure(MemoryMesh& mesh) {
  Spool spool(::testing::TempDir());
  return measure_layout(mesh, spool);
}

TEST(Layout, HasAVerdict) {
  Layout layout;
  EXPECT_EQ(layout_verdict(layout, {}), "there are no cells");
  layout.vertices = 1'000'000;
  layout.cells = 970'299;
  layout.width = 20'000;
  EXPECT_NE(layout_verdict(layout, {}).find("close together"), std::string::npos);
  layout.width = 500'000;
  EXPECT_NE(layout_verdict(layout, .304).find("would save about 30 %"), std::string::npos);
  EXPECT_NE(layout_verdict(layout, .01).find("less than 5 %"), std::string::npos);
  EXPECT_NE(layout_verdict(layout, {}).find("may make"), std::string::npos);
}

TEST(Layout, WidthOfARowOfCells) {
  MemoryMesh mesh = grid_mesh(20, 1, 1);
  const Layout layout = measure(mesh);
  EXPECT_EQ(layout.width, 8u);  // only the corners of the current cell are live
  EXPECT_EQ(layout.width_at_cell, 0u);
  EXPECT_EQ(layout.vertices, 84u);
  EXPECT_EQ(layout.cells, 20u);
}

TEST(Layout, WidthDoesNotDependOnVertexNumbers) {
  MemoryMesh mesh = grid_mesh(9, 9, 9);
  const std::uint64_t width = measure(mesh).width;
  shuffle_mesh(mesh, 3);
  EXPECT_EQ(measure(mesh).width, width);
}

TEST(Layout, CompactionGathersTheDiagonal) {
  MemoryMesh mesh = grid_mesh(12, 12, 12);
  shuffle_mesh(mesh, 3);
  const Layout layout = measure(mesh);
  const auto filled = [](const LayoutRaster& raster) {
    return std::count_if(raster.level.begin(), raster.level.end(),
                         [](std::uint8_t level) { return level > 0; });
  };
  EXPECT_LT(filled(layout.compacted) * 2, filled(layout.stored));
}

TEST(Layout, PictureHasNumbersAndStaysSmall) {
  MemoryMesh mesh = grid_mesh(40, 40, 20);
  const std::string svg = layout_svg(measure(mesh), "a <b> & c");
  EXPECT_EQ(svg.rfind("<svg ", 0), 0u);
  EXPECT_NE(svg.find("a &lt;b&gt; &amp; c"), std::string::npos);
  EXPECT_NE(svg.find("After vertex compaction"), std::string::npos);
  EXPECT_LT(svg.size(), 400'000u);
  MemoryMesh worst = grid_mesh(30, 30, 30);
  shuffle_mesh(worst, 1, true);
  EXPECT_LT(layout_svg(measure(worst), "shuffled").size(), 1'500'000u);
}

TEST(Layout, EmptyMesh) {
  MemoryMesh mesh;
  EXPECT_EQ(measure(mesh).width, 0u);
  EXPECT_FALSE(layout_svg(measure(mesh), "").empty());
}

}  // namespace
}  // namespace shm::converters
