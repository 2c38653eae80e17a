// A complete mesh in memory, loaded from a file of any format: cells of all shapes, and all arrays.
// Also functions that write the mesh with a Writer and read it with a Reader. They use Order::keep
// and no delay buffer.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "shm/writer.h"

namespace shm::bench {

struct MeshArray {
  ArrayInfo info;
  std::vector<std::vector<std::byte>>
      steps;  // values of each time step, in the order of the mesh; a static array has one step
  std::size_t stride() const { return scalar_bytes(info.type) * info.components; }
};

struct ArrayMesh {
  ScalarType coordinate_type = ScalarType::float32;
  Quantization coordinate_quantization;
  std::uint64_t vertices = 0;
  std::vector<std::byte> xyz;
  std::vector<BlockInfo> blocks;
  std::vector<std::uint32_t> cell_blocks;  // for each cell: index of its block
  // Index in `corners` of the first corner of each cell. The last entry is the number of corners.
  std::vector<std::uint64_t> corner_begin = {0};
  std::vector<std::uint64_t> corners;
  std::vector<std::uint64_t>
      last_use;  // for each cell: bit i is set if no later cell uses the vertex at corner i
  // all vertices that cells use, in the order of their first use
  std::vector<std::uint64_t> births;
  // for each cell: number of different vertices that this cell and all earlier cells use
  std::vector<std::uint64_t> births_end;
  std::vector<MeshArray> arrays;

  std::size_t cells() const { return cell_blocks.size(); }
  std::span<const std::uint64_t> cell(std::size_t c) const {
    return std::span(corners).subspan(corner_begin[c], corner_begin[c + 1] - corner_begin[c]);
  }
};

ArrayMesh load_arrays(const std::string& path);

/// Memory for the decoded mesh, in its original order. The constructor allocates all of it, so that
/// reading spends no time on allocation.
struct ReadBack {
  ReadBack(const ArrayMesh& mesh, std::span<const MeshArray* const> arrays);
  std::vector<std::byte> xyz;
  std::vector<std::uint64_t> corners;
  std::vector<std::vector<std::vector<std::byte>>> arrays;  // decoded values, by array and step
};

/// Writes the mesh, with `arrays` as its only arrays.
SizeReport write(const ArrayMesh& mesh, std::span<const MeshArray* const> arrays, ByteSink& sink,
                 Level level);
void read(std::span<const std::byte> file, ReadBack& into);

/// Writes the mesh and arrays with time steps. Calls values(array, step) for all arrays of the
/// first step, then for all arrays of the second step, and so on. values() must return them in the
/// order of the mesh.
SizeReport write_series(
    const ArrayMesh& mesh, std::span<const ArrayInfo> arrays, std::uint64_t steps,
    const std::function<std::vector<std::byte>(std::size_t, std::uint64_t)>& values, ByteSink& sink,
    WriteOptions options);

}  // namespace shm::bench
