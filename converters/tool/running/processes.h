// Handles files one by one, each in a separate process. A crash of one process does not affect the
// work on other files, and libraries without thread support (HDF5) can be used in parallel.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "tool/running/file_list.h"

namespace shm::converters {

// Size in bytes below which files are handled in parallel, with one thread each. Larger files are
// handled one at a time.
inline constexpr std::uint64_t kSmallFile = std::uint64_t{32} << 20;

// The text that a process has printed.
struct Printed {
  std::string out, error;
};

// Receives the number of tasks that have ended, and the completed share of the bytes of all tasks.
using TasksProgress = std::function<void(std::size_t ended, double share)>;

// Runs `work` in a new process for each task that is neither refused nor passed over. `work`
// receives the number of threads that it may use; its result becomes the exit code of the task. At
// most `jobs` processes run at a time. `done` is called for each task, in order. `progress`, which
// may be empty, is called about ten times a second. If this process ends, its child processes end
// too.
void run_each(std::span<FileTask> tasks, unsigned jobs,
              const std::function<int(const FileTask&, unsigned threads)>& work,
              const std::function<void(const FileTask&, const Printed&)>& done,
              const TasksProgress& progress = {});

}  // namespace shm::converters
