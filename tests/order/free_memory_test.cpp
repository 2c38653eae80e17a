// Tests that the search for an order of cells stays within its memory limit. The mesh is so large
// that it would need several times this amount of memory.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstring>
#include <functional>

#include "mesh/cell_table.h"
#include "order/free_order.h"
#include "order/spooled_mesh.h"
#include "support/sanitized.h"
#include "support/temporary_folder.h"

namespace shm::converters {
namespace {

constexpr bool kMeasuresMemory = !kSanitized;  // a sanitizer's shadow memory counts too
constexpr std::uint64_t kSide = kMeasuresMemory ? 90 : 12;

// A block of side^3 hexahedra in random order. The cells are computed on request and not stored.
class ScatteredBlock final : public MeshSource {
 public:
  ScatteredBlock() {
    info_.schema.coordinate_type = ScalarType::float32;
    info_.schema.blocks.resize(1);
    info_.vertices = (kSide + 1) * (kSide + 1) * (kSide + 1);
    info_.block_cells = {kSide * kSide * kSide};
  }
  const MeshInfo& info() const override { return info_; }
  void read_points(std::uint64_t first, std::uint64_t count, std::byte* out) override {
    for (std::uint64_t v = first; v < first + count; ++v)
      for (std::uint64_t at = v * kBack % info_.vertices, c = 0; c < 3; ++c, at /= kSide + 1) {
        const auto value = static_cast<float>(at % (kSide + 1));
        std::memcpy(out + (3 * (v - first) + c) * sizeof value, &value, sizeof value);
      }
  }
  bool next_cells(CellBatch& out, std::size_t max_cells) override {
    out.clear();
    for (; next_ < info_.cells() && out.size() < max_cells; ++next_) {
      const std::uint64_t at = next_ * kStep % info_.cells();
      const std::uint64_t x = at % kSide, y = at / kSide % kSide, z = at / kSide / kSide;
      constexpr std::uint64_t kCorners[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                                {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
      for (const auto& corner : kCorners)
        out.corners.push_back(vertex(x + corner[0], y + corner[1], z + corner[2]));
      out.blocks.push_back(0);
      out.corner_begin.push_back(out.corners.size());
    }
    return out.size() > 0;
  }
  void rewind_cells() override { next_ = 0; }
  void read_array(std::size_t, std::uint64_t, std::uint64_t, std::uint64_t, std::byte*) override {}

 private:
  // The pseudorandom order multiplies each number by kStep, modulo the number of vertices or cells.
  // kStep is a prime that divides neither of these numbers. inverse() returns the multiplicative
  // inverse of kStep modulo the number of vertices.
  static constexpr std::uint64_t kStep = 1000003;
  static constexpr std::uint64_t inverse() {
    constexpr std::uint64_t kCount = (kSide + 1) * (kSide + 1) * (kSide + 1);
    std::uint64_t power = 1;  // computes kStep, kStep^2, and so on, until a power is 1; the power
                              // before it is the inverse
    for (std::uint64_t next = kStep % kCount; next != 1; next = next * (kStep % kCount) % kCount)
      power = next;
    return power;
  }
  static inline const std::uint64_t kBack = inverse();
  std::uint64_t vertex(std::uint64_t x, std::uint64_t y, std::uint64_t z) const {
    return ((z * (kSide + 1) + y) * (kSide + 1) + x) * kStep % info_.vertices;
  }

  MeshInfo info_;
  std::uint64_t next_ = 0;
};

// Runs `work` in a child process. Returns the memory in bytes that the process needs in addition to
// its initial memory, or 0 if `work` failed.
std::uint64_t memory_of(const std::function<bool()>& work) {
  int pipe[2];
  if (::pipe(pipe) != 0) return 0;
  const pid_t child = ::fork();
  if (child == 0) {
    rusage before{}, after{};
    ::getrusage(RUSAGE_SELF, &before);
    const bool ok = work();
    ::getrusage(RUSAGE_SELF, &after);
    const std::uint64_t bytes =
        1 + 1024 * static_cast<std::uint64_t>(after.ru_maxrss - before.ru_maxrss);
    const bool sent = ::write(pipe[1], &bytes, sizeof bytes) == sizeof bytes;
    ::_exit(ok && sent ? 0 : 1);
  }
  ::close(pipe[1]);
  std::uint64_t bytes = 0;
  const bool received = ::read(pipe[0], &bytes, sizeof bytes) == sizeof bytes;
  ::close(pipe[0]);
  int status = 0;
  ::waitpid(child, &status, 0);
  return received && WIFEXITED(status) && WEXITSTATUS(status) == 0 ? bytes : 0;
}

// Returns true if the order follows rows and layers, i.e. if every cell shares a face with the cell
// before it, except at the ends of rows.
bool follows_rows(const CellList& order, const Cells& cells) {
  if (order.size() != cells.size()) return false;
  std::uint64_t beside = 0;
  for (std::uint64_t at = 1; at < order.size(); ++at) {
    const auto a = cells.hexahedron(order[at - 1]), b = cells.hexahedron(order[at]);
    int shared = 0;
    for (const std::uint32_t v : a)
      for (const std::uint32_t w : b) shared += v == w ? 1 : 0;
    beside += shared == 4 ? 1 : 0;
  }
  return beside == order.size() - kSide * kSide;
}

TEST(FreeMemory, ASearchInTheSpoolKeepsToItsMemory) {
  constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;
  constexpr std::size_t kMemory = 16 * kMiB;
  const CellOrdering swept{CellOrdering::Kind::swept, 2, false};
  TemporaryFolder folder;
  const std::uint64_t spooled = memory_of([&] {
    ScatteredBlock mesh;
    const SpooledSearch search(kMemory);
    Spool spool(folder / ".", search.mesh_bytes);
    SpooledMesh coherent(mesh, spool, search.sort_bytes);
    CellOrderer orderer(coherent, coherent, {}, {&spool, search.order_bytes});
    return follows_rows(orderer(swept), coherent);
  });
  const std::uint64_t in_memory = memory_of([&] {
    ScatteredBlock mesh;
    const auto cells = CellTable::read(mesh);
    return cells && follows_rows(CellOrderer(*cells, mesh)(swept), *cells);
  });
  ASSERT_GT(spooled, 0u);
  ASSERT_GT(in_memory, 0u);
  std::printf("%llu hexahedra: %.1f MB of memory with a spooled mesh, %.1f MB without\n",
              static_cast<unsigned long long>(kSide * kSide * kSide),
              static_cast<double>(spooled) / 1e6, static_cast<double>(in_memory) / 1e6);
  if (!kMeasuresMemory) return;
  EXPECT_LE(spooled, kMemory);
  EXPECT_GE(in_memory, 3 * kMemory) << "the mesh does not need the spool";
}

}  // namespace
}  // namespace shm::converters
