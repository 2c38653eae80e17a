// Tests of Order::free: every order is a permutation that a reader can reconstruct, cells of a grid
// are ordered in rows and layers, array values and references to elements are reordered with the
// cells, and a shuffled mesh results in a small file.
#include "order/free_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "compare/compare.h"
#include "compare/order_match.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "order/reordered_mesh.h"
#include "order/sample_mesh.h"
#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

std::vector<std::byte> compress(MeshSource& mesh, Order order, SizeReport* sizes = nullptr) {
  Spool spool(::testing::TempDir());
  MemorySink sink;
  CompressOptions options;
  options.order = order;
  const SizeReport report = compress_mesh(mesh, sink, options, spool);
  if (sizes != nullptr) *sizes = report;
  return std::move(sink.bytes);
}

std::string differences(MeshSource& source, const std::vector<std::byte>& bytes) {
  Spool spool(::testing::TempDir());
  MemorySource file(bytes);
  StagedMesh restored(file, "test.shm", spool);
  std::string text;
  for (const std::string& sentence : compare_meshes(source, restored, spool).first)
    text += sentence + "\n";
  return text;
}

bool is_permutation_of(std::uint32_t size, CellSequence order) {
  std::sort(order.begin(), order.end());
  CellSequence all(size);
  std::iota(all.begin(), all.end(), 0u);
  return order == all;
}

TEST(FreeOrder, EveryOrderingIsAPermutationAndTheSameAgain) {
  MemoryMesh rich = rich_mesh(), two = slabs_mesh(), empty;
  shuffle_mesh(two, 4, true);
  for (MemoryMesh* mesh : {&rich, &two, &empty}) {
    const auto cells = CellTable::read(*mesh);
    ASSERT_TRUE(cells);
    CellOrderer orderer(*cells, *mesh), again(*cells, *mesh);
    for (const CellOrdering& ordering : cell_orderings(*cells)) {
      const CellSequence order = orderer(ordering);
      EXPECT_TRUE(is_permutation_of(cells->size(), order)) << static_cast<int>(ordering.kind);
      EXPECT_EQ(order, CellSequence(again(ordering)));
    }
  }
}

TEST(FreeOrder, GraphJoinsNeighboursAndCutsBetweenBlocks) {
  MemoryMesh mesh = slabs_mesh();
  shuffle_mesh(mesh, 2, true);
  const auto cells = CellTable::read(mesh);
  CellGraph graph(*cells);
  int joined = 0;
  for (std::uint32_t cell = 0; cell < cells->size(); ++cell) {
    for (std::uint32_t face = 0; face < 6; ++face)
      if (const CellFace to = graph.across(cell, face)) {
        ++joined;
        EXPECT_EQ(graph.across(to.cell(), to.face()).code, CellFace(cell, face).code);
      }
  }
  EXPECT_EQ(joined, 2 * (5 * 5 * 8 + 6 * 4 * 8 + 6 * 5 * 7));
  graph.cut_between_blocks();
  for (std::uint32_t cell = 0; cell < cells->size(); ++cell)
    for (std::uint32_t face = 0; face < 6; ++face)
      if (const CellFace to = graph.across(cell, face)) {
        EXPECT_EQ(cells->block(cell), cells->block(to.cell()));
      }
}

// At a vertex with very many faces, a different algorithm finds neighbouring cells.
TEST(FreeOrder, GraphOfAFanOfCells) {
  MemoryMesh mesh;
  const std::uint32_t block = mesh.add_block(CellShape::hexahedron, 8);
  constexpr std::uint64_t kCells = 200;  // around the edge 0-1
  for (std::uint64_t v = 0; v < 2 + 4 * kCells; ++v) mesh.add_point(static_cast<double>(v), 0, 0);
  for (std::uint64_t i = 0; i < kCells; ++i) {
    const std::uint64_t a = 2 + 4 * i, b = 2 + 4 * ((i + 1) % kCells);
    mesh.add_cell(block, {0, a, a + 2, b, 1, a + 1, a + 3, b + 1});
  }
  const auto cells = CellTable::read(mesh);
  const CellGraph graph(*cells);
  for (std::uint32_t cell = 0; cell < kCells; ++cell) EXPECT_EQ(graph.degree(cell), 2);
}

// The order of a shuffled grid consists of complete rows, which are ordered in layers.
TEST(FreeOrder, SweepsFollowRowsAndLayers) {
  MemoryMesh mesh = grid_mesh(7, 4, 11);
  shuffle_mesh(mesh, 8, true);
  const auto cells = CellTable::read(mesh);
  const CellGraph graph(*cells);
  const std::size_t layer[3] = {7 * 11, 4 * 11, 7 * 4}, row[3] = {11, 11, 7};
  for (std::size_t along = 0; along < 3; ++along) {
    const CellSequence order = swept_order(graph, along);
    for (std::size_t i = 1; i < order.size(); ++i) {
      bool adjacent = false;
      for (std::uint32_t face = 0; face < 6; ++face)
        if (const CellFace to = graph.across(order[i - 1], face)) adjacent |= to.cell() == order[i];
      EXPECT_EQ(adjacent, i % row[along] != 0) << along << " " << i;
      if (i < layer[along]) continue;
      bool above = false;
      for (std::uint32_t face = 0; face < 6; ++face)
        if (const CellFace to = graph.across(order[i - layer[along]], face))
          above |= to.cell() == order[i];
      EXPECT_TRUE(above) << along << " " << i;
    }
  }
}

TEST(FreeOrder, SampleIsWholeOrBounded) {
  MemoryMesh mesh = rich_mesh();
  const auto cells = CellTable::read(mesh);
  const CellGraph graph(*cells);
  EXPECT_EQ(sample_of_cells(graph, mesh, cells->size()).size(), cells->size());
  const CellSequence some = sample_of_cells(graph, mesh, 40);
  EXPECT_GE(some.size(), 40u);
  EXPECT_LE(some.size(), 80u);
  EXPECT_TRUE(std::is_sorted(some.begin(), some.end()));
  SampleMesh sample(mesh, some);
  EXPECT_EQ(sample.info().cells(), some.size());
  EXPECT_FALSE(compress(sample, Order::stream).empty());
}

TEST(FreeOrder, DataAndReferencesFollow) {
  MemoryMesh rich = rich_mesh();
  shuffle_mesh(rich, 9, true);
  const auto cells = CellTable::read(rich);
  CellOrderer orderer(*cells, rich);
  for (const CellOrdering& ordering : cell_orderings(*cells)) {
    const CellSequence order = orderer(ordering);
    const CellList list(order);
    ReorderedMesh ordered(rich, *cells, list);
    const auto bytes = compress(ordered, Order::stream);
    EXPECT_EQ(differences(ordered, bytes), "");
    // The array "mark" numbers all cells in the order of the source; "level" numbers only the cells
    // of the blocks that it covers.
    std::vector<std::uint8_t> marks(order.size());
    ordered.read_array(3, 0, 0, order.size(), reinterpret_cast<std::byte*>(marks.data()));
    for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(marks[i], order[i] % 251);
    std::int64_t picked[3];
    for (const Extra& extra : ordered.info().extras)
      if (extra.refers == Reference::cell) std::memcpy(picked, extra.data.data(), sizeof picked);
    EXPECT_EQ(order[static_cast<std::size_t>(picked[0])], 8u);
    EXPECT_EQ(order[static_cast<std::size_t>(picked[2])], 100u);
  }
}

TEST(FreeOrder, ShuffledMeshesComeOutSmallAndTheSame) {
  MemoryMesh grid = grid_mesh(20, 17, 13), rich = rich_mesh(), two = slabs_mesh();
  for (MemoryMesh* mesh : {&grid, &rich, &two}) {
    shuffle_mesh(*mesh, 6, true);
    SizeReport stream, free;
    compress(*mesh, Order::stream, &stream);
    const auto bytes = compress(*mesh, Order::free, &free);
    EXPECT_LT(free.total_bytes, stream.total_bytes);
    EXPECT_EQ(differences(*mesh, bytes), "");
    EXPECT_EQ(bytes, compress(*mesh, Order::free));
  }
  SizeReport free;
  compress(grid, Order::free, &free);
  EXPECT_LT(free.streams["connectivity"] * 8, grid.cells.size());
}

TEST(FreeOrder, IsNeverMuchLarger) {
  MemoryMesh rich = rich_mesh(), grid = grid_mesh(20, 10, 10);
  for (MemoryMesh* mesh : {&rich, &grid}) {
    SizeReport stream, free;
    compress(*mesh, Order::stream, &stream);
    compress(*mesh, Order::free, &free);
    EXPECT_LE(free.total_bytes, stream.total_bytes + stream.total_bytes / 100);
  }
}

// In a cube, connectivity is the same along all axes. Only the coordinates show along which axis
// the cells were ordered when the file was written.
TEST(FreeOrder, CubeIsFoundByItsPlaces) {
  MemoryMesh mesh = grid_mesh(8, 8, 8);
  shuffle_mesh(mesh, 12, true);
  const auto cells = CellTable::read(mesh);
  CellOrderer orderer(*cells, mesh);
  for (const CellOrdering& ordering : cell_orderings(*cells)) {
    CellList order = orderer(ordering);
    ReorderedMesh ordered(mesh, *cells, order);
    auto found = matching_order(*cells, mesh, ordered);
    ASSERT_TRUE(found);
    EXPECT_EQ(CellSequence(*std::move(found)), CellSequence(std::move(order)));
  }
}

TEST(FreeOrder, AnotherMeshIsNotTakenForTheSource) {
  MemoryMesh mesh = grid_mesh(9, 8, 7);
  shuffle_mesh(mesh, 3, true);
  const auto bytes = compress(mesh, Order::free);
  MemoryMesh moved = mesh, turned = mesh, other = grid_mesh(9, 8, 7);
  moved.points[100] ^= std::byte{1};
  std::swap(turned.cells[20][0], turned.cells[20][6]);
  shuffle_mesh(other, 4, true);
  EXPECT_EQ(differences(mesh, bytes), "");
  EXPECT_NE(differences(moved, bytes), "");
  EXPECT_NE(differences(turned, bytes), "");
  EXPECT_NE(differences(other, bytes), "");
}

TEST(FreeOrder, MeshWithoutHexahedra) {
  MemoryMesh mesh;
  const std::uint32_t quads = mesh.add_block(CellShape::quad, 4);
  for (int y = 0; y <= 30; ++y)
    for (int x = 0; x <= 30; ++x) mesh.add_point(x, y, x == y ? -0.0 : 0.0);
  for (std::uint64_t y = 0; y < 30; ++y)
    for (std::uint64_t x = 0; x < 30; ++x)
      mesh.add_cell(quads, {31 * y + x, 31 * y + x + 1, 31 * y + x + 32, 31 * y + x + 31});
  shuffle_mesh(mesh, 1, true);
  SizeReport stream, free;
  compress(mesh, Order::stream, &stream);
  const auto bytes = compress(mesh, Order::free, &free);
  EXPECT_LT(free.total_bytes, stream.total_bytes);
  EXPECT_EQ(differences(mesh, bytes), "");
}

}  // namespace
}  // namespace shm::converters
