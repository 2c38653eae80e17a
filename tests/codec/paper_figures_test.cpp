// Compares the encoded size with the figures that the paper publishes for its mesh "grid", 15 x 15
// x 15 hexahedra in scanline order. Table 2 of the paper states, in bits per hexahedron (bph), 1.93
// without a delay buffer and 1.35 with a delay buffer of 50 cells. In bits per vertex (bpv), it
// states 0.4 with coordinates of 16 bits and 19.5 with lossless coordinates.
#include <cstdio>

#include "support/test_mesh.h"

namespace shm {
namespace {

struct Rates {
  double bits_per_hexahedron, bits_per_vertex;
};

Rates measure(std::uint32_t delay, std::uint32_t bits,
              ConnectivityCodec codec = ConnectivityCodec::automatic) {
  TestMesh mesh = grid(15, 15, 15);
  mesh.schema.order = Order::stream;
  mesh.schema.corner_order = false;
  mesh.schema.delay = delay;
  if (bits > 0) mesh.schema.coordinate_quantization = {bits, {0, 0, 0}, {1, 1, 1}};
  SizeReport report;
  expect_round_trip(mesh, {.connectivity = codec}, &report);
  std::uint64_t connectivity = 0;
  for (const char* name : {"connectivity", "corner order", "cell numbers", "vertex numbers"})
    connectivity += report.streams[name];
  const Rates rates = {8.0 * static_cast<double>(connectivity) / 3375.0,
                       8.0 * static_cast<double>(report.streams["geometry"]) / 4096.0};
  std::printf("grid 15^3, %s, delay %u, %s: %.3f bph, %.3f bpv\n",
              codec == ConnectivityCodec::paper ? "paper's scheme" : "default", delay,
              bits > 0 ? "16 bits" : "lossless", rates.bits_per_hexahedron, rates.bits_per_vertex);
  return rates;
}

TEST(PaperFigures, ItsOwnScheme) {
  EXPECT_LE(measure(0, 0, ConnectivityCodec::paper).bits_per_hexahedron, 1.93);
  EXPECT_LE(measure(50, 0, ConnectivityCodec::paper).bits_per_hexahedron, 1.35);
}

TEST(PaperFigures, GridWithoutDelay) {
  const Rates lossless = measure(0, 0);
  EXPECT_LE(lossless.bits_per_hexahedron, 0.11);
  EXPECT_LE(lossless.bits_per_vertex, 19.5);
  EXPECT_LE(measure(0, 16).bits_per_vertex, 0.4);
}

TEST(PaperFigures, GridWithDelayOf50) {
  const Rates rates = measure(50, 0);
  EXPECT_LE(rates.bits_per_hexahedron, 1.35);
  EXPECT_LE(rates.bits_per_vertex, 19.5);
  EXPECT_LE(measure(50, 16).bits_per_vertex, 0.4);
}

}  // namespace
}  // namespace shm
