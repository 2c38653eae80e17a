// The program whose instructions instructions_test.py counts. It encodes and decodes three
// generated meshes in memory, at each level, in one thread, and compares the decoded meshes. After
// each call to counted_run(), the program prints a line with these words: "counted", name of the
// mesh, number of hexahedra, level, and "encode" or "decode".
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "programs/mesh_families.h"
#include "programs/mesh_fields.h"
#include "shm/mesh.h"

// Calls the function whose instructions are counted. callgrind counts only while counted_run() is
// active, and recognizes counted_run() by its name. Therefore counted_run() does not end with a
// tail call, and is called through a pointer whose value no compiler can determine, so that
// compilers create no copies of counted_run() with other names.
extern "C" bool counted_run(const std::function<bool()>& run) {
  volatile bool ok = run();
  return ok;
}

namespace {

constexpr std::array<std::pair<const char*, shm::Level>, 3> kLevels = {
    {{"fast", shm::Level::fast}, {"default", shm::Level::standard}, {"best", shm::Level::best}}};
constexpr std::size_t kSteps = 2;
bool (*volatile counted)(const std::function<bool()>&) = counted_run;

make_mesh::Mesh made(std::string_view family, std::uint64_t cells) {
  for (const make_mesh::Family& each : make_mesh::families())
    if (each.name == family) return each.make(cells);
  return {};
}

/// Returns the mesh with coordinates as float64.
shm::Mesh mesh_of(const make_mesh::Mesh& from) {
  std::vector<std::array<double, 3>> points;
  for (const make_mesh::Point3& p : from.points) points.push_back({p.x, p.y, p.z});
  std::vector<std::array<std::uint64_t, 8>> cells;
  for (const make_mesh::Hexahedron& cell : from.cells)
    std::copy(cell.begin(), cell.end(), cells.emplace_back().begin());
  return shm::Mesh::of_hexahedra(points, cells);
}

/// Returns the mesh with coordinates as float32.
shm::Mesh with_floats(shm::Mesh mesh) {
  const std::vector<float> points = mesh.points_as<float>();
  const auto bytes = std::as_bytes(std::span(points));
  mesh.schema.coordinate_type = shm::ScalarType::float32;
  mesh.xyz.assign(bytes.begin(), bytes.end());
  return mesh;
}

/// Adds two float32 arrays. The values of the first are the same at all steps; the values of the
/// second increase from step to step.
void add_field(shm::Mesh& mesh, const make_mesh::Field& field, shm::Location location) {
  std::vector<float> values(field.values.begin(), field.values.end());
  mesh.add_array<float>(field.name, location, values);
  for (std::size_t step = 0; step < kSteps; ++step) {
    for (float& value : values) value *= 1.0625f;
    mesh.add_step<float>("growing " + field.name, location, step, values);
  }
  mesh.step_times.resize(kSteps);
  for (std::size_t step = 0; step < kSteps; ++step)
    mesh.step_times[step] = static_cast<double>(step);
}

shm::Mesh with_fields(const make_mesh::Mesh& from) {
  shm::Mesh mesh = with_floats(mesh_of(from));
  add_field(mesh, make_mesh::cell_fields(from, "one").front(), shm::Location::cell);
  add_field(mesh, make_mesh::point_fields(from, "full").front(), shm::Location::point);
  return mesh;
}

bool encode(shm::MemorySink& sink, const shm::Mesh& mesh, shm::Level level) {
  shm::WriteOptions options;
  options.level = level;
  options.threads = 1;
  return static_cast<bool>(shm::write_mesh(sink, mesh, options));
}
bool decode(std::span<const std::byte> bytes, shm::Mesh& mesh) {
  shm::MemorySource source(bytes);
  auto back = shm::read_mesh(source);
  if (back) mesh = std::move(*back);
  return static_cast<bool>(back);
}

bool count(const char* name, const shm::Mesh& mesh) {
  for (const auto& [word, level] : kLevels) {
    shm::MemorySink sink;
    shm::Mesh back;
    if (!counted([&, level = level] { return encode(sink, mesh, level); }) ||
        !counted([&] { return decode(sink.bytes, back); }) || back.corners != mesh.corners ||
        back.xyz != mesh.xyz || back.arrays != mesh.arrays || back.steps != mesh.steps) {
      std::fprintf(stderr, "%s is not restored correctly at level %s\n", name, word);
      return false;
    }
    for (const char* way : {"encode", "decode"})
      std::printf("counted,%s,%zu,%s,%s\n", name, mesh.cell_blocks.size(), word, way);
  }
  return true;
}

}  // namespace

int main() {
  return count("regular", with_floats(mesh_of(made("ogrid", 350)))) &&
                 count("irregular", mesh_of(made("tets", 648))) &&
                 count("fields", with_fields(made("shell", 150)))
             ? 0
             : 1;
}
