// Threads, the synchronization that they need, and exceptions that are passed between threads. Only
// this file differs between builds with and without threads. In a build without threads
// (SHM_THREADS=OFF), no thread can be started, callers do all work themselves, and no function
// waits.
#pragma once

#include <mutex>

#ifndef SHM_NO_THREADS

#include <condition_variable>
#include <exception>
#include <thread>

namespace shm {

inline constexpr bool kHasThreads = true;
using Thread = std::thread;
using Mutex = std::mutex;
using Lock = std::unique_lock<Mutex>;
using Condition = std::condition_variable;
/// Exception that was caught in one thread, to be thrown again in another thread.
using Thrown = std::exception_ptr;
inline Thrown caught() { return std::current_exception(); }
[[noreturn]] inline void throw_again(const Thrown& thrown) { std::rethrow_exception(thrown); }

}  // namespace shm

#else

#include <functional>

namespace shm {

inline constexpr bool kHasThreads = false;

class Thread {
 public:
  explicit Thread(const std::function<void()>& /*work*/) {}
  static unsigned hardware_concurrency() { return 1; }
  void join() {}
};

class Mutex {
 public:
  void lock() {}
  void unlock() {}
};

class Lock {
 public:
  explicit Lock(Mutex& /*mutex*/) {}
  void lock() {}
  void unlock() {}
};

class Condition {
 public:
  void notify_one() {}
  void notify_all() {}
  void wait(Lock& /*lock*/) {}
  template <class Predicate>
  void wait(Lock& /*lock*/, Predicate /*is_over*/) {}
};

class Thrown {
 public:
  explicit operator bool() const { return false; }
};
inline Thrown caught() { return {}; }
inline void throw_again(const Thrown& /*thrown*/) {}

}  // namespace shm

#endif
