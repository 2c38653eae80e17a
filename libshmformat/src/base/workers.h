// Workers: a group of threads; in_threads(): a loop that several threads share. No other file of
// the library starts threads.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "base/threads.h"

namespace shm {

/// Returns `wanted`, or the number of hardware threads if `wanted` is 0. Returns 1 in a build
/// without threads.
unsigned thread_count(unsigned wanted);

/// Calls work(i) for each i below `count`, in up to `threads` threads, one of which is the
/// caller's. Returns when all calls have returned. If calls throw, rethrows the exception of the
/// lowest i.
void in_threads(unsigned threads, std::size_t count, const std::function<void(std::size_t)>& work);

class Workers {
 public:
  /// Starts up to `count` threads. Each thread calls `work` once. Starts fewer threads if the
  /// system refuses to start more, and none in a build without threads.
  Workers(unsigned count, const std::function<void()>& work);
  /// Waits until all threads have ended. Precondition: each call to `work` returns soon without
  /// further action by the caller.
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  std::size_t count() const { return threads_.size(); }

 private:
  std::vector<Thread> threads_;
};

}  // namespace shm
