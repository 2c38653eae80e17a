// Workers: a few threads. The one place of the library that starts any.
#pragma once

#include <functional>
#include <vector>

#include "bytes/threads.h"

namespace shm {

/// As many threads as the machine has where `wanted` is 0; else `wanted`. In a build without
/// threads 1.
unsigned thread_count(unsigned wanted);

class Workers {
 public:
  /// Starts up to `count` threads that each do `work`; fewer where the system has no more,
  /// none in a build without threads.
  Workers(unsigned count, const std::function<void()>& work);
  /// Must hold: `work` returns by itself soon.
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  std::size_t count() const { return threads_.size(); }

 private:
  std::vector<Thread> threads_;
};

}  // namespace shm
