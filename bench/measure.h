// What the benchmark programs measure with: processor time and peak memory of this process,
// and how far values are off.
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

/// The quickest of as many runs as go into `seconds`, of two at least.
inline double quickest(double seconds, const std::function<void()>& run) {
  double best = 1e300, spent = 0;
  for (int runs = 0; runs < 2 || spent < seconds; ++runs) {
    const double took = seconds_of(run);
    best = std::min(best, took);
    spent += took;
  }
  return best;
}

/// Bytes of a line of /proc/self/status, such as "VmRSS"; 0 where there is none.
inline std::uint64_t status_bytes(const std::string& name) {
  std::ifstream status("/proc/self/status");
  std::uint64_t kilobytes = 0;
  for (std::string word; status >> word;)
    if (word == name + ":" && status >> kilobytes) break;
  return kilobytes * 1024;
}

/// By how much resident memory grows at most while `run` works, over what it is before.
inline std::uint64_t memory_of(const std::function<void()>& run) {
  malloc_trim(0);  // what earlier runs freed would be used again unseen
  if (std::FILE* file = std::fopen("/proc/self/clear_refs", "w")) {
    std::fputs("5", file);  // the peak begins anew
    std::fclose(file);
  }
  const std::uint64_t before = status_bytes("VmRSS");
  run();
  const std::uint64_t peak = status_bytes("VmHWM");
  return peak > before ? peak - before : 0;
}

/// Between two arrays of T, over what is finite in the first.
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
