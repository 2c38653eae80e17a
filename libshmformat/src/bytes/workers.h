// Workers: a few threads. The one place of the library that starts any.
#pragma once

#include <functional>
#include <thread>
#include <vector>

namespace shm {

/// As many threads as the machine has where `wanted` is 0; else `wanted`.
unsigned thread_count(unsigned wanted);

class Workers {
 public:
  /// Starts up to `count` threads that each do `work`; fewer where the system has no more.
  Workers(unsigned count, const std::function<void()>& work);
  /// Must hold: `work` returns by itself soon.
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  std::size_t count() const { return threads_.size(); }

 private:
  std::vector<std::thread> threads_;
};

}  // namespace shm
