// small_bench grid|series [--level LEVEL] [--threads N] [--times N] [--read]: writes a small mesh N
// times to memory. With --read, writes the mesh once and reads it N times. Prints the size of the
// file in bytes and its checksum. To measure the cost, run the program under callgrind:
//   valgrind --tool=callgrind small_bench grid
// LEVEL is fast, standard or best. The mesh "grid" has 5 x 5 x 5 hexahedra and float64 points,
// written with order keep. The mesh "series" has 4 x 4 x 4 hexahedra, and six point and six cell
// arrays of float64 values at 11 time steps.
#include <array>
#include <cstdint>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/binary.h"
#include "options.h"
#include "shm/reader.h"
#include "shm/writer.h"

namespace shm::bench {
namespace {

template <class T>
T unwrapped(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

struct SmallMesh {
  std::uint64_t side = 0, arrays = 0, steps = 0;

  std::uint64_t points() const { return (side + 1) * (side + 1) * (side + 1); }
  std::uint64_t cells() const { return side * side * side; }
  Schema schema() const {
    Schema schema;
    schema.order = Order::keep;
    schema.coordinate_type = ScalarType::float64;
    schema.blocks.push_back({1, "hexahedra", CellShape::hexahedron, 8});
    for (std::uint64_t a = 0; a < arrays; ++a) {
      ArrayInfo& info = schema.arrays.emplace_back();
      info.name = "array" + std::to_string(a);
      info.location = is_of_cells(a) ? Location::cell : Location::point;
      info.type = ScalarType::float64;
      info.per_step = true;
    }
    return schema;
  }
  bool is_of_cells(std::uint64_t array) const { return array >= arrays / 2; }
  /// Returns a point of a curved mesh. Uses only arithmetic whose results are the same on all
  /// machines.
  std::array<double, 3> point(std::uint64_t v) const {
    const std::uint64_t n = side + 1;
    const double x = of_side(v % n), y = of_side(v / n % n), z = of_side(v / n / n);
    return {x + .1 * y * y, y - .07 * x * z, z + .05 * x * x * y};
  }
  double of_side(std::uint64_t i) const { return double(i) / double(side); }
  double value(std::uint64_t array, std::uint64_t step, std::uint64_t i) const {
    const double time = .1 * double(step), at = double(i) / double(cells());
    return (1 + double(array)) * (at * at - time * at) / (1 + .3 * at + time);
  }
};

void write(const SmallMesh& mesh, ByteSink& sink, const WriteOptions& options) {
  Writer writer = unwrapped(Writer::create(sink, mesh.schema(), options));
  for (std::uint64_t v = 0; v < mesh.points(); ++v) {
    const auto xyz = mesh.point(v);
    unwrapped(writer.add_vertex(v, std::as_bytes(std::span(xyz))));
  }
  const std::uint64_t n = mesh.side + 1;
  for (std::uint64_t c = 0; c < mesh.cells(); ++c) {
    const std::uint64_t x = c % mesh.side, y = c / mesh.side % mesh.side,
                        z = c / mesh.side / mesh.side, v = x + n * (y + n * z), up = n * n;
    const std::array<std::uint64_t, 8> corners = {v,      v + 1,      v + n + 1,      v + n,
                                                  v + up, v + up + 1, v + up + n + 1, v + up + n};
    unwrapped(writer.add_cell(0, corners));
  }
  unwrapped(writer.end_mesh());
  std::vector<double> values;
  for (std::uint64_t s = 0; s < mesh.steps; ++s)
    for (std::uint64_t a = 0; a < mesh.arrays; ++a) {
      values.resize(mesh.is_of_cells(a) ? mesh.cells() : mesh.points());
      for (std::size_t i = 0; i < values.size(); ++i) values[i] = mesh.value(a, s, i);
      unwrapped(writer.add_step_values(static_cast<std::uint32_t>(a), s,
                                       std::as_bytes(std::span(values))));
    }
  std::vector<double> times;
  for (std::uint64_t s = 0; s < mesh.steps; ++s) times.push_back(.1 * double(s));
  if (!times.empty()) unwrapped(writer.set_step_times(times));
  unwrapped(writer.finish());
}

void read(std::span<const std::byte> file, unsigned threads) {
  MemorySource source(file);
  ReadOptions options;
  options.threads = threads;
  Reader reader = unwrapped(Reader::open(source, {}, options));
  while (unwrapped(reader.next()) != nullptr) continue;
}

int run(int argc, char** argv) {
  std::string level = "standard";
  WriteOptions options;
  unsigned times = 1;
  bool reads = false;
  const std::string name = parse_options(
      argc, argv,
      {{"--level", level}, {"--threads", options.threads}, {"--times", times}, {"--read", reads}});
  if (name != "grid" && name != "series") throw std::runtime_error("there is no mesh " + name);
  if (level != "fast" && level != "standard" && level != "best")
    throw std::runtime_error("there is no level " + level);
  if (level != "standard") options.level = level == "fast" ? Level::fast : Level::best;
  const SmallMesh mesh = name == "grid" ? SmallMesh{5, 0, 0} : SmallMesh{4, 12, 11};
  MemorySink sink;
  for (unsigned i = 0; i < (reads ? 1 : times); ++i) {
    sink = {};
    write(mesh, sink, options);
  }
  if (reads)
    for (unsigned i = 0; i < times; ++i) read(sink.bytes, options.threads);
  std::printf("%zu bytes, checksum %016llx\n", sink.bytes.size(),
              static_cast<unsigned long long>(checksum(sink.bytes)));
  return 0;
}

}  // namespace
}  // namespace shm::bench

int main(int argc, char** argv) {
  try {
    return shm::bench::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "small_bench: %s\n", error.what());
  }
  return 1;
}
