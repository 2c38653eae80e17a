// Tests of trials that choose the size of the delay buffer. A trial encodes a sample of the mesh:
// runs of consecutive cells with their data. It chooses a delay buffer only if the buffer makes the
// encoded sample smaller.
#include "order/delay_trial.h"

#include <gtest/gtest.h>

#include <map>

#include "base/failure.h"
#include "compression/compress.h"
#include "order/sample_mesh.h"
#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

TEST(DelayTrial, RunsKeepTheirOrderAndData) {
  MemoryMesh mesh = rich_mesh();
  const std::vector<CellRun> runs = {{0, 10}, {10, 3}, {101, 60}};
  SampleMesh sample(mesh, runs);
  std::vector<std::uint64_t> wanted;
  for (const CellRun& run : runs)
    for (std::uint64_t i = 0; i < run.count; ++i) wanted.push_back(run.first + i);
  ASSERT_EQ(sample.info().cells(), wanted.size());
  EXPECT_EQ(sample.info().step_times.size(), 3u);
  EXPECT_TRUE(sample.info().extras.empty());

  CellBatch batch;
  ASSERT_TRUE(sample.next_cells(batch, 1000));
  ASSERT_EQ(batch.size(), wanted.size());
  // To identify vertices, the test compares their coordinates and their values in the arrays "tag"
  // and "heat". To identify cells, it compares their values in two arrays: one on all blocks, and
  // one on some of the blocks.
  std::uint64_t level = 0, stress = 0;
  std::vector<std::uint64_t> level_before(mesh.cells.size()), stress_before(mesh.cells.size());
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    level_before[c] = level;
    stress_before[c] = stress;
    level += mesh.cell_blocks[c] != 1;
    stress += mesh.cell_blocks[c] == 1;
  }
  level = stress = 0;
  const auto same = [&](std::size_t array, std::uint64_t step, std::uint64_t here,
                        std::uint64_t there) {
    const std::size_t stride = mesh.info().array_stride(array);
    std::vector<std::byte> ours(stride), theirs(stride);
    sample.read_array(array, step, here, 1, ours.data());
    mesh.read_array(array, step, there, 1, theirs.data());
    return ours == theirs;
  };
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    const std::uint64_t cell = wanted[i];
    ASSERT_EQ(batch.blocks[i], mesh.cell_blocks[cell]);
    ASSERT_EQ(batch.cell(i).size(), mesh.cells[cell].size());
    for (std::size_t k = 0; k < mesh.cells[cell].size(); ++k) {
      const std::uint64_t here = batch.cell(i)[k], there = mesh.cells[cell][k];
      std::byte ours[24], theirs[24];
      sample.read_points(here, 1, ours);
      mesh.read_points(there, 1, theirs);
      EXPECT_EQ(std::memcmp(ours, theirs, sizeof ours), 0);
      EXPECT_TRUE(same(0, 0, here, there) && same(1, 0, here, there) && same(2, 1, here, there));
    }
    EXPECT_TRUE(same(3, 0, i, cell));
    if (mesh.cell_blocks[cell] != 1) {
      EXPECT_TRUE(same(4, 0, level++, level_before[cell]));
    } else {
      EXPECT_TRUE(same(5, 2, stress++, stress_before[cell]));
    }
  }
}

// The numbers of the sample's vertices are far apart, so a SampleMesh must read the vertices in
// several pieces.
TEST(DelayTrial, VerticesThatLieApart) {
  MemoryMesh mesh;
  const std::uint32_t block = mesh.add_block(CellShape::hexahedron, 8);
  constexpr std::uint64_t kVertices = 200000;
  for (std::uint64_t v = 0; v < kVertices; ++v) mesh.add_point(static_cast<double>(v), 0, 1);
  for (std::uint64_t c = 0; c < 40; ++c) {
    const std::uint64_t v = c < 20 ? c * 9000 : 190000 - c * 17;
    mesh.add_cell(block, {v, v + 1, v + 2, v + 3, v + 4, v + 5, v + 6, kVertices - 1});
  }
  SampleMesh sample(mesh, {{0, 30}, {35, 5}});
  CellBatch batch;
  ASSERT_TRUE(sample.next_cells(batch, 1000));
  ASSERT_EQ(batch.size(), 35u);
  for (std::size_t i = 0; i < batch.size(); ++i)
    for (std::size_t k = 0; k < 8; ++k) {
      double xyz[3];
      sample.read_points(batch.cell(i)[k], 1, reinterpret_cast<std::byte*>(xyz));
      EXPECT_EQ(xyz[0], static_cast<double>(mesh.cells[i < 30 ? i : i + 5][k]));
      EXPECT_EQ(xyz[2], 1);
    }
}

TEST(DelayTrial, CellsWithVerticesThatAreNone) {
  MemoryMesh mesh = grid_mesh(3, 3, 3);
  mesh.cells[20][4] = 64;
  EXPECT_NO_THROW(SampleMesh(mesh, std::vector<CellRun>{{0, 20}}));
  EXPECT_THROW(SampleMesh(mesh, std::vector<CellRun>{{7, 20}}), Failure);
}

// Returns the delay that find_delay() chooses. Instead of encoding, the test uses the encoded size
// that `bytes` contains for each delay. Stores the delays that find_delay() tried in `tried`.
std::uint32_t found(MeshSource& mesh, const std::map<std::uint32_t, std::uint64_t>& bytes,
                    std::vector<std::uint32_t>* tried = nullptr,
                    double worthwhile = kWorthwhileAtBest) {
  return find_delay(mesh, worthwhile, [&](MeshSource& part, std::uint32_t delay) {
    EXPECT_LT(part.info().cells() * 10, mesh.info().cells());
    if (tried != nullptr) tried->push_back(delay);
    SizeReport sizes;
    sizes.total_bytes = bytes.at(delay);
    return sizes;
  });
}

TEST(DelayTrial, TakesWhatPays) {
  MemoryMesh mesh = grid_mesh(31, 30, 29);
  std::vector<std::uint32_t> tried;
  EXPECT_EQ(found(mesh, {{0, 10000}, {256, 9901}}, &tried), 0u);
  EXPECT_EQ(tried, (std::vector<std::uint32_t>{0, 256}));
  EXPECT_EQ(found(mesh, {{0, 10000}, {256, 9800}, {1024, 9801}}), 256u);
  EXPECT_EQ(found(mesh, {{0, 10000}, {256, 9800}, {1024, 9700}}), 1024u);
  EXPECT_EQ(found(mesh, {{0, 10000}, {256, 9701}}, nullptr, kWorthwhile), 0u);
  EXPECT_EQ(found(mesh, {{0, 10000}, {256, 9699}, {1024, 9698}}, nullptr, kWorthwhile), 1024u);
  MemoryMesh small = grid_mesh(20, 20, 20);
  EXPECT_EQ(found(small, {}), 0u);
}

TEST(DelayTrial, StepsThatWereNotTriedCountToo) {
  MemoryMesh mesh = grid_mesh(31, 30, 29);
  mesh.mesh.step_times.assign(30, 0);
  mesh.add_array<float>({"u", Location::cell, ScalarType::float32, 1, true, {}, "", {}},
                        std::vector<std::vector<float>>(30, std::vector<float>(31 * 30 * 29)));
  const std::uint32_t delay =
      find_delay(mesh, kWorthwhile, [&](MeshSource& part, std::uint32_t delayed) {
        EXPECT_EQ(part.info().step_times.size(), 3u);
        SizeReport sizes;
        sizes.total_bytes = delayed == 0 ? 10000 : 9500;
        sizes.streams["array:cell/u"] = delayed == 0 ? 100 : 200;
        return sizes;
      });
  EXPECT_EQ(delay, 0u);
}

}  // namespace
}  // namespace shm::converters
