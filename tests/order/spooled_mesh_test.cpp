// Tests of Order::free for meshes that do not fit into memory. The spooled mesh must have the same
// contents as the source, and the resulting file must not depend on the amount of memory.
#include "order/spooled_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <set>

#include "base/failure.h"
#include "compare/compare.h"
#include "compression/compress.h"
#include "compression/decompress.h"
#include "mesh/cell_rotations.h"
#include "order/free_order.h"
#include "support/memory_mesh.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

constexpr std::size_t kLittle = 4096;  // bytes: nothing fits

std::vector<std::byte> in_free_order(MeshSource& mesh, std::size_t memory,
                                     CodingOrder* coding_order = nullptr) {
  TemporaryFolder folder;
  Spool spool(folder / ".", memory);
  MemorySink sink;
  CompressOptions options;
  options.order = Order::free;
  options.coding_order = coding_order;
  compress_mesh(mesh, sink, options, spool);
  return std::move(sink.bytes);
}

std::string differences(MeshSource& source, const std::vector<std::byte>& bytes,
                        std::size_t memory) {
  TemporaryFolder folder;
  Spool spool(folder / ".", memory);
  MemorySource file(bytes);
  StagedMesh restored(file, "test.shm", spool);
  std::string text;
  for (const std::string& sentence : compare_meshes(source, restored, spool).first)
    text += sentence + "\n";
  return text;
}

struct Heard final : CodingOrder {
  std::vector<std::uint64_t> vertices, cells;
  void vertex(std::uint64_t number) override { vertices.push_back(number); }
  void cell(std::uint64_t number) override { cells.push_back(number); }
  bool operator==(const Heard& other) const {
    return vertices == other.vertices && cells == other.cells;
  }
};

// Compresses the mesh in memory and as a spooled mesh. Checks that both ways result in the same
// file and the same coding order, and that the contents of the file equal the mesh.
void expect_same_file(MeshSource& mesh) {
  ASSERT_FALSE(must_be_spooled(mesh.info(), Spool::kUsualBudget));
  ASSERT_TRUE(must_be_spooled(mesh.info(), kLittle));
  Heard in_memory, in_spool;
  const auto bytes = in_free_order(mesh, Spool::kUsualBudget, &in_memory);
  EXPECT_EQ(in_free_order(mesh, kLittle, &in_spool), bytes);
  EXPECT_TRUE(in_memory == in_spool);
  EXPECT_EQ(differences(mesh, bytes, Spool::kUsualBudget), "");
  EXPECT_EQ(differences(mesh, bytes, kLittle), "");
}

MemoryMesh quads() {
  MemoryMesh mesh;
  const std::uint32_t block = mesh.add_block(CellShape::quad, 4);
  for (int y = 0; y <= 20; ++y)
    for (int x = 0; x <= 20; ++x) mesh.add_point(x, y, x == y ? -0.0 : 0.0);
  for (std::uint64_t y = 0; y < 20; ++y)
    for (std::uint64_t x = 0; x < 20; ++x)
      mesh.add_cell(block, {21 * y + x, 21 * y + x + 1, 21 * y + x + 22, 21 * y + x + 21});
  return mesh;
}

TEST(SpooledMesh, SpoolAndMemoryGiveTheSameFile) {
  MemoryMesh grid = grid_mesh(9, 8, 7), rich = rich_mesh(), two = slabs_mesh(), flat = quads();
  expect_same_file(rich);
  for (MemoryMesh* mesh : {&grid, &rich, &two, &flat}) {
    shuffle_mesh(*mesh, 5, true);
    expect_same_file(*mesh);
  }
}

// Vertices that no cell uses come last. They are in the order of their numbers, which differs from
// the order of their coordinates.
TEST(SpooledMesh, VerticesThatNoCellUses) {
  MemoryMesh grid = grid_mesh(9, 8, 7), flat = quads();
  for (MemoryMesh* mesh : {&grid, &flat}) {
    for (int i = 0; i < 9; ++i) mesh->add_point(i * 7 % 9, i * 4 % 9, -i * 5 % 9);
    expect_same_file(*mesh);
    shuffle_mesh(*mesh, 5, true);
    expect_same_file(*mesh);
  }
}

// The mesh consists of several unconnected components. The cells of the last component have the
// lowest numbers.
TEST(SpooledMesh, PartsComeAsTheMeshCountsThem) {
  MemoryMesh mesh = grid_mesh(9, 3, 3);
  MemoryMesh apart = grid_mesh(4, 4, 4);
  const std::uint64_t first = mesh.mesh.vertices;
  for (std::uint64_t v = 0; v < apart.mesh.vertices; ++v) {
    double at[3];
    std::memcpy(at, apart.points.data() + v * sizeof at, sizeof at);
    mesh.add_point(at[0] - 100, at[1], at[2]);
  }
  for (auto cell : apart.cells) {
    for (auto& v : cell) v += first;
    mesh.add_cell(0, cell);
  }
  shuffle_mesh(mesh, 8, true);
  expect_same_file(mesh);
}

// The coordinates contain no information about the positions of cells, or misleading information.
// Compression in memory and as a spooled mesh must still result in the same file.
TEST(SpooledMesh, AnyCoordinatesWillDo) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  constexpr double kMost = std::numeric_limits<double>::max();
  const std::vector<std::function<double(std::uint64_t)>> kinds = {
      [](std::uint64_t) { return 0.0; },
      [](std::uint64_t) { return kNan; },
      [](std::uint64_t v) { return v % 3 == 0   ? kInfinity
                                   : v % 3 == 1 ? -kInfinity
                                                : kNan; },
      [](std::uint64_t v) { return v % 2 == 0 ? kMost : -kMost; },
      [](std::uint64_t v) { return static_cast<double>(v) * 5e-324; },
  };
  for (const auto& kind : kinds) {
    MemoryMesh mesh = grid_mesh(5, 4, 6);
    shuffle_mesh(mesh, 2, true);
    for (std::uint64_t v = 0; v < mesh.mesh.vertices; ++v)
      for (std::uint64_t c = 0; c < 3; ++c) {
        const double value = kind(v + c);
        std::memcpy(mesh.points.data() + (3 * v + c) * sizeof value, &value, sizeof value);
      }
    const auto bytes = in_free_order(mesh, Spool::kUsualBudget);
    EXPECT_EQ(in_free_order(mesh, kLittle), bytes);
  }
}

// Which cells are neighbours must not depend on the numbering of the vertices. The mesh contains
// duplicate cells, faces that many cells share, cells that contain a face twice, and a vertex with
// very many faces.
TEST(SpooledMesh, FacesOfManyCellsAreJoinedTheSameWay) {
  MemoryMesh mesh = grid_mesh(4, 4, 4);
  const std::vector<std::vector<std::uint64_t>> cells = mesh.cells;
  for (const auto& cell : cells) mesh.add_cell(0, cell);
  for (std::size_t i = 0; i < 20; ++i) mesh.add_cell(0, cells[7]);
  for (std::size_t i = 0; i < 12; ++i) {
    const auto& c = cells[i];
    mesh.add_cell(0, {c[0], c[1], c[2], c[3], c[0], c[1], c[2], c[3]});
    mesh.add_cell(0, {c[0], c[2], c[1], c[3], c[4], c[5], c[6], c[7]});
    mesh.add_cell(0, {c[0], c[0], c[0], c[0], c[0], c[0], c[0], c[0]});
  }
  for (std::uint64_t i = 0; i < 90; ++i)  // around the edge 0-1
    mesh.add_cell(0,
                  {0, 2 + i % 40, 3 + i % 40, 60 + i % 30, 1, 61 + i % 50, 5 + i % 7, 70 + i % 20});
  shuffle_mesh(mesh, 3, true);
  expect_same_file(mesh);
}

TEST(SpooledMesh, AVertexThatIsNoneIsAnError) {
  MemoryMesh mesh = grid_mesh(8, 8, 8);
  mesh.cells[300][5] = mesh.mesh.vertices;
  try {
    in_free_order(mesh, kLittle);
    FAIL() << "a mesh with an invalid vertex number was accepted";
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::corrupt);
    EXPECT_EQ(failure.error().section, "cell 300");
  }
}

// The new vertex numbers and the stored inverse of the renumbering must agree. Apart from the
// numbering, the renumbered mesh must equal the original mesh.
TEST(SpooledMesh, IsTheSameMeshWithOtherNumbers) {
  MemoryMesh mesh = rich_mesh();
  shuffle_mesh(mesh, 11, true);
  TemporaryFolder folder;
  Spool spool(folder / ".", 1 << 20);
  for (const std::size_t memory : {100u, 1u << 20}) {
    SpooledMesh coherent(mesh, spool, memory);
    std::set<std::uint32_t> vertices;
    std::vector<std::byte> point(24);
    for (std::uint32_t v = 0; v < mesh.mesh.vertices; ++v) {
      const std::uint32_t old = coherent.number_of_vertex(v);
      vertices.insert(old);
      coherent.read_points(v, 1, point.data());
      EXPECT_EQ(std::memcmp(point.data(), mesh.points.data() + 24 * old, 24), 0);
    }
    EXPECT_EQ(vertices.size(), mesh.mesh.vertices);
    std::uint32_t before = 0;
    for (std::uint32_t cell = 0; cell < coherent.size(); ++cell) {
      const std::uint32_t old = coherent.number_of(cell);
      EXPECT_EQ(coherent.with_number(old), cell);
      EXPECT_EQ(coherent.block(cell), mesh.cell_blocks[old]);
      const auto nodes = coherent.cell(cell);
      ASSERT_EQ(nodes.size(), mesh.cells[old].size());
      for (std::size_t i = 0; i < nodes.size(); ++i)
        EXPECT_EQ(coherent.number_of_vertex(nodes[i]), mesh.cells[old][i]);
      const std::uint32_t lowest =
          nodes.empty() ? 0 : *std::min_element(nodes.begin(), nodes.end());
      EXPECT_LE(before, lowest);
      before = lowest;
    }
  }
}

}  // namespace
}  // namespace shm::converters
