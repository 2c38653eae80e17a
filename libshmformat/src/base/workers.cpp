#include "base/workers.h"

#include <algorithm>
#include <atomic>
#include <system_error>

namespace shm {

unsigned thread_count(unsigned wanted) {
  if (!kHasThreads) return 1;
  return wanted != 0 ? wanted : std::max(1u, Thread::hardware_concurrency());
}

void in_threads(unsigned threads, std::size_t count, const std::function<void(std::size_t)>& work) {
  std::vector<Thrown> thrown(count);
  std::atomic<std::size_t> next = 0;
  const auto take_turns = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      try {
        work(i);
      } catch (...) {
        thrown[i] = caught();
      }
    }
  };
  {
    const std::size_t most = std::min<std::size_t>(threads, count);
    const Workers workers(most > 1 ? static_cast<unsigned>(most - 1) : 0, take_turns);
    take_turns();
  }
  for (const Thrown& exception : thrown)
    if (exception) throw_again(exception);
}

Workers::Workers(unsigned count, const std::function<void()>& work) {
  if (!kHasThreads) return;
  threads_.reserve(count);
  try {
    while (threads_.size() < count) threads_.emplace_back(work);
  } catch (const std::system_error&) {  // the system refuses to start more threads
  }
}

Workers::~Workers() {
  for (Thread& thread : threads_) thread.join();
}

}  // namespace shm
