// Workers: a few threads. The library starts threads only here.
#pragma once

#include <functional>
#include <vector>

#include "base/threads.h"

namespace shm {

/// Returns `wanted`, or the number of hardware threads if `wanted` is 0. In a build without
/// threads: 1.
unsigned thread_count(unsigned wanted);

class Workers {
 public:
  /// Starts up to `count` threads, each of which calls `work`. Starts fewer if the system allows no
  /// more, and none in a build without threads.
  Workers(unsigned count, const std::function<void()>& work);
  /// Waits for the threads. Must hold: `work` returns soon without further action.
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  std::size_t count() const { return threads_.size(); }

 private:
  std::vector<Thread> threads_;
};

}  // namespace shm
