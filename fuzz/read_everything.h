// Reads a whole mesh, as a converter would, and checks the guarantees of MeshSource.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "mesh/mesh_source.h"

inline void read_everything(shm::converters::MeshSource& mesh) {
  constexpr std::uint64_t kPiece = 1000;
  const shm::converters::MeshInfo& info = mesh.info();
  std::vector<std::byte> values(kPiece * 3 * shm::scalar_bytes(info.schema.coordinate_type));
  for (std::uint64_t first = 0; first < info.vertices; first += kPiece)
    mesh.read_points(first, std::min(kPiece, info.vertices - first), values.data());

  shm::converters::CellBatch batch;
  std::uint64_t cells = 0;
  while (mesh.next_cells(batch, kPiece)) {
    cells += batch.size();
    for (const std::uint32_t block : batch.blocks)
      if (block >= info.schema.blocks.size()) std::abort();
    for (const std::uint64_t corner : batch.corners)
      if (corner >= info.vertices) std::abort();
  }
  if (cells != info.cells()) std::abort();

  for (std::size_t a = 0; a < info.schema.arrays.size(); ++a) {
    values.resize(kPiece * info.array_stride(a));
    const std::uint64_t steps = info.schema.arrays[a].per_step ? info.step_times.size() : 1;
    const std::uint64_t elements = info.array_elements(a);
    for (std::uint64_t step = 0; step < steps; ++step)
      for (std::uint64_t first = 0; first < elements; first += kPiece)
        mesh.read_array(a, step, first, std::min(kPiece, elements - first), values.data());
  }
}
