// Reads segments, time steps and pieces of damaged files with valid checksums, through the index of
// the file. Each call must return a value or an error. It must never crash, and its memory must be
// in proportion to the size of the input. The first byte of the input chooses the parts that are
// read.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <utility>
#include <vector>

#include "damaged_file.h"
#include "shm/boundary_surface.h"
#include "shm/damage.h"
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

void read_steps(shm::Result<shm::StepReader> reader) {
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
      for (const shm::StepValues& piece : *values)
        if (piece.values.size() % stride != 0) std::abort();
    }
}

std::vector<std::uint64_t> every_second(std::vector<std::uint64_t> numbers) {
  for (std::size_t i = 0; 2 * i < numbers.size(); ++i) numbers[i] = numbers[2 * i];
  numbers.resize((numbers.size() + 1) / 2);
  return numbers;
}

shm::ExtractRequest request_of(std::uint8_t which, const shm::MeshExtractor& reader) {
  shm::ExtractRequest request;
  switch (which % 9) {
    case 0: break;
    case 1: request.cells.range = {which / 9u, which}; break;
    case 2: request.cells.box = {{-.5, -.5, -.5, .5, .5, which / 255.}}; break;
    case 3: request.cells.numbers = {1, 3, 4, 9, which}; break;
    case 4: request.cells.blocks = {which / 128u}; break;
    case 5: request.vertices = {0, 2, 5, 6, which}; break;
    case 6:
      request.vertices = {0, 1, 2, 3};
      request.cells.box = {{-9, -9, -9, 9, 9, .5}};
      break;
    case 7:
      request.vertices = every_second(reader.vertex_numbers());
      request.arrays.emplace();
      break;
    default: request.cells.numbers = every_second(reader.cell_numbers());
  }
  request.unused_vertices = which / 9 % 2 == 0;
  return request;
}

/// Checks the guarantee that next() returns each vertex and each cell only once.
void read_piece(shm::MeshExtractor& reader, const shm::ExtractRequest& request) {
  if (!reader.begin(request)) return;
  std::size_t vertices = 0, cells = 0;
  while (true) {
    auto item = reader.next();
    if (!item) return;
    if (*item == nullptr) break;
    vertices += (*item)->vertex_count();
    cells += (*item)->cell_count();
  }
  const auto same = [](const std::vector<std::uint64_t>& numbers, std::size_t count) {
    return numbers.size() == count && std::is_sorted(numbers.begin(), numbers.end()) &&
           std::adjacent_find(numbers.begin(), numbers.end()) == numbers.end();
  };
  if (!same(reader.vertex_numbers(), vertices) || !same(reader.cell_numbers(), cells)) std::abort();
  for (std::uint32_t a = 0; a < reader.schema().arrays.size(); ++a) {
    const auto steps = reader.steps(a);
    if (!steps) continue;
    for (const std::uint64_t step : *steps) {
      if (!reader.begin_values(a, step)) break;
      while (true) {
        auto values = reader.next_values();
        if (!values || *values == nullptr) break;
      }
    }
  }
}

void read_pieces(shm::Result<shm::MeshExtractor> reader, std::uint8_t which) {
  if (!reader) return;
  (void)reader->extras();
  for (std::size_t s = 0; s < reader->segments().size(); ++s) {
    for (const std::uint32_t array : reader->lost_arrays(s))
      if (array >= reader->schema().arrays.size()) std::abort();
    (void)reader->segment_number(s);
  }
  (void)reader->step_times();
  for (const int more : {0, 1, 8}) {
    const auto now = static_cast<std::uint8_t>(which + more);
    read_piece(*reader, request_of(now, *reader));
  }
}

/// Finds boundary surfaces, reading through the index and from front to back, and checks that they
/// are valid.
void find_boundary(const std::vector<std::byte>& bytes, std::uint8_t which) {
  const shm::ReadLimits limits = shm_fuzz::small_limits();
  shm::BoundaryOptions options;
  options.max_bytes = std::uint64_t{1} << 26;
  for (std::uint32_t a = 0; a < which % 4u; ++a) options.arrays.push_back({a, which / 64u});
  shm::MemoryRandomSource anywhere(bytes);
  shm::MemorySource stream(bytes);
  for (const auto& surface : {shm::read_boundary(anywhere, options, limits),
                              shm::read_boundary(stream, options, limits)}) {
    if (!surface) continue;
    if (surface->face_begin.size() != surface->face_count() + 1 ||
        surface->face_begin.back() != surface->corners.size() ||
        !std::is_sorted(surface->face_begin.begin(), surface->face_begin.end()))
      std::abort();
    for (const std::uint32_t corner : surface->corners)
      if (corner >= surface->vertex_count()) std::abort();
  }
}

/// Restores a damaged file with write_in_order(), which rebuilds a lost index if all chunks can be
/// decoded. Checks that the outcome agrees with the damage report.
void judge(shm::RandomSource& source) {
  const shm::ReadLimits limits = shm_fuzz::small_limits();
  const auto report = shm::find_damage(source, limits);
  shm::MemorySink sink;
  const auto status = shm::write_in_order(source, sink, limits);
  if (!report) return;
  if (report->restorable && !status) std::abort();
  if (!status && !sink.bytes.empty()) std::abort();
  if (!status || report->restorable) return;
  if (!report->lacks_index) std::abort();
  shm::MemorySource written(sink.bytes);
  auto reader = shm::Reader::open(written, limits);
  if (!reader) std::abort();
  while (true) {
    const auto item = reader->next();
    if (!item) std::abort();
    if (!*item) break;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  // Copies the file into a buffer of exactly its size, so that a read beyond its end is detected.
  const std::vector<std::byte> bytes(reinterpret_cast<const std::byte*>(data) + 1,
                                     reinterpret_cast<const std::byte*>(data) + size);
  shm::MemoryRandomSource source(bytes);
  read_segments(source);
  const shm::ReadLimits limits = shm_fuzz::small_limits();
  read_steps(shm::StepReader::open(source, limits));
  read_steps(shm::StepReader::open_damaged(source, limits));
  read_pieces(shm::MeshExtractor::open(source, limits), data[0]);
  read_pieces(shm::MeshExtractor::open_damaged(source, limits), data[0]);
  find_boundary(bytes, data[0]);
  judge(source);
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
