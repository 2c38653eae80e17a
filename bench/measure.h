// Measurements for the benchmark programs: CPU time and peak memory of this process, and errors of
// decoded values.
#pragma once

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <span>
#include <string>

namespace shm::bench {

inline double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

inline double seconds_of(const std::function<void()>& run) {
  const double start = processor_seconds();
  run();
  return processor_seconds() - start;
}

/// Calls `run` repeatedly for `seconds`, but at least twice. Returns the CPU time of the fastest
/// call in seconds.
inline double quickest(double seconds, const std::function<void()>& run) {
  double best = 1e300, spent = 0;
  for (int runs = 0; runs < 2 || spent < seconds; ++runs) {
    const double took = seconds_of(run);
    best = std::min(best, took);
    spent += took;
  }
  return best;
}

/// Returns the size in bytes in the line `name` of /proc/self/status, e.g. "VmRSS"; 0 if there is
/// no such line.
inline std::uint64_t status_bytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  std::uint64_t kilobytes = 0;
  for (std::string word; status >> word;)
    if (word == name + ":" && status >> kilobytes) break;
  return kilobytes * 1024;
}

/// Returns the peak resident memory during the call to `run`, minus the resident memory before the
/// call, in bytes.
inline std::uint64_t memory_of(const std::function<void()>& run) {
  // Without malloc_trim(), `run` could reuse memory that was freed earlier, and this memory would
  // not be counted.
  malloc_trim(0);
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w")) {
    std::fputs("5", file);  // resets the peak of resident memory
    std::fclose(file);
  }
  const std::uint64_t before = status_bytes("VmRSS");
  run();
  const std::uint64_t peak = status_bytes("VmHWM");
  return peak > before ? peak - before : 0;
}

/// Returns the largest difference between the values of two arrays of type T. Values that are not
/// finite in the first array are ignored.
template <class T>
double largest_error(std::span<const std::byte> a, std::span<const std::byte> b) {
  double largest = 0;
  for (std::size_t at = 0; at < a.size(); at += sizeof(T)) {
    T x, y;
    std::memcpy(&x, a.data() + at, sizeof x);
    std::memcpy(&y, b.data() + at, sizeof y);
    if (std::isfinite(x))
      largest = std::max(largest, std::fabs(static_cast<double>(x) - static_cast<double>(y)));
  }
  return largest;
}

}  // namespace shm::bench
