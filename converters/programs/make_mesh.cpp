// shm_make_mesh: generates hexahedral meshes of several families and any size, for the demo and the
// benchmarks. Writes binary legacy VTK 4.2. On one machine, the same arguments always result in the
// same file. On different machines, the last bit of a coordinate may differ, because
// implementations of sin and cos differ.
#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <string_view>

#include "programs/mesh_families.h"
#include "programs/mesh_file.h"

namespace make_mesh {
namespace {

struct Request {
  const Family* family = nullptr;
  std::uint64_t cells = 0;
  MeshFile file;
};

void print_usage(std::FILE* out) {
  std::fputs(
      "usage: shm_make_mesh FAMILY CELLS OUT.vtk [--double] [--fields none|one|basic|full]\n"
      "Writes a hexahedral mesh of about CELLS cells as binary legacy VTK.\n"
      "Families:\n",
      out);
  for (const Family& family : families())
    std::fprintf(out, "  %-9.*s %.*s\n", static_cast<int>(family.name.size()), family.name.data(),
                 static_cast<int>(family.meaning.size()), family.meaning.data());
  std::fputs(
      "Fields: one is a smooth temperature on cells; basic (the default) adds a material number, "
      "full\n"
      "velocity and turbulence on cells and a shock front on points.\n",
      out);
}

bool parse_cells(std::string_view text, std::uint64_t& cells) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), cells);
  // At most 90 % of kMaxCells cells may be requested, because families round the number of cells up
  // to whole layers.
  return error == std::errc() && end == text.data() + text.size() && cells > 0 &&
         cells <= kMaxCells / 10 * 9;
}

bool parse(int count, char** words, Request& request) {
  if (count < 4) return false;
  for (const Family& family : families())
    if (family.name == words[1]) request.family = &family;
  if (request.family == nullptr || !parse_cells(words[2], request.cells)) return false;
  request.file.title = request.family->name;
  request.file.path = words[3];
  for (int i = 4; i < count; ++i) {
    const std::string_view word = words[i];
    if (word == "--double")
      request.file.doubles = true;
    else if (word == "--fields" && i + 1 < count)
      request.file.fields = words[++i];
    else
      return false;
  }
  constexpr std::array<std::string_view, 4> kFields = {"none", "one", "basic", "full"};
  return std::find(kFields.begin(), kFields.end(), request.file.fields) != kFields.end();
}

int run(int count, char** words) {
  if (count == 2 && std::string_view(words[1]) == "--help") {
    print_usage(stdout);
    return 0;
  }
  Request request;
  if (!parse(count, words, request)) {
    print_usage(stderr);
    return 2;
  }
  const Mesh mesh = request.family->make(request.cells);
  if (!write_mesh(mesh, request.file)) {
    std::fprintf(stderr, "shm_make_mesh: %s could not be written\n", request.file.path);
    return 4;
  }
  std::printf("%s: %zu vertices, %zu hexahedra\n", request.file.path, mesh.points.size(),
              mesh.cells.size());
  return 0;
}

}  // namespace
}  // namespace make_mesh

int main(int count, char** words) { return make_mesh::run(count, words); }
