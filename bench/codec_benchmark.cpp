// Measures the speed of the Writer and the Decoder for a bent lattice of hexahedra, from memory to
// memory, without files and converters.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>

#include "shm/reader.h"
#include "shm/writer.h"

namespace {

// A lattice of n x n x n hexahedra, written layer by layer as a solver would. Vertices are written
// before the first layer of cells that uses them, and each vertex is finalized by the last cell
// that uses it.
class Lattice {
 public:
  explicit Lattice(std::uint64_t n) : n_(n), m_(n + 1) {}
  std::uint64_t cells() const { return n_ * n_ * n_; }

  void push(shm::Writer& writer) const {
    layer(writer, 0);
    for (std::uint64_t k = 0; k < n_; ++k) {
      layer(writer, k + 1);
      for (std::uint64_t j = 0; j < n_; ++j)
        for (std::uint64_t i = 0; i < n_; ++i) cell(writer, i, j, k);
    }
  }

 private:
  static void check(const shm::Result<void>& result) {
    if (!result) throw std::runtime_error(result.error().message());
  }
  std::uint64_t number(std::uint64_t i, std::uint64_t j, std::uint64_t k) const {
    return i + m_ * (j + m_ * k);
  }
  void layer(shm::Writer& writer, std::uint64_t k) const {
    for (std::uint64_t j = 0; j < m_; ++j)
      for (std::uint64_t i = 0; i < m_; ++i) {
        const double x = static_cast<double>(i) / static_cast<double>(n_);
        const double y = static_cast<double>(j) / static_cast<double>(n_);
        const double z = static_cast<double>(k) / static_cast<double>(n_);
        const std::array<float, 3> xyz{static_cast<float>((2 + x) * std::cos(z)),
                                       static_cast<float>(y + 0.1 * x * z),
                                       static_cast<float>((2 + x) * std::sin(z))};
        check(writer.add_vertex(number(i, j, k), std::as_bytes(std::span(xyz))));
      }
  }
  void cell(shm::Writer& writer, std::uint64_t i, std::uint64_t j, std::uint64_t k) const {
    constexpr std::uint64_t kOffsets[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                              {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
    std::array<std::uint64_t, 8> corners{};
    std::uint64_t last_use = 0;
    for (std::size_t c = 0; c < 8; ++c) {
      const auto [di, dj, dk] = std::to_array(kOffsets[c]);
      corners[c] = number(i + di, j + dj, k + dk);
      // This cell is the last one that uses the vertex if, along each axis, the vertex is on the
      // low side of the cell, or the cell is the last one on this axis.
      const bool last =
          (di == 0 || i + 1 == n_) && (dj == 0 || j + 1 == n_) && (dk == 0 || k + 1 == n_);
      last_use |= std::uint64_t{last} << c;
    }
    check(writer.add_cell(0, corners, last_use));
  }
  std::uint64_t n_, m_;
};

void write_to(shm::ByteSink& sink, const Lattice& lattice) {
  shm::Schema schema;
  schema.coordinate_type = shm::ScalarType::float32;
  schema.blocks.resize(1);
  auto writer = shm::Writer::create(sink, schema);
  if (!writer) throw std::runtime_error(writer.error().message());
  lattice.push(*writer);
  if (const auto ended = writer->end_mesh(); !ended)
    throw std::runtime_error(ended.error().message());
  if (const auto sizes = writer->finish(); !sizes)
    throw std::runtime_error(sizes.error().message());
}

void write_lattice(benchmark::State& state) {
  const Lattice lattice(static_cast<std::uint64_t>(state.range(0)));
  for (auto _ : state) {
    shm::NullSink nowhere;
    write_to(nowhere, lattice);
    benchmark::DoNotOptimize(nowhere.bytes);
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(lattice.cells()));
}
BENCHMARK(write_lattice)->Arg(20)->Arg(60)->Unit(benchmark::kMillisecond);

void read_lattice(benchmark::State& state) {
  const Lattice lattice(static_cast<std::uint64_t>(state.range(0)));
  shm::MemorySink file;
  write_to(file, lattice);
  for (auto _ : state) {
    shm::MemorySource source(file.bytes);
    auto reader = shm::Reader::open(source);
    if (!reader) throw std::runtime_error(reader.error().message());
    for (;;) {
      auto item = reader->next();
      if (!item) throw std::runtime_error(item.error().message());
      if (*item == nullptr) break;
      benchmark::DoNotOptimize(*item);
    }
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(lattice.cells()));
}
BENCHMARK(read_lattice)->Arg(20)->Arg(60)->Unit(benchmark::kMillisecond);

}  // namespace
