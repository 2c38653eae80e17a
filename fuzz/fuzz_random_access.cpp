// Files with damage behind right checksums, read by their index: segments, steps, pieces. A value,
// an error; never a crash, never memory out of proportion. The first byte says which piece is asked
// for.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>
#include <vector>

#include "damaged_file.h"
#include "shm/mesh_extract.h"
#include "shm/segment_reader.h"
#include "shm/step_reader.h"

namespace {

void read_segments(shm::RandomSource& source) {
  auto reader = shm::SegmentReader::open(source, shm_fuzz::small_limits());
  if (!reader) return;
  for (std::size_t s = 0; s < reader->segments().size(); ++s)
    if (!reader->read(s)) return;
}

void read_steps(shm::RandomSource& source) {
  auto reader = shm::StepReader::open(source, shm_fuzz::small_limits());
  if (!reader) return;
  for (std::uint32_t a = 0; a < reader->schema().arrays.size(); ++a)
    for (std::uint64_t step = 0; step < 3; ++step) {
      shm::StepRequest request;
      request.array = a;
      request.step = step;
      const auto values = reader->read(request);
      if (!values) continue;
      const std::size_t stride = shm::scalar_bytes(reader->schema().arrays[a].type) *
                                 reader->schema().arrays[a].components;
      for (const shm::StepValues& it : *values)
        if (it.values.size() % stride != 0) std::abort();
    }
}

void read_piece(shm::RandomSource& source, std::uint8_t which) {
  auto reader = shm::MeshExtractor::open(source, shm_fuzz::small_limits());
  if (!reader) return;
  shm::ExtractRequest request;
  if (which % 3 == 1) request.cells.range = {which / 3u, which};
  if (which % 3 == 2) request.cells.box = {{-.5, -.5, -.5, .5, .5, which / 255.}};
  request.unused_vertices = which % 2 == 0;
  if (!reader->begin(request)) return;
  while (true) {
    auto item = reader->next();
    if (!item || !*item) return;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  // Of their very size, so that a read beyond the end is seen.
  const std::vector<std::byte> bytes(reinterpret_cast<const std::byte*>(data) + 1,
                                     reinterpret_cast<const std::byte*>(data) + size);
  shm::MemoryRandomSource source(bytes);
  read_segments(source);
  read_steps(source);
  read_piece(source, data[0]);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
