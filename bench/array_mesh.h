// A whole mesh of any format in memory, with cells of all kinds and all its arrays, and the way
// into a Writer and out of a Reader without any file format. Order::keep, no delay buffer.
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
  std::vector<std::vector<std::byte>> steps;  // values in the mesh's order; one if static
  std::size_t stride() const { return scalar_bytes(info.type) * info.components; }
};

struct ArrayMesh {
  ScalarType coordinate_type = ScalarType::float32;
  Quantization coordinate_quantization;
  std::uint64_t vertices = 0;
  std::vector<std::byte> xyz;
  std::vector<BlockInfo> blocks;
  std::vector<std::uint32_t> cell_blocks;         // of each cell
  std::vector<std::uint64_t> corner_begin = {0};  // cells + 1 offsets into corners
  std::vector<std::uint64_t> corners;
  std::vector<std::uint64_t> last_use;  // as in Writer::add_cell
  std::vector<std::uint64_t> births;    // vertices in the order in which cells use them, once each
  std::vector<std::uint64_t> births_end;  // by cell: how many there are by then
  std::vector<MeshArray> arrays;

  std::size_t cells() const { return cell_blocks.size(); }
  std::span<const std::uint64_t> cell(std::size_t c) const {
    return std::span(corners).subspan(corner_begin[c], corner_begin[c + 1] - corner_begin[c]);
  }
};

ArrayMesh load_arrays(const std::string& path);

/// What comes back, in the mesh's own order. Make it with room for all, so that reading takes no
/// time to find some.
struct ReadBack {
  ReadBack(const ArrayMesh& mesh, std::span<const MeshArray* const> arrays);
  std::vector<std::byte> xyz;
  std::vector<std::uint64_t> corners;
  std::vector<std::vector<std::vector<std::byte>>> arrays;  // [array][step]
};

/// The mesh and, of its arrays, only these.
SizeReport write(const ArrayMesh& mesh, std::span<const MeshArray* const> arrays, ByteSink& sink,
                 Level level);
void read(std::span<const std::byte> file, ReadBack& into);

/// The mesh and stepped arrays, of which one step at a time is asked for: values(array, step), in
/// the mesh's order; all arrays at a step, then the next step.
SizeReport write_series(
    const ArrayMesh& mesh, std::span<const ArrayInfo> arrays, std::uint64_t steps,
    const std::function<std::vector<std::byte>(std::size_t, std::uint64_t)>& values, ByteSink& sink,
    WriteOptions options);

}  // namespace shm::bench
