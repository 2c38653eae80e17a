#include "tool/running/processes.h"

#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include "base/failure.h"
#include "tool/progress_line.h"
#include "tool/support.h"

namespace shm::converters {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using ScratchFile = std::unique_ptr<std::FILE, CloseFile>;

ScratchFile scratch() {
  ScratchFile file(std::tmpfile());
  if (!file && errno == ENOMEM) throw std::bad_alloc();
  if (!file) throw Failure(ErrorCode::output, "cannot create a temporary file");
  return file;
}

std::string content(std::FILE* file) {
  std::string text;
  std::rewind(file);
  char piece[4096];
  while (const std::size_t count = std::fread(piece, 1, sizeof piece, file))
    text.append(piece, count);
  return text;
}

// A task that has been started and has not yet been passed to the callback `done`.
struct Running {
  FileTask* task;
  ScratchFile out, error;
  pid_t process = -1;    // process id, or -1 if the process has not started or has ended
  std::size_t slot = 0;  // index of the task's share in SharedShares
};

// Array in shared memory, in which each child process stores the completed fraction of its work.
class SharedShares {
 public:
  using Share = std::atomic<std::uint32_t>;
  static_assert(Share::is_always_lock_free);

  explicit SharedShares(std::size_t count) : bytes_(count * sizeof(Share)) {
    void* const memory =
        ::mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    shares_ = static_cast<Share*>(memory);
  }
  ~SharedShares() { ::munmap(shares_, bytes_); }
  SharedShares(const SharedShares&) = delete;
  SharedShares& operator=(const SharedShares&) = delete;
  Share& operator[](std::size_t i) { return shares_[i]; }
  const Share& operator[](std::size_t i) const { return shares_[i]; }

 private:
  std::size_t bytes_;
  Share* shares_ = nullptr;
};

class Processes {
 public:
  Processes(unsigned jobs, const std::function<int(const FileTask&, unsigned)>& work,
            const std::function<void(const FileTask&, const Printed&)>& done,
            const TasksProgress& progress, std::uint64_t bytes)
      : jobs_(jobs), work_(work), done_(done), progress_(progress), bytes_(bytes), shares_(jobs) {}
  ~Processes() {
    for (const Running& one : begun_)
      if (one.process > 0) ::kill(one.process, SIGTERM);
    // The output of processes that are still running is discarded, because showing it could need
    // memory that is not available.
    for (const Running& one : begun_)
      while (one.process > 0 && ::waitpid(one.process, nullptr, 0) < 0 && errno == EINTR) {
      }
  }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  void begin(FileTask& task) {
    const bool is_done = !task.refusal || !task.passed_over.empty();
    const bool alone = task.bytes >= kSmallFile;
    while (!is_done && running_ >= (alone ? 1 : jobs_)) end_one();
    begun_.push_back({&task, nullptr, nullptr, -1, 0});
    if (is_done) return hand_on();
    start(begun_.back(), alone ? jobs_ : 1);
    if (alone) end_one();
  }
  void end() {
    while (running_ > 0) end_one();
    hand_on();
  }

 private:
  void start(Running& one, unsigned threads) {
    one.out = scratch();
    one.error = scratch();
    std::fflush(stdout);
    std::fflush(stderr);
    const pid_t parent = ::getpid();
    one.slot = free_slot();
    shares_[one.slot] = 0;
    one.process = ::fork();
    if (one.process < 0)
      throw Failure(ErrorCode::over_limit,
                    std::string("cannot start a process: ") + std::strerror(errno),
                    one.task->input);
    if (one.process > 0) {
      ++running_;
      return;
    }
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(kBadOutput);
    ProgressLine::report_to(&shares_[one.slot]);
    ::dup2(::fileno(one.out.get()), STDOUT_FILENO);
    ::dup2(::fileno(one.error.get()), STDERR_FILENO);
    const int code = work_(*one.task, threads);
    std::fflush(stdout);
    std::fflush(stderr);
    ::_exit(code);
  }

  std::size_t free_slot() const {
    std::vector<bool> taken(jobs_);
    for (const Running& one : begun_)
      if (one.process > 0) taken[one.slot] = true;
    return static_cast<std::size_t>(std::find(taken.begin(), taken.end(), false) - taken.begin());
  }

  void show_progress() const {
    double bytes = static_cast<double>(ended_bytes_);
    for (const Running& one : begun_)
      if (one.process > 0)
        bytes += static_cast<double>(one.task->bytes) * shares_[one.slot].load() / 65536;
    progress_(ended_, bytes / std::max(1.0, static_cast<double>(bytes_)));
  }

  // Waits until a process ends and returns its id. Sets `status` as waitpid() does.
  pid_t next_end(int& status) const {
    if (!progress_) return ::waitpid(-1, &status, 0);
    while (true) {
      const pid_t ended = ::waitpid(-1, &status, WNOHANG);
      if (ended != 0) return ended;
      show_progress();
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  void wait_for_one() {
    int status = 0;
    const pid_t ended = next_end(status);
    if (ended < 0 && errno == EINTR) return;
    for (Running& one : begun_) {
      if (one.process != ended) continue;
      one.process = -1;
      --running_;
      ++ended_;
      ended_bytes_ += one.task->bytes;
      if (WIFEXITED(status)) {
        one.task->code = WEXITSTATUS(status);
        return;
      }
      // If the process was ended by SIGKILL, the system has probably run out of memory.
      const int signal = WTERMSIG(status);
      one.task->code = signal == SIGKILL ? kLimit : kBadInput;
      std::fprintf(one.error.get(), "shm: %s: the process was ended by a signal: %s\n",
                   one.task->input.c_str(), ::strsignal(signal));
    }
  }
  void end_one() {
    wait_for_one();
    hand_on();
  }

  // Passes the tasks that have ended to `done`, in their order. Stops at the first task that has
  // not ended.
  void hand_on() {
    while (!begun_.empty() && begun_.front().process < 0) {
      const Running one = std::move(begun_.front());
      begun_.pop_front();
      done_(*one.task,
            one.out ? Printed{content(one.out.get()), content(one.error.get())} : Printed{});
    }
  }

  unsigned jobs_;
  const std::function<int(const FileTask&, unsigned)>& work_;
  const std::function<void(const FileTask&, const Printed&)>& done_;
  const TasksProgress& progress_;
  std::uint64_t bytes_, ended_bytes_ = 0;
  std::size_t ended_ = 0;
  SharedShares shares_;
  std::deque<Running> begun_;
  unsigned running_ = 0;
};

}  // namespace

void run_each(std::span<FileTask> tasks, unsigned jobs,
              const std::function<int(const FileTask&, unsigned threads)>& work,
              const std::function<void(const FileTask&, const Printed&)>& done,
              const TasksProgress& progress) {
  std::uint64_t bytes = 0;
  for (const FileTask& task : tasks)
    if (task.refusal && task.passed_over.empty()) bytes += task.bytes;
  Processes processes(jobs, work, done, progress, bytes);
  for (FileTask& task : tasks) processes.begin(task);
  processes.end();
}

}  // namespace shm::converters
