// Files one by one, each in a process of its own: what one does to its process harms no other, and
// libraries that know no threads (HDF5) work side by side.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "tool/running/file_list.h"

namespace shm::converters {

// Files of fewer bytes are worked on side by side, one thread each; larger ones alone.
inline constexpr std::uint64_t kSmallFile = std::uint64_t{32} << 20;

// What a process printed.
struct Printed {
  std::string out, error;
};

// Of all tasks: how many have ended, and what share of their bytes is done.
using TasksProgress = std::function<void(std::size_t ended, double share)>;

// Runs `work` in a new process for each task that is neither refused nor passed over, with the
// number of threads it may have, and sets the task's code to what it returns. Up to `jobs`
// processes at a time. `done` is called for each task, in their order,
// `progress`, which may be empty, some ten times a second. Where this process ends,
// they end too.
void run_each(std::span<FileTask> tasks, unsigned jobs,
              const std::function<int(const FileTask&, unsigned threads)>& work,
              const std::function<void(const FileTask&, const Printed&)>& done,
              const TasksProgress& progress = {});

}  // namespace shm::converters
