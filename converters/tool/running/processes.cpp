#include "tool/running/processes.h"

#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <memory>

#include "base/failure.h"
#include "tool/support.h"

namespace shm::converters {
namespace {

struct CloseFile {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using ScratchFile = std::unique_ptr<std::FILE, CloseFile>;

ScratchFile scratch() {
  ScratchFile file(std::tmpfile());
  if (!file)
    throw Failure(Error{ErrorCode::output, "no temporary file can be made", {}, kNoOffset, {}});
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

// A task that was begun and has not been handed on.
struct Running {
  FileTask* task;
  ScratchFile out, error;
  pid_t process = -1;  // -1: there is none, or it has ended
};

class Processes {
 public:
  Processes(unsigned jobs, const std::function<int(const FileTask&, unsigned)>& work,
            const std::function<void(const FileTask&, const Printed&)>& done)
      : jobs_(jobs), work_(work), done_(done) {}
  ~Processes() {
    for (const Running& one : begun_)
      if (one.process > 0) ::kill(one.process, SIGTERM);
    while (running_ > 0) wait_for_one();
  }
  Processes(const Processes&) = delete;
  Processes& operator=(const Processes&) = delete;

  void begin(FileTask& task) {
    const bool is_done = !task.refusal || !task.passed_over.empty();
    const bool alone = task.bytes >= kSmallFile;
    while (!is_done && running_ >= (alone ? 1 : jobs_)) end_one();
    begun_.push_back({&task, nullptr, nullptr, -1});
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
    one.process = ::fork();
    if (one.process < 0)
      throw Failure(Error{ErrorCode::over_limit,
                          std::string("no process: ") + std::strerror(errno),
                          {},
                          kNoOffset,
                          one.task->input});
    if (one.process > 0) {
      ++running_;
      return;
    }
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(kBadOutput);
    ::dup2(::fileno(one.out.get()), STDOUT_FILENO);
    ::dup2(::fileno(one.error.get()), STDERR_FILENO);
    const int code = work_(*one.task, threads);
    std::fflush(stdout);
    std::fflush(stderr);
    ::_exit(code);
  }

  void wait_for_one() {
    int status = 0;
    const pid_t ended = ::waitpid(-1, &status, 0);
    if (ended < 0 && errno == EINTR) return;
    for (Running& one : begun_) {
      if (one.process != ended) continue;
      one.process = -1;
      --running_;
      if (WIFEXITED(status)) {
        one.task->code = WEXITSTATUS(status);
        return;
      }
      // The system's own way to take memory back is SIGKILL.
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

  // What has ended and has nothing before it that has not.
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
  std::deque<Running> begun_;
  unsigned running_ = 0;
};

}  // namespace

void run_each(std::span<FileTask> tasks, unsigned jobs,
              const std::function<int(const FileTask&, unsigned threads)>& work,
              const std::function<void(const FileTask&, const Printed&)>& done) {
  Processes processes(jobs, work, done);
  for (FileTask& task : tasks) processes.begin(task);
  processes.end();
}

}  // namespace shm::converters
