// The hexahedra of a mesh in memory, loaded from a file of any format, and a function that writes
// them with a Writer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/failure.h"
#include "connectivity_coding.h"
#include "files/mesh_files.h"
#include "shm/writer.h"

namespace shm::bench {

struct BenchMesh {
  std::uint64_t vertices = 0;
  ScalarType coordinate_type = ScalarType::float32;
  std::vector<std::byte> xyz;          // coordinates; empty if they were not requested
  std::vector<std::uint32_t> corners;  // eight vertex indices per hexahedron, block after block
  std::vector<std::uint8_t> last_use;
  std::size_t hexahedra() const { return last_use.size(); }
};

inline BenchMesh load_hexahedra(const std::string& path, bool with_points) {
  converters::Spool spool(std::filesystem::temp_directory_path().string(), std::size_t{1} << 30);
  const auto source = converters::open_mesh(path, spool);
  const converters::MeshInfo& info = source->info();
  if (info.vertices > 0xffffffffu) throw std::runtime_error(path + ": more than 2^32 vertices");
  BenchMesh mesh;
  mesh.vertices = info.vertices;
  if (with_points) mesh.coordinate_type = info.schema.coordinate_type;
  std::vector<std::vector<std::uint32_t>> blocks(info.schema.blocks.size());
  converters::CellBatch batch;
  while (source->next_cells(batch, 65536))
    for (std::size_t i = 0; i < batch.size(); ++i) {
      if (info.schema.blocks[batch.blocks[i]].shape != CellShape::hexahedron) continue;
      for (std::uint64_t v : batch.cell(i).first(8))
        blocks[batch.blocks[i]].push_back(static_cast<std::uint32_t>(v));
    }
  for (const auto& block : blocks)
    mesh.corners.insert(mesh.corners.end(), block.begin(), block.end());
  mesh.last_use = last_uses(mesh.corners, mesh.vertices);
  if (with_points) {
    mesh.xyz.resize(mesh.vertices * 3 * scalar_bytes(mesh.coordinate_type));
    source->read_points(0, mesh.vertices, mesh.xyz.data());
  }
  return mesh;
}

template <class T>
T unwrap(Result<T> result) {
  if (!result) throw std::runtime_error(result.error().message());
  if constexpr (!std::is_void_v<T>) return std::move(*result);
}

/// Calls `run` and returns its result, the exit code for main(). If `run` throws an exception,
/// prints it to standard error and returns 1.
inline int run_reporting(const char* program, int (*run)(int, char**), int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const converters::Failure& failure) {
    std::fprintf(stderr, "%s: %s\n", program, failure.error().message().c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", program, error.what());
  }
  return 1;
}

/// Writes the mesh. Each vertex is passed to the Writer just before the first hexahedron that uses
/// it. If the mesh has no coordinates, all vertices are at the origin.
inline SizeReport write(const BenchMesh& mesh, ByteSink& sink, const WriteOptions& options) {
  Schema schema = hexahedra_schema();
  schema.coordinate_type = mesh.coordinate_type;
  const std::size_t xyz_bytes = 3 * scalar_bytes(mesh.coordinate_type);
  const std::vector<std::byte> origin(xyz_bytes);
  Writer writer = unwrap(Writer::create(sink, schema, options));
  std::vector<bool> added(mesh.vertices);
  std::array<std::uint64_t, 8> cell{};
  for (std::size_t c = 0; c < mesh.hexahedra(); ++c) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t v = mesh.corners[8 * c + i];
      cell[i] = v;
      if (added[v]) continue;
      added[v] = true;
      unwrap(writer.add_vertex(
          v, mesh.xyz.empty() ? origin : std::span(mesh.xyz).subspan(v * xyz_bytes, xyz_bytes)));
    }
    unwrap(writer.add_cell(0, cell, mesh.last_use[c]));
  }
  unwrap(writer.end_mesh());
  return unwrap(writer.finish());
}

}  // namespace shm::bench
