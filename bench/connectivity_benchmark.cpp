// Measures the speed of each codec for hexahedra. Encodes and decodes corners and original vertex
// numbers, without geometry. Reports cells per second and bits per cell.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "connectivity_coding.h"

namespace {

using shm::ConnectivityCodec;
using shm::bench::Streams;

struct Mesh {
  std::uint64_t vertices = 0;
  std::vector<std::uint32_t> corners;  // vertices: eight for each cell
  // For each cell: bit i is set if no later cell uses the corner i of the cell.
  std::vector<std::uint8_t> last_use;

  /// Sweeps a layer of quadrilaterals: returns `layers` layers of hexahedra.
  void extrude(std::span<const std::array<std::uint32_t, 4>> quads, std::uint32_t plane,
               std::uint32_t layers) {
    for (std::uint32_t k = 0; k < layers; ++k)
      for (const auto& q : quads) {
        std::array<std::uint32_t, 8> cell{};
        for (std::size_t i = 0; i < 8; ++i)
          cell[i] = q[i % 4] + plane * (k + static_cast<std::uint32_t>(i / 4));
        corners.insert(corners.end(), cell.begin(), cell.end());
      }
    vertices = std::uint64_t{plane} * (layers + 1);
  }
  void find_last_uses() { last_use = shm::bench::last_uses(corners, vertices); }
};

Mesh grid(std::uint32_t n) {
  std::vector<std::array<std::uint32_t, 4>> quads;
  const std::uint32_t m = n + 1;
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i)
      quads.push_back({j * m + i, j * m + i + 1, j * m + m + i + 1, j * m + m + i});
  Mesh mesh;
  mesh.extrude(quads, m * m, n);
  mesh.find_last_uses();
  return mesh;
}

/// Returns a cylinder. Its first block is a square core of n x n columns; the other blocks form n
/// rings around the core. Cells are numbered block by block, and in each block from bottom to top.
Mesh o_grid(std::uint32_t n) {
  const std::uint32_t m = n + 1, around = 4 * n, core = m * m;
  // vertices on the boundary of the core, in counter-clockwise order
  std::vector<std::uint32_t> rim;
  for (std::uint32_t i = 0; i < n; ++i) rim.push_back(i);
  for (std::uint32_t j = 0; j < n; ++j) rim.push_back(j * m + n);
  for (std::uint32_t i = n; i > 0; --i) rim.push_back(n * m + i);
  for (std::uint32_t j = n; j > 0; --j) rim.push_back(j * m);
  const auto at = [&](std::uint32_t ring, std::uint32_t a) {
    return ring == 0 ? rim[a % around] : core + (ring - 1) * around + a % around;
  };
  std::vector<std::array<std::uint32_t, 4>> inner, outer;
  for (std::uint32_t j = 0; j < n; ++j)
    for (std::uint32_t i = 0; i < n; ++i)
      inner.push_back({j * m + i, j * m + i + 1, j * m + m + i + 1, j * m + m + i});
  for (std::uint32_t r = 0; r < n; ++r)
    for (std::uint32_t a = 0; a < around; ++a)
      outer.push_back({at(r, a), at(r + 1, a), at(r + 1, a + 1), at(r, a + 1)});
  Mesh mesh;
  mesh.extrude(inner, core + n * around, n);
  mesh.extrude(outer, core + n * around, n);
  mesh.find_last_uses();
  return mesh;
}

Streams encode(const Mesh& mesh, ConnectivityCodec codec) {
  return shm::bench::encode(mesh.corners, mesh.last_use, mesh.vertices, codec);
}

template <Mesh (*make)(std::uint32_t)>
void encode_connectivity(benchmark::State& state, ConnectivityCodec codec) {
  const Mesh mesh = make(static_cast<std::uint32_t>(state.range(0)));
  std::size_t bytes = 0;
  for (auto _ : state) {
    bytes = encode(mesh, codec).bytes();
  }
  const auto cells = static_cast<std::int64_t>(mesh.last_use.size());
  state.SetItemsProcessed(state.iterations() * cells);
  state.counters["bits_per_cell"] = 8.0 * static_cast<double>(bytes) / static_cast<double>(cells);
}

template <Mesh (*make)(std::uint32_t)>
void decode_connectivity(benchmark::State& state, ConnectivityCodec codec) {
  const Mesh mesh = make(static_cast<std::uint32_t>(state.range(0)));
  const Streams streams = encode(mesh, codec);
  for (auto _ : state)
    benchmark::DoNotOptimize(shm::bench::decode(streams, mesh.last_use.size(), codec));
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.last_use.size()));
}

void encode_grid(benchmark::State& state, ConnectivityCodec c) {
  encode_connectivity<grid>(state, c);
}
void decode_grid(benchmark::State& state, ConnectivityCodec c) {
  decode_connectivity<grid>(state, c);
}
void encode_o_grid(benchmark::State& state, ConnectivityCodec c) {
  encode_connectivity<o_grid>(state, c);
}
void decode_o_grid(benchmark::State& state, ConnectivityCodec c) {
  decode_connectivity<o_grid>(state, c);
}

#define SHM_FOR_EACH_CODEC(function, size)                       \
  BENCHMARK_CAPTURE(function, paper, ConnectivityCodec::paper)   \
      ->Arg(size)                                                \
      ->Unit(benchmark::kMillisecond);                           \
  BENCHMARK_CAPTURE(function, rows, ConnectivityCodec::rows)     \
      ->Arg(size)                                                \
      ->Unit(benchmark::kMillisecond);                           \
  BENCHMARK_CAPTURE(function, mixed, ConnectivityCodec::mixed)   \
      ->Arg(size)                                                \
      ->Unit(benchmark::kMillisecond);                           \
  BENCHMARK_CAPTURE(function, replay, ConnectivityCodec::replay) \
      ->Arg(size)                                                \
      ->Unit(benchmark::kMillisecond)

SHM_FOR_EACH_CODEC(encode_grid, 80);
SHM_FOR_EACH_CODEC(decode_grid, 80);
SHM_FOR_EACH_CODEC(encode_o_grid, 40);
SHM_FOR_EACH_CODEC(decode_o_grid, 40);

}  // namespace
