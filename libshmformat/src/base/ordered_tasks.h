// OrderedTasks: runs several tasks at the same time, but returns their outputs in order, as if the
// tasks had run one after the other. The caller passes inputs to the newest task, and receives
// first all outputs of the oldest task, then those of the next task, and so on. Two limits restrict
// the memory: one for inputs that wait for their task, one for outputs that wait for the caller.
//
// A single thread, the caller's thread, begins tasks, passes inputs and takes outputs. The inputs
// of one task are processed one at a time. Starting threads takes as long as coding a small mesh.
// As long as there is only one task with few inputs, next() therefore does the work in the caller's
// thread, without threads. It does the same if the system cannot start threads.
//
// Outputs depend only on the inputs, not on the number of threads. If a task throws (in this
// library only std::bad_alloc), next() rethrows the exception in the caller's thread, after all
// outputs of earlier tasks.
#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <functional>
#include <list>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "base/threads.h"
#include "base/workers.h"
#include "shm/result.h"

namespace shm {

template <class In, class Out>
class OrderedTasks {
 public:
  /// Function that receives an output and its size in bytes.
  using Emit = std::function<void(Out, std::size_t)>;

  class Task {
   public:
    virtual ~Task() = default;
    virtual Result<void> take(In& in, const Emit& emit) = 0;
    /// Ends the task. Called after the last input.
    virtual Result<void> end(const Emit& emit) = 0;
  };

  struct Limits {
    /// Limits in bytes for waiting inputs and for waiting outputs. Inputs and outputs that a thread
    /// is processing do not count.
    std::size_t in = 0, out = 0;

    /// Threads are started when the inputs exceed this number of bytes, or when a second task
    /// begins while an earlier task is unfinished.
    std::size_t alone = 0;
  };
  /// Uses at most `threads` threads.
  OrderedTasks(unsigned threads, const Limits& limits) : wanted_(threads), limits_(limits) {
    spares_.reserve(kSpares);
  }
  ~OrderedTasks() {
    {
      const std::lock_guard lock(mutex_);
      stopping_ = true;
    }
    wake_workers_.notify_all();
    workers_.reset();
  }
  OrderedTasks(const OrderedTasks&) = delete;
  OrderedTasks& operator=(const OrderedTasks&) = delete;

  /// Ends the newest task, if there is one, and begins `task`.
  void begin(std::unique_ptr<Task> task) {
    end();
    std::size_t count = 0;
    {
      const std::lock_guard lock(mutex_);
      jobs_.emplace_back();
      jobs_.back().task = std::move(task);
      count = jobs_.size();
    }
    if (count > 1) begin_threads();
  }
  void push(In in, std::size_t bytes) {
    pushed_ += std::min(bytes, limits_.alone - pushed_);
    if (pushed_ == limits_.alone) begin_threads();
    {
      const std::lock_guard lock(mutex_);
      in_bytes_ += bytes;
      jobs_.back().inputs.emplace_back(std::move(in), bytes);
    }
    wake_workers_.notify_all();
  }
  void end() {
    {
      const std::lock_guard lock(mutex_);
      if (jobs_.empty()) return;
      jobs_.back().ended = true;
    }
    wake_workers_.notify_all();
  }
  /// Returns an input object whose memory can be reused, or a new object if none is left.
  In spare() {
    const std::lock_guard lock(mutex_);
    if (spares_.empty()) return In();
    In in = std::move(spares_.back());
    spares_.pop_back();
    return in;
  }

  bool has_room() const {
    const std::lock_guard lock(mutex_);
    return in_bytes_ < limits_.in;
  }
  /// Returns true if no task has work left and no output is waiting for the caller.
  bool is_idle() {
    const std::lock_guard lock(mutex_);
    return !has_output() && !is_under_way();
  }

  enum class Wait { no, for_output, for_output_or_room };
  /// Returns the next output, or the error that a task reported instead. Returns nullopt if there
  /// is no output yet, or if no work is left. Without threads, nullopt means that no work is left.
  Result<std::optional<Out>> next(Wait wait) {
    Lock lock(mutex_);
    if (!has_threads()) {
      while (!has_output()) {
        Job* job = next_job();
        if (job == nullptr) break;
        work_on(*job, lock);
      }
    } else if (wait != Wait::no) {
      wake_caller_.wait(lock, [&] {
        return has_output() || !is_under_way() ||
               (wait == Wait::for_output_or_room && in_bytes_ < limits_.in);
      });
    }
    if (!has_output()) return std::optional<Out>();
    Job& job = jobs_.front();
    if (job.outputs.empty() && job.thrown) throw_again(job.thrown);
    if (job.outputs.empty()) return *job.error;
    std::optional<Out> out = std::move(job.outputs.front().first);
    out_bytes_ -= job.outputs.front().second;
    job.outputs.pop_front();
    lock.unlock();
    wake_workers_.notify_all();
    return out;
  }

 private:
  struct Job {
    std::unique_ptr<Task> task;
    std::deque<std::pair<In, std::size_t>> inputs;
    std::deque<std::pair<Out, std::size_t>> outputs;
    bool running = false, ended = false, closed = false;  // closed: Task::end() was called
    std::optional<Error> error;
    Thrown thrown;

    bool failed() const { return error || thrown; }
    bool is_done() const { return closed && !running && outputs.empty() && !failed(); }
    bool has_work() const { return !failed() && (!inputs.empty() || (ended && !closed)); }
  };

  /// Drops finished tasks. Returns true if the first remaining task has an output or has failed.
  bool has_output() {
    while (!jobs_.empty() && jobs_.front().is_done()) {
      jobs_.pop_front();
      // Another task is now the first task. The first task may continue even if the outputs exceed
      // their limit.
      wake_workers_.notify_all();
    }
    return !jobs_.empty() && (!jobs_.front().outputs.empty() || jobs_.front().failed());
  }
  bool is_under_way() const {
    for (const Job& job : jobs_)
      if (job.running || job.has_work()) return true;
    return false;
  }
  /// Returns the oldest task that can continue, or null. The first task can always continue once
  /// its outputs have been taken.
  Job* next_job() {
    for (Job& job : jobs_) {
      const bool may = out_bytes_ < limits_.out || (&job == &jobs_.front() && job.outputs.empty());
      if (!job.running && job.has_work() && may) return &job;
    }
    return nullptr;
  }

  bool has_threads() const { return workers_ && workers_->count() > 0; }
  void begin_threads() {
    if (!workers_) workers_ = std::make_unique<Workers>(wanted_, [this] { work(); });
  }

  void work() {
    Lock lock(mutex_);
    while (!stopping_) {
      if (Job* job = next_job())
        work_on(*job, lock);
      else
        wake_workers_.wait(lock);
    }
  }
  /// Processes the next input of a job, or calls the task's end(). The caller holds `lock`, which
  /// is released during this work.
  void work_on(Job& job, Lock& lock) {
    job.running = true;
    std::optional<In> in;
    if (job.inputs.empty()) {
      job.closed = true;
    } else {
      in = std::move(job.inputs.front().first);
      in_bytes_ -= job.inputs.front().second;
      job.inputs.pop_front();
    }
    lock.unlock();
    wake_caller_.notify_one();
    const Emit emit = [&](Out out, std::size_t bytes) {
      {
        const std::lock_guard guard(mutex_);
        out_bytes_ += bytes;
        job.outputs.emplace_back(std::move(out), bytes);
      }
      wake_caller_.notify_one();
    };
    Result<void> result;
    Thrown thrown;
    try {
      result = in ? job.task->take(*in, emit) : job.task->end(emit);
    } catch (...) {
      thrown = caught();
    }
    lock.lock();
    if (in && spares_.size() < spares_.capacity()) spares_.push_back(std::move(*in));
    if (!result) job.error = result.error();
    job.thrown = thrown;
    job.running = false;
    wake_workers_.notify_all();
    wake_caller_.notify_one();
  }

  static constexpr std::size_t kSpares = 16;

  unsigned wanted_;
  Limits limits_;
  // Total size in bytes of all inputs so far; not counted beyond limits_.alone.
  std::size_t pushed_ = 0;
  mutable Mutex mutex_;
  Condition wake_workers_, wake_caller_;
  // Jobs in the order of their tasks; a list, since the addresses of jobs must not change.
  std::list<Job> jobs_;
  std::vector<In> spares_;
  std::size_t in_bytes_ = 0, out_bytes_ = 0;
  bool stopping_ = false;
  /// Threads, or null until threads are needed. This must be the last member, since the threads use
  /// all other members.
  std::unique_ptr<Workers> workers_;
};

}  // namespace shm
