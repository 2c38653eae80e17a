// shm_make_tet_mesh POINTS OUT.vtk: generates an irregular hexahedral mesh for tests and
// benchmarks. TetGen connects random points in the unit cube to form tetrahedra. Each tetrahedron
// is split into four hexahedra, one per corner. The new vertices are the midpoints of the edges,
// the centres of the faces and the centre of the tetrahedron. The result is deterministic. This is
// a separate program, because TetGen's licence is the AGPL.
#define TETLIBRARY  // use tetgen.h as a library
#include <tetgen.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

namespace {

using Point = std::array<double, 3>;
using Hexahedron = std::array<std::uint32_t, 8>;

struct HexMesh {
  std::vector<Point> points;
  std::vector<Hexahedron> cells;
};

void tetrahedralize_points(std::uint64_t count, tetgenio& out) {
  tetgenio in;
  std::mt19937_64 random(1);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  in.numberofpoints = static_cast<int>(count + 8);
  in.pointlist = new REAL[static_cast<std::size_t>(in.numberofpoints) * 3];
  for (int i = 0; i < in.numberofpoints; ++i)
    for (int c = 0; c < 3; ++c)
      in.pointlist[3 * i + c] = i < 8 ? static_cast<double>(i >> c & 1) : uniform();
  char quiet[] = "Q";
  tetrahedralize(quiet, &in, &out);
}

// Creates the vertices at the centres of edges, faces and tetrahedra. Tetrahedra that share an edge
// or a face also share the vertex at its centre.
class Middles {
 public:
  explicit Middles(HexMesh& mesh) : mesh_(&mesh) {}
  template <std::size_t kCorners>
  std::uint32_t of(std::array<std::uint32_t, kCorners> corners) {
    std::sort(corners.begin(), corners.end());
    std::array<std::uint32_t, 4> key{~0u, ~0u, ~0u, ~0u};
    std::copy(corners.begin(), corners.end(), key.begin());
    const auto [place, fresh] =
        known_.try_emplace(key, static_cast<std::uint32_t>(mesh_->points.size()));
    if (fresh) {
      Point middle{};
      for (std::uint32_t corner : corners)
        for (std::size_t c = 0; c < 3; ++c) middle[c] += mesh_->points[corner][c];
      for (double& v : middle) v /= static_cast<double>(kCorners);
      mesh_->points.push_back(middle);
    }
    return place->second;
  }

 private:
  HexMesh* mesh_;
  std::map<std::array<std::uint32_t, 4>, std::uint32_t> known_;
};

HexMesh split_in_four(const tetgenio& tets) {
  HexMesh mesh;
  for (int i = 0; i < tets.numberofpoints; ++i)
    mesh.points.push_back(
        {tets.pointlist[3 * i], tets.pointlist[3 * i + 1], tets.pointlist[3 * i + 2]});
  // For each corner of a tetrahedron, the other three corners. Seen from the first corner, these
  // three are always in the same rotational order (clockwise or counter-clockwise).
  constexpr std::array<std::array<std::size_t, 3>, 4> kOthers = {
      {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
  Middles middle(mesh);
  for (int t = 0; t < tets.numberoftetrahedra; ++t) {
    std::array<std::uint32_t, 4> v{};
    for (int i = 0; i < 4; ++i)
      v[static_cast<std::size_t>(i)] = static_cast<std::uint32_t>(tets.tetrahedronlist[4 * t + i]);
    for (std::size_t i = 0; i < 4; ++i) {
      const std::uint32_t o = v[i], a = v[kOthers[i][0]], b = v[kOthers[i][1]],
                          d = v[kOthers[i][2]];
      using Two = std::array<std::uint32_t, 2>;
      using Three = std::array<std::uint32_t, 3>;
      mesh.cells.push_back({o, middle.of(Two{o, a}), middle.of(Three{o, a, b}),
                            middle.of(Two{o, b}), middle.of(Two{o, d}), middle.of(Three{o, a, d}),
                            middle.of(v), middle.of(Three{o, b, d})});
    }
  }
  return mesh;
}

void put_big_endian(std::FILE* file, std::uint64_t value, int bytes) {
  for (int shift = 8 * (bytes - 1); shift >= 0; shift -= 8)
    std::fputc(static_cast<int>(value >> shift & 0xff), file);
}

bool write_vtk(const HexMesh& mesh, const std::string& path) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (file == nullptr) return false;
  const std::size_t cells = mesh.cells.size();
  std::fprintf(file, "# vtk DataFile Version 4.2\ntetrahedra split in four\nBINARY\n");
  std::fprintf(file, "DATASET UNSTRUCTURED_GRID\nPOINTS %zu double\n", mesh.points.size());
  for (const Point& point : mesh.points)
    for (double v : point) put_big_endian(file, std::bit_cast<std::uint64_t>(v), 8);
  std::fprintf(file, "\nCELLS %zu %zu\n", cells, 9 * cells);
  for (const Hexahedron& cell : mesh.cells) {
    put_big_endian(file, 8, 4);
    for (std::uint32_t corner : cell) put_big_endian(file, corner, 4);
  }
  std::fprintf(file, "\nCELL_TYPES %zu\n", cells);
  for (std::size_t i = 0; i < cells; ++i) put_big_endian(file, 12, 4);
  const bool ok = std::ferror(file) == 0;
  return std::fclose(file) == 0 && ok;
}

}  // namespace

int main(int count, char** words) {
  const long points = count == 3 ? std::atol(words[1]) : 0;
  if (points < 1 || points > 100'000'000) {
    std::fprintf(stderr, "usage: shm_make_tet_mesh POINTS OUT.vtk\n");
    return 2;
  }
  tetgenio tets;
  tetrahedralize_points(static_cast<std::uint64_t>(points), tets);
  const HexMesh mesh = split_in_four(tets);
  if (!write_vtk(mesh, words[2])) {
    std::fprintf(stderr, "shm_make_tet_mesh: %s: cannot be written\n", words[2]);
    return 4;
  }
  std::printf("%zu vertices, %zu hexahedra\n", mesh.points.size(), mesh.cells.size());
  return 0;
}
