// Tests of vertex compaction: each vertex precedes the first cell that uses it, and the last use of
// each vertex is marked once.
#include "mesh/vertex_compaction.h"

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "base/failure.h"
#include "support/memory_mesh.h"

namespace shm::converters {
namespace {

// Checks that a stream of vertices and cells obeys the rules of vertex compaction.
class Checker final : public CompactedMesh {
 public:
  explicit Checker(const MemoryMesh& mesh) : mesh_(&mesh) {
    for (std::uint64_t c = 0; c < mesh.cells.size(); ++c)
      for (const std::uint64_t v : mesh.cells[c]) last_[v] = c;
  }
  void begin_batch(const CellBatch& batch, std::uint64_t first_cell) override {
    EXPECT_EQ(first_cell, next_cell_);
    EXPECT_GT(batch.size(), 0u);
  }
  void vertex(std::uint64_t number, std::uint64_t last_cell) override {
    EXPECT_TRUE(seen_.insert(number).second) << "vertex " << number << " comes twice";
    order.push_back(number);
    if (last_.count(number) > 0) {
      EXPECT_EQ(last_cell, last_[number]);
      live_.insert(number);
      fresh_.insert(number);
    } else {
      EXPECT_EQ(last_cell, kNeverUsed);
      EXPECT_EQ(next_cell_, mesh_->cells.size()) << "an unused vertex comes before the last cell";
    }
    widest = std::max<std::uint64_t>(widest, live_.size());
  }
  void cell(const CellBatch& batch, std::size_t index, std::uint64_t last_use,
            std::span<const std::uint64_t> other_last_uses) override {
    const auto corners = batch.cell(index);
    EXPECT_TRUE(std::equal(corners.begin(), corners.end(), mesh_->cells[next_cell_].begin(),
                           mesh_->cells[next_cell_].end()));
    EXPECT_EQ(batch.blocks[index], mesh_->cell_blocks[next_cell_]);
    std::set<std::uint64_t> ends;
    std::vector<std::uint64_t> other_ends;
    for (std::size_t c = 0; c < corners.size(); ++c) {
      const std::uint64_t v = corners[c];
      EXPECT_TRUE(live_.count(v) > 0 || ends.count(v) > 0) << "vertex " << v << " is not live";
      fresh_.erase(v);
      const bool ends_here = last_[v] == next_cell_ && ends.insert(v).second;
      if (ends_here) live_.erase(v);
      if (c < 64) {
        EXPECT_EQ(last_use >> c & 1, ends_here ? 1u : 0u);
      } else if (ends_here) {
        other_ends.push_back(v);
      }
    }
    EXPECT_TRUE(std::equal(other_last_uses.begin(), other_last_uses.end(), other_ends.begin(),
                           other_ends.end()));
    EXPECT_TRUE(fresh_.empty()) << "a vertex comes before it is needed";
    ++next_cell_;
  }
  void finish() const {
    EXPECT_EQ(next_cell_, mesh_->cells.size());
    EXPECT_EQ(seen_.size(), mesh_->mesh.vertices);
    EXPECT_TRUE(live_.empty());
  }

  std::vector<std::uint64_t> order;
  std::uint64_t widest = 0;

 private:
  const MemoryMesh* mesh_;
  std::map<std::uint64_t, std::uint64_t> last_;
  std::set<std::uint64_t> seen_, live_, fresh_;
  std::uint64_t next_cell_ = 0;
};

Checker check(MemoryMesh& mesh) {
  Spool spool(::testing::TempDir());
  Checker checker(mesh);
  stream_compacted(mesh, spool, checker);
  checker.finish();
  return checker;
}

TEST(Compaction, GridNeedsTwoSlicesOfVertices) {
  MemoryMesh mesh = grid_mesh(10, 8, 12);
  const Checker checker = check(mesh);
  // Upper bound on the number of live vertices: one layer of vertices, one row, and four more
  // corners of a cell.
  EXPECT_LE(checker.widest, 11u * 9u + 11u + 4u);
  EXPECT_EQ(checker.order.front(), mesh.cells[0][0]);
}

TEST(Compaction, ShuffledMeshes) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    MemoryMesh mesh = grid_mesh(5, 6, 7);
    shuffle_mesh(mesh, seed, true);
    check(mesh);
  }
}

TEST(Compaction, RepeatedCornersLongCellsAndUnusedVertices) {
  MemoryMesh mesh = rich_mesh();
  const Checker checker = check(mesh);
  EXPECT_LT(checker.order[checker.order.size() - 2], checker.order.back());
}

TEST(Compaction, CornersOfACellComeInTheirOrder) {
  MemoryMesh mesh = grid_mesh(1, 1, 1);
  mesh.cells[0] = {5, 5, 1, 0, 7, 2, 3, 4};
  EXPECT_EQ(check(mesh).order, (std::vector<std::uint64_t>{5, 1, 0, 7, 2, 3, 4, 6}));
}

TEST(Compaction, NothingAtAll) {
  MemoryMesh mesh;
  check(mesh);
  mesh.add_point(1, 2, 3);
  check(mesh);
}

TEST(Compaction, VertexOutOfRangeIsCorrupt) {
  MemoryMesh mesh = grid_mesh(2, 1, 1);
  mesh.cells[1][3] = mesh.mesh.vertices;
  Spool spool(::testing::TempDir());
  Checker checker(mesh);
  try {
    stream_compacted(mesh, spool, checker);
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::corrupt);
    EXPECT_EQ(failure.error().section, "cell 1");
  }
}

}  // namespace
}  // namespace shm::converters
