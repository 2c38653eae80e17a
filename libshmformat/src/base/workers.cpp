#include "base/workers.h"

#include <algorithm>
#include <system_error>

namespace shm {

unsigned thread_count(unsigned wanted) {
  if (!kHasThreads) return 1;
  return wanted != 0 ? wanted : std::max(1u, Thread::hardware_concurrency());
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
