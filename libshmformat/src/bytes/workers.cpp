#include "bytes/workers.h"

#include <algorithm>
#include <system_error>

namespace shm {

unsigned thread_count(unsigned wanted) {
  return wanted != 0 ? wanted : std::max(1u, std::thread::hardware_concurrency());
}

Workers::Workers(unsigned count, const std::function<void()>& work) {
  threads_.reserve(count);
  try {
    while (threads_.size() < count) threads_.emplace_back(work);
  } catch (const std::system_error&) {  // there are no more threads
  }
}

Workers::~Workers() {
  for (std::thread& thread : threads_) thread.join();
}

}  // namespace shm
