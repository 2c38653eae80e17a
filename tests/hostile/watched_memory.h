// What a test program allocates. Replaces operator new and delete: for one source file of a
// program.
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

// The largest single allocation since it was last set to zero.
std::size_t largest_allocation = 0;
// Bytes that are allocated, and the most that were since it was last set.
std::atomic<std::size_t> allocated = 0, most_allocated = 0;

/// The most memory that `work` holds at once, in bytes.
inline std::size_t memory_of(const std::function<void()>& work) {
  const std::size_t before = allocated;
  most_allocated = before;
  work();
  return most_allocated - before;
}

}  // namespace

// Not inlined, or the compiler sees malloc and delete, and warns.
[[gnu::noinline]] void* operator new(std::size_t bytes) {
  largest_allocation = std::max(largest_allocation, bytes);
  void* memory = std::malloc(bytes > 0 ? bytes : 1);
  if (memory == nullptr) throw std::bad_alloc();
  const std::size_t now = allocated += ::malloc_usable_size(memory);
  if (now > most_allocated) most_allocated = now;
  return memory;
}
// What std::stable_sort takes: given back to the delete below, as sanitizers want to see.
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
