// Processes each file in a separate process. A crash of one process does not affect the work on
// other files. Several files can be processed in parallel even with libraries that are not thread
// safe, such as HDF5.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "tool/running/file_list.h"

namespace shm::converters {

// Files smaller than this size in bytes are processed in parallel, with one thread each. Larger
// files are processed one at a time.
inline constexpr std::uint64_t kSmallFile = std::uint64_t{32} << 20;

// The text that a process has printed.
struct Printed {
  std::string out, error;
};

// Called with the number of tasks that have ended, and with the completed fraction of the bytes of
// all tasks.
using TasksProgress = std::function<void(std::size_t ended, double share)>;

// Runs `work` in a new process for each task that is neither refused nor skipped. `threads` is the
// number of threads that `work` may use. The result of `work` becomes the exit code of the task. At
// most `jobs` processes run at the same time. In the calling process, `done` is called once for
// each task, in the order of the tasks. `progress` is called about ten times a second, unless it is
// empty. If the calling process ends, its child processes end, too.
void run_each(std::span<FileTask> tasks, unsigned jobs,
              const std::function<int(const FileTask&, unsigned threads)>& work,
              const std::function<void(const FileTask&, const Printed&)>& done,
              const TasksProgress& progress = {});

}  // namespace shm::converters
