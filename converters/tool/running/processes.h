// Handles files one by one, each in a process of its own. A process cannot harm the work on another
// file, and libraries without thread support (HDF5) can be used in parallel.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "tool/running/file_list.h"

namespace shm::converters {

// Files below this size are handled side by side, with one thread each; larger files one at a time.
inline constexpr std::uint64_t kSmallFile = std::uint64_t{32} << 20;

// Output of a process.
struct Printed {
  std::string out, error;
};

// Receives the number of tasks that have ended, and the completed share of the bytes of all tasks.
using TasksProgress = std::function<void(std::size_t ended, double share)>;

// Runs `work` in a new process for each task that is neither refused nor passed over, with the
// number of threads it may use, and stores its result in the task's code. At most `jobs` processes
// run at a time. `done` is called for each task, in order; `progress`, which may be empty, about
// ten times a second. If this process ends, its child processes end too.
void run_each(std::span<FileTask> tasks, unsigned jobs,
              const std::function<int(const FileTask&, unsigned threads)>& work,
              const std::function<void(const FileTask&, const Printed&)>& done,
              const TasksProgress& progress = {});

}  // namespace shm::converters
