// Measures the memory of three operations on 5 million hexahedra, which are generated on the fly:
// writing them with the Writer, reading them with the Reader, and finding their boundary surface.
// Each operation runs in a separate process and may use at most 64 MB of resident memory. A further
// test reads a file of one million hexahedra with two fields as a Mesh. Reading this file may need
// at most 1.3 times the memory of the Mesh.
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <functional>

#include "shm/boundary_surface.h"
#include "shm/mesh.h"
#include "support/sanitized.h"
#include "support/test_mesh.h"

namespace shm {
namespace {

constexpr bool kMeasuresMemory = !kSanitized;  // a sanitizer's shadow memory counts too

/// Runs `work` in a child process. Returns the largest resident size of the process in bytes, or 0
/// if `work` failed.
std::uint64_t peak_memory_of(const std::function<bool()>& work) {
  const pid_t child = ::fork();
  if (child == 0) ::_exit(work() ? 0 : 1);
  int status = 0;
  rusage usage{};
  if (::wait4(child, &status, 0, &usage) != child || !WIFEXITED(status) || WEXITSTATUS(status) != 0)
    return 0;
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

/// Writes a warped block of n^3 hexahedra to a Writer. Each vertex is added immediately before the
/// first cell that uses it. If `value` is true, each vertex and each cell also has a float64 value.
class Stream {
 public:
  Stream(Writer& writer, std::uint64_t n, bool value) : writer_(&writer), n_(n), value_(value) {}

  bool write() {
    for (std::uint64_t k = 0; k < n_; ++k)
      for (std::uint64_t j = 0; j < n_; ++j)
        for (std::uint64_t i = 0; i < n_; ++i)
          if (!write_cell({i, j, k})) return false;
    return static_cast<bool>(writer_->end_mesh()) && static_cast<bool>(writer_->finish());
  }

 private:
  using Place = std::array<std::uint64_t, 3>;

  std::uint64_t number(const Place& p) const { return p[0] + (n_ + 1) * (p[1] + (n_ + 1) * p[2]); }
  bool write_vertex(const Place& p) {
    std::array<float, 3> xyz{};
    const auto side = static_cast<double>(n_);
    const auto warm = warped(static_cast<double>(p[0]) / side, static_cast<double>(p[1]) / side,
                             static_cast<double>(p[2]) / side);
    for (std::size_t c = 0; c < 3; ++c) xyz[c] = static_cast<float>(warm[c]);
    const std::array<double, 1> height{static_cast<double>(xyz[2])};
    return static_cast<bool>(
        writer_->add_vertex(number(p), std::as_bytes(std::span(xyz)), value_of(height)));
  }
  bool write_cell(const Place& cell) {
    constexpr std::array<Place, 8> kCorners = {
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}};
    std::array<std::uint64_t, 8> corners{};
    std::uint64_t last_use = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      bool first = true, last = true;
      Place at{};
      for (std::size_t d = 0; d < 3; ++d) {
        at[d] = cell[d] + kCorners[c][d];
        first = first && (kCorners[c][d] == 1 || cell[d] == 0);
        last = last && (kCorners[c][d] == 0 || cell[d] + 1 == n_);
      }
      corners[c] = number(at);
      if (last) last_use |= std::uint64_t{1} << c;
      if (first && !write_vertex(at)) return false;
    }
    const std::array<double, 1> layer{static_cast<double>(cell[2]) / 7};
    return static_cast<bool>(writer_->add_cell(0, corners, last_use, value_of(layer)));
  }
  std::span<const std::byte> value_of(const std::array<double, 1>& number) const {
    return std::as_bytes(std::span(number)).first(value_ ? sizeof number : 0);
  }

  Writer* writer_;
  std::uint64_t n_;
  bool value_;
};

bool stream_to(const std::string& path, const Schema& schema, std::uint64_t n) {
  auto sink = FileSink::create(path);
  if (!sink) return false;
  auto writer = Writer::create(**sink, schema);
  return writer && Stream(*writer, n, !schema.arrays.empty()).write() && (*sink)->commit();
}

double megabytes(std::uint64_t bytes) { return static_cast<double>(bytes) / 1e6; }

TEST(Memory, FiveMillionHexahedraIn64Megabytes) {
  const std::uint64_t n = kMeasuresMemory ? 171 : 40;  // 171^3 = 5 000 211
  constexpr std::uint64_t kLimit = 64u << 20;
  const std::string path =
      testing::TempDir() + "memory_test-" + std::to_string(::getpid()) + ".shm";
  for (Order order : {Order::stream, Order::keep}) {
    Schema schema = hexahedra_schema();
    schema.order = order;
    schema.corner_order = order == Order::keep;
    const std::uint64_t written = peak_memory_of([&] { return stream_to(path, schema, n); });
    const std::uint64_t read = peak_memory_of([&] {
      auto source = FileSource::open(path);
      if (!source) return false;
      auto reader = Reader::open(**source);
      std::uint64_t cells = 0;
      while (reader) {
        auto item = reader->next();
        if (!item) return false;
        if (*item == nullptr) break;
        if (const auto* block = std::get_if<MeshBlock>(*item)) cells += block->cell_count();
      }
      return cells == n * n * n;
    });
    const std::uint64_t bounded = peak_memory_of([&] {
      const auto source = FileRandomSource::open(path);
      if (!source) return false;
      const auto surface = read_boundary(**source);
      return surface && surface->face_count() == 6 * n * n;
    });
    ::unlink(path.c_str());
    ASSERT_GT(written, 0u);
    ASSERT_GT(read, 0u);
    ASSERT_GT(bounded, 0u);
    std::printf("%llu hexahedra, order %s: %.1f MB to write, %.1f to read, %.1f for the boundary\n",
                static_cast<unsigned long long>(n * n * n),
                order == Order::keep ? "keep" : "stream", static_cast<double>(written) / 1048576.0,
                static_cast<double>(read) / 1048576.0, static_cast<double>(bounded) / 1048576.0);
    if (!kMeasuresMemory) continue;
    EXPECT_LE(written, kLimit);
    EXPECT_LE(read, kLimit);
    EXPECT_LE(bounded, kLimit);
  }
}

TEST(Memory, AMeshTakesThreeTenthsMoreToReadIt) {
  const std::uint64_t n = kMeasuresMemory ? 100 : 20;
  const std::string path =
      testing::TempDir() + "memory_test-" + std::to_string(::getpid()) + ".shm";
  Schema schema = hexahedra_schema();
  for (const Location location : {Location::point, Location::cell}) {
    ArrayInfo field;
    field.name = "field";
    field.location = location;
    field.type = ScalarType::float64;
    schema.arrays.push_back(field);
  }
  ASSERT_TRUE(stream_to(path, schema, n));
  const std::uint64_t read = peak_memory_of([&] {
    const auto mesh = read_file(path);
    return mesh && mesh->cell_count() == n * n * n;
  });
  ::unlink(path.c_str());
  ASSERT_GT(read, 0u);
  // For each cell, a Mesh stores the corners, a corner offset, a block index and a value. For each
  // vertex, it stores float32 coordinates and a value.
  const std::uint64_t mesh = n * n * n * (64 + 8 + 4 + 8) + (n + 1) * (n + 1) * (n + 1) * (12 + 8);
  std::printf("reading a mesh of %.1f MB needs %.1f MB of memory\n", megabytes(mesh),
              megabytes(read));
  if (kMeasuresMemory) {
    EXPECT_LE(read, mesh * 13 / 10 + (4u << 20));  // plus memory of the program itself
  }
}

}  // namespace
}  // namespace shm
