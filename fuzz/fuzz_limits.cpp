// Tests that memory stays within ReadLimits. Reads damaged files with small limits; the first byte
// of the input chooses some of them. Measures the peak of the memory that is allocated during
// reading. This peak must not exceed the total memory that the limits allow. With sanitizers, the
// peak includes the memory that zstd allocates; without sanitizers, it includes only memory from
// operator new.
#include <malloc.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <span>
#include <vector>

#include "damaged_file.h"
#include "shm/mesh_extract.h"
#include "shm/segment_reader.h"
#include "shm/step_reader.h"
#include "shm/summary.h"

#if defined(__SANITIZE_ADDRESS__)
#define SHM_FUZZ_HOOKS
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SHM_FUZZ_HOOKS
#endif
#endif

#ifdef SHM_FUZZ_HOOKS
extern "C" {
int __sanitizer_install_malloc_and_free_hooks(void (*on_malloc)(const volatile void*, std::size_t),
                                              void (*on_free)(const volatile void*));
std::size_t __sanitizer_get_allocated_size(const volatile void* memory);
}
#endif

namespace {

// These counters are not thread-safe. This is sufficient, because the target reads without
// additional threads.
thread_local bool counting = false;
std::size_t held = 0, most_held = 0;

void on_malloc(const volatile void*, std::size_t bytes) {
  if (!counting) return;
  held += bytes;
  most_held = std::max(most_held, held);
}
// Subtracts freed memory. The count cannot become negative if memory is freed that was allocated
// before counting began.
void on_free(std::size_t bytes) {
  if (counting) held -= std::min(held, bytes);
}
#ifdef SHM_FUZZ_HOOKS
void on_free_of(const volatile void* memory) {
  if (counting && memory != nullptr) on_free(__sanitizer_get_allocated_size(memory));
}
#endif

/// Runs `work`, and returns the maximum number of bytes that were allocated at the same time.
template <class Work>
std::size_t memory_of(Work&& work) {
#ifdef SHM_FUZZ_HOOKS
  static const bool hooked = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free_of) != 0;
  if (!hooked) std::abort();
#endif
  held = most_held = 0;
  counting = true;
  work();
  counting = false;
  return most_held;
}

shm::ReadLimits limits_of(std::uint8_t choice) {
  shm::ReadLimits limits;
  limits.max_active_vertices = std::uint64_t{16} << choice % 4 * 2;
  limits.max_chunk_bytes = limits.max_extra_bytes = std::uint64_t{1} << (10 + choice / 4 % 4 * 2);
  limits.max_group_bytes = std::uint64_t{1} << (10 + choice / 16 % 4 * 3);
  limits.max_arrays = limits.max_blocks = 24;
  limits.max_static_components = 64;
  limits.max_steps = 64;
  limits.max_segments = choice < 128 ? 64 : 2;
  return limits;
}

/// Returns the number of bytes that a reader may allocate under `limits`. This includes a fixed
/// amount for the tables that columns (the coders of arrays) and zstd allocate.
std::uint64_t allowed(const shm::ReadLimits& limits, std::size_t file) {
  constexpr std::uint64_t kTables = std::uint64_t{64} << 20, kPerComponent = 12 << 10;
  constexpr std::uint64_t kPerVertex = 1 << 10, kPerIndexByte = 64;
  return kTables + kPerComponent * limits.max_static_components +
         kPerVertex * limits.max_active_vertices +
         8 * (limits.max_chunk_bytes + limits.max_extra_bytes + limits.max_group_bytes) +
         kPerIndexByte * file;
}

template <class Work>
void check(const char* what, const shm::ReadLimits& limits, std::size_t file, Work&& work) {
  const std::size_t most = memory_of(work);
  if (std::getenv("SHM_FUZZ_TELL") != nullptr)
    std::fprintf(stderr, "%s: %zu of %llu bytes\n", what, most,
                 static_cast<unsigned long long>(allowed(limits, file)));
  if (most > allowed(limits, file)) std::abort();
}

void read_all(std::span<const std::byte> file, const shm::ReadLimits& limits) {
  shm::MemorySource source(file);
  auto reader = shm::Reader::open(source, limits);
  if (!reader) return;
  while (true) {
    const auto item = reader->next();
    if (!item || *item == nullptr) return;
  }
}

void read_pieces(shm::RandomSource& source, const shm::ReadLimits& limits) {
  if (auto segments = shm::SegmentReader::open(source, limits))
    for (std::size_t s = 0; s < segments->segments().size(); ++s) (void)segments->read(s);
  if (auto steps = shm::StepReader::open(source, limits))
    for (std::uint32_t a = 0; a < steps->schema().arrays.size(); ++a) {
      shm::StepRequest request;
      request.array = a;
      for (const std::uint64_t step : steps->steps(a)) {
        request.step = step;
        if (!steps->begin(request)) continue;
        while (true) {
          const auto values = steps->next();
          if (!values || *values == nullptr) break;
        }
      }
    }
  if (auto piece = shm::MeshExtractor::open(source, limits); piece && piece->begin({}))
    while (true) {
      const auto part = piece->next();
      if (!part || *part == nullptr) break;
    }
}

}  // namespace

#ifndef SHM_FUZZ_HOOKS
static void* taken(std::size_t bytes) {
  void* memory = std::malloc(bytes);
  if (memory != nullptr) on_malloc(memory, ::malloc_usable_size(memory));
  return memory;
}
static void given_back(void* memory) {
  on_free(::malloc_usable_size(memory));
  std::free(memory);
}
#include "own_new.h"
#endif

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto all = std::as_bytes(std::span(data, size)).subspan(1);
  const std::vector<std::byte> file(all.begin(), all.end());
  const shm::ReadLimits limits = limits_of(data[0]);
  shm::MemoryRandomSource source(file);
  check("Reader", limits, size, [&] { read_all(file, limits); });
  check("pieces", limits, size, [&] { read_pieces(source, limits); });
  check("summary", limits, size, [&] { (void)shm::read_summary(source, limits); });
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,
                                               std::size_t max_size, unsigned seed) {
  return shm_fuzz::mutate_input(data, size, max_size, seed);
}
