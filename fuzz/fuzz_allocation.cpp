// Tests how the library behaves when memory runs out. The n-th allocation of the library or of zstd
// fails; in some runs, all later allocations fail too. Checks the guarantees of shm/result.h: a
// call throws std::bad_alloc or returns an Error, nothing leaks, and all objects can be destroyed.
// If a call succeeds although an allocation failed, its result must be the same as with enough
// memory. The first byte of the input chooses the allocations that fail.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <optional>
#include <span>
#include <vector>

#include "damaged_file.h"
#include "shm/appender.h"
#include "shm/mesh.h"
#include "shm/mesh_extract.h"
#include "shm/segment_reader.h"
#include "shm/step_reader.h"
#include "shm/summary.h"

namespace {

// For each thread: `allocations` counts the allocations, `fails_at` is the index of the allocation
// that fails, and `fails_on` states whether all later allocations fail, too.
thread_local std::uint64_t allocations = 0, fails_at = ~std::uint64_t{0};
thread_local bool fails_on = false, armed = false;

bool fails() {
  if (!armed) return false;
  const std::uint64_t now = allocations++;
  return now == fails_at || (fails_on && now > fails_at);
}

}  // namespace

// If SHM_WRAPPED_MALLOC is defined, the linker option --wrap replaces malloc and calloc with these
// functions, in the program and in statically linked code such as zstd. Without SHM_WRAPPED_MALLOC,
// only operator new fails.
#ifdef SHM_WRAPPED_MALLOC
extern "C" {
void* __real_malloc(std::size_t bytes);
void* __real_calloc(std::size_t count, std::size_t bytes);
void* __wrap_malloc(std::size_t bytes) { return fails() ? nullptr : __real_malloc(bytes); }
void* __wrap_calloc(std::size_t count, std::size_t bytes) {
  return fails() ? nullptr : __real_calloc(count, bytes);
}
}
#endif
static void* taken(std::size_t bytes) {
#ifndef SHM_WRAPPED_MALLOC
  if (fails()) return nullptr;
#endif
  return std::malloc(bytes);
}
static void given_back(void* memory) { std::free(memory); }
#include "own_new.h"

namespace {

using shm_fuzz::Bytes, shm_fuzz::Random;

/// Runs `work` once to count its allocations, and then several times with failing allocations.
/// `work` must return its result, or nothing if it fails.
template <class Work>
void check(Work&& work, Random& random) {
  allocations = 0;
  fails_at = ~std::uint64_t{0};
  armed = true;
  const auto right = work();
  armed = false;
  const std::uint64_t count = allocations;
  if (count == 0) return;
  for (int trial = 0; trial < 6; ++trial) {
    // In half of the trials, an early allocation fails, while objects are being created.
    fails_at = random() % (trial % 2 == 0 ? std::min<std::uint64_t>(count, 64) : count);
    fails_on = random() % 2 == 0;
    allocations = 0;
    armed = true;
    try {
      const auto now = work();
      armed = false;
      if (now && now != right) std::abort();
    } catch (const std::bad_alloc&) {
      armed = false;
    }
  }
}

std::optional<shm::Mesh> read(std::span<const std::byte> file) {
  shm::MemorySource source(file);
  auto mesh = shm::read_mesh(source, shm_fuzz::small_limits());
  if (!mesh) return std::nullopt;
  return std::move(*mesh);
}

std::optional<Bytes> write(const shm::Mesh& mesh) {
  shm::MemorySink sink;
  if (!shm::write_mesh(sink, mesh)) return std::nullopt;
  return std::move(sink.bytes);
}

std::optional<std::vector<std::uint64_t>> read_pieces(std::span<const std::byte> file) {
  shm::MemoryRandomSource source(file);
  std::vector<std::uint64_t> seen;
  auto segments = shm::SegmentReader::open(source, shm_fuzz::small_limits());
  if (!segments) return std::nullopt;
  for (std::size_t s = 0; s < segments->segments().size(); ++s) {
    const auto blocks = segments->read(s);
    if (!blocks) return std::nullopt;
    for (const shm::MeshBlock& block : *blocks) seen.push_back(block.cell_count());
  }
  auto steps = shm::StepReader::open(source, shm_fuzz::small_limits());
  if (!steps) return std::nullopt;
  for (std::uint32_t a = 0; a < steps->schema().arrays.size(); ++a)
    for (const std::uint64_t step : steps->steps(a)) {
      shm::StepRequest request;
      request.array = a;
      request.step = step;
      const auto values = steps->read(request);
      if (!values) return std::nullopt;
      for (const shm::StepValues& piece : *values) seen.push_back(piece.values.size());
    }
  auto piece = shm::MeshExtractor::open(source, shm_fuzz::small_limits());
  shm::ExtractRequest request;
  request.cells.range = {1, 5};
  if (!piece || !piece->begin(request)) return std::nullopt;
  while (true) {
    const auto part = piece->next();
    if (!part) return std::nullopt;
    if (*part == nullptr) break;
    seen.insert(seen.end(), (*part)->vertex_numbers.begin(), (*part)->vertex_numbers.end());
  }
  const auto summary = shm::read_summary(source, shm_fuzz::small_limits());
  if (!summary) return std::nullopt;
  seen.push_back(summary->totals.cells);
  return seen;
}

std::optional<Bytes> append(std::span<const std::byte> file) {
  shm::MemoryRandomSource source(file);
  shm::MemorySink sink;
  auto appender = shm::Appender::open(source, sink, {}, shm_fuzz::small_limits());
  if (!appender) return std::nullopt;
  for (std::uint32_t a = 0; a < appender->schema().arrays.size(); ++a) {
    const shm::ArrayInfo& info = appender->schema().arrays[a];
    if (!info.per_step || appender->elements(a) > 1 << 12) continue;
    const Bytes values(static_cast<std::size_t>(appender->elements(a)) * info.components *
                       shm::scalar_bytes(info.type));
    if (!appender->add_step_values(a, appender->steps(), values)) return std::nullopt;
  }
  if (!appender->finish()) return std::nullopt;
  return std::move(sink.bytes);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto all = std::as_bytes(std::span(data, size)).subspan(1);
  const Bytes file(all.begin(), all.end());
  Random random(data[0]);
  // After an allocation has failed, check() lets allocations succeed again before it destroys the
  // objects that are left.
  switch (data[0] % 4) {
    case 0: check([&] { return read(file); }, random); break;
    case 1: check([&] { return read_pieces(file); }, random); break;
    case 2: check([&] { return append(file); }, random); break;
    default:
      if (const auto mesh = read(file)) check([&] { return write(*mesh); }, random);
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
