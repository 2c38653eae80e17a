// Measures the allocations of a test program. This header replaces operator new and delete; include
// it in exactly one source file of a program.
#pragma once

#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <functional>
#include <new>

#if defined(_WIN32)
inline std::size_t malloc_usable_size(void* memory) {
  return memory == nullptr ? 0 : ::_msize(memory);
}
#endif

namespace {

// Size in bytes of the largest allocation since this variable was last set to 0.
std::size_t largest_allocation = 0;
// Number of bytes that are currently allocated, and the largest value of this number since the most
// recent call to memory_of().
std::atomic<std::size_t> allocated = 0, most_allocated = 0;

/// Runs `work` and returns the largest amount of memory, in bytes, that `work` had allocated at any
/// one time.
inline std::size_t memory_of(const std::function<void()>& work) {
  const std::size_t before = allocated;
  most_allocated = before;
  work();
  return most_allocated - before;
}

}  // namespace

// If this function were inlined, the compiler would warn that memory from malloc is freed with
// delete.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  largest_allocation = std::max(largest_allocation, bytes);
  void* memory = std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  const std::size_t now = allocated += ::malloc_usable_size(memory);
  if (now > most_allocated) most_allocated = now;
  return memory;
}
// std::stable_sort uses this operator. It is replaced because sanitizers require that it matches
// the operator delete below.
[[gnu::noinline]] void* operator new(std::size_t bytes, const std::nothrow_t&) noexcept {
  try {
    return operator new(bytes);
  } catch (const std::bad_alloc&) {
    return nullptr;
  }
}
[[gnu::noinline]] void operator delete(void* memory) noexcept {
  allocated -= ::malloc_usable_size(memory);
  std::free(memory);
}
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept {
  operator delete(memory);
}
