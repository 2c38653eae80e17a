// Checks that the same mesh results in the same pixels on every machine, with every compiler and
// optimization. The test runs in the same builds as determinism_tests, and on other machines. The
// test compares the hashes of pictures with a table in this file. On a mismatch, it prints a new
// table. If the change is intended, replace the table with it.
#include <gtest/gtest.h>
#include <xxhash.h>

#include <array>
#include <cstdio>
#include <limits>
#include <map>
#include <string>

#include "picture/drawn_surface.h"
#include "picture/picture.h"
#include "support/feature_files.h"

namespace shm::converters {
namespace {

std::uint64_t hash_of(const Picture& picture) {
  static_assert(sizeof(Rgb) == 3);
  return XXH64(picture.image.pixels.data(), picture.image.pixels.size() * sizeof(Rgb), 0);
}

/// Returns the surface of a box that is bent by a simple rational function. Each side of the box is
/// a block.
DrawnSurface bent_box(std::uint32_t n) {
  DrawnSurface box = DrawnSurface::box(n, {3, 2, 1});
  for (std::size_t f = 0; f < box.blocks.size(); ++f)
    box.blocks[f] = static_cast<std::uint32_t>(f / n * 5 / n);
  for (std::size_t v = 0; v < box.xyz.size(); v += 3) {
    double* const at = &box.xyz[v];
    at[2] += at[0] * at[0] / 7 - at[1] / (at[0] + 3);
    at[1] += at[2] * at[0] / 11;
  }
  return box;
}

/// Returns edges, points, and polygons with many corners. The polygons intersect each other, and
/// some of them are not planar.
DrawnSurface scattered() {
  DrawnSurface mesh;
  PlainRandom random(5);
  const auto number = [&] { return static_cast<double>(random.below(1 << 20)) / (1 << 19); };
  for (int v = 0; v < 200; ++v) {
    const std::array<double, 3> at = {number(), number(), number()};  // evaluated in a fixed order
    mesh.add_vertex(at[0], at[1], at[2] / 3);
  }
  for (int f = 0; f < 120; ++f) {
    std::vector<std::uint32_t> corners(1 + random.below(6));
    for (std::uint32_t& corner : corners) corner = static_cast<std::uint32_t>(random.below(200));
    mesh.add_face(corners, static_cast<std::uint32_t>(random.below(25)));
  }
  return mesh;
}

std::map<std::string, std::uint64_t> drawn() {
  std::map<std::string, std::uint64_t> hashes;
  const auto add = [&](const char* name, const DrawnSurface& mesh, const PictureOptions& options,
                       const Colouring* colouring = nullptr) {
    const auto picture = draw_picture(mesh.surface(), options, colouring);
    ASSERT_TRUE(picture) << name;
    hashes[name] = hash_of(*picture);
  };
  PictureOptions usual, small, from_below, edges;
  small.width = small.height = 128;
  from_below.view = Vector{-3, 1, -.7};
  edges.edges = true;
  const DrawnSurface coarse = bent_box(6), fine = bent_box(90), many = scattered();
  add("bent box", coarse, usual);
  add("bent box, small", coarse, small);
  add("fine box, from below", fine, from_below);
  add("fine box, edges", fine, edges);
  add("scattered", many, usual);
  add("scattered, edges, small", many, [&] {
    PictureOptions both = small;
    both.edges = true;
    return both;
  }());

  std::vector<double> of_points(fine.xyz.size() / 3), of_faces(coarse.blocks.size());
  for (std::size_t v = 0; v < of_points.size(); ++v)
    of_points[v] = fine.xyz[3 * v] * fine.xyz[3 * v + 1] - 1 / (fine.xyz[3 * v + 2] + 9);
  of_points[1000] = std::numeric_limits<double>::quiet_NaN();
  for (std::size_t f = 0; f < of_faces.size(); ++f) of_faces[f] = static_cast<double>(f * f % 101);
  const Colouring smooth{"pressure [Pa]", true, of_points}, flat{"rank", false, of_faces};
  add("fine box, point data", fine, usual, &smooth);
  add("bent box, cell data, small", coarse, small, &flat);
  DrawnSurface sheet;
  sheet.add_sheet(7, 1, 2.5, {1.7, 1, .9});
  add("sheet", sheet, usual);
  DrawnSurface large = coarse;
  for (double& coordinate : large.xyz) coordinate *= 1e307;
  add("bent box, large numbers", large, usual);
  return hashes;
}

const std::map<std::string, std::uint64_t> kPinned = {
    {"bent box", 0xa68e3cad04193624},
    {"bent box, cell data, small", 0x682a174f48f455fb},
    {"bent box, large numbers", 0xa68e3cad04193624},
    {"bent box, small", 0xedfca2a33c6c1f2c},
    {"fine box, edges", 0xe9eec678af349bd9},
    {"fine box, from below", 0x64764e2579418d59},
    {"fine box, point data", 0xda578a61f1e1e37b},
    {"scattered", 0xc6cfbf222359d467},
    {"scattered, edges, small", 0x20ed81bab1e79bc1},
    {"sheet", 0x2f5b6e3bb19afa78},
};

TEST(PictureBytes, EveryCompilerDrawsTheSamePixels) {
  const auto found = drawn();
  EXPECT_EQ(found, kPinned);
  if (found != kPinned)
    for (const auto& [name, hash] : found)
      std::printf("    {\"%s\", 0x%llx},\n", name.c_str(), static_cast<unsigned long long>(hash));
}

}  // namespace
}  // namespace shm::converters
