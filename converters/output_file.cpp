#include "output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <utility>

#include "failure.h"

namespace shm::converters {
namespace {

// What a signal handler may look at: the name of the open temporary file, owned by OutputFile.
std::atomic<const char*> open_temporary = nullptr;
static_assert(std::atomic<const char*>::is_always_lock_free);

extern "C" void remove_and_die(int signal_number) {
  if (const char* name = open_temporary.exchange(nullptr)) ::unlink(name);
  std::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

constexpr int kMostAttempts = 100;
constexpr int kEndingSignals[] = {SIGINT, SIGTERM, SIGHUP};

// Holds those signals back while the file is there and its name is not yet told.
class SignalPause {
 public:
  SignalPause() {
    sigset_t held;
    ::sigemptyset(&held);
    for (const int number : kEndingSignals) ::sigaddset(&held, number);
    ::pthread_sigmask(SIG_BLOCK, &held, &before_);
  }
  ~SignalPause() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  SignalPause(const SignalPause&) = delete;
  SignalPause& operator=(const SignalPause&) = delete;

 private:
  sigset_t before_;
};

std::string beside(const std::string& path, int attempt) {
  const std::size_t slash = path.rfind('/');
  const std::size_t name = slash == std::string::npos ? 0 : slash + 1;
  return path.substr(0, name) + "." + path.substr(name) + ".tmp" + std::to_string(::getpid()) +
         (attempt > 0 ? "-" + std::to_string(attempt) : "");
}

}  // namespace

OutputFile::OutputFile(std::string path) : path_(std::move(path)) {
  // Renaming over a device or a folder would do harm, or nothing.
  struct stat status {};
  if (::stat(path_.c_str(), &status) == 0 && !S_ISREG(status.st_mode))
    throw Failure(Error{ErrorCode::output, "is there, and is no regular file", {}, kNoOffset, path_});
  const SignalPause pause;
  // A killed process may have left its file under the same name.
  for (int attempt = 0; attempt < kMostAttempts && descriptor_ < 0; ++attempt) {
    temporary_ = beside(path_, attempt);
    descriptor_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor_ < 0 && errno != EEXIST) break;
  }
  if (descriptor_ < 0) fail("cannot create it");
  open_temporary = temporary_.c_str();
}

OutputFile::~OutputFile() {
  if (descriptor_ < 0) return;
  ::close(descriptor_);
  if (open_temporary.exchange(nullptr) != nullptr) ::unlink(temporary_.c_str());
}

void OutputFile::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("cannot write it");
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void OutputFile::commit() {
  // Whoever wrote by name has closed; flushing any descriptor of the file flushes all of it. A
  // writer that replaced the file left ours behind, so flush what the name says.
  const int named = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
  if (named < 0) fail("cannot reopen it");
  const int flushed = ::fsync(named);
  const int error = errno;
  ::close(named);
  errno = error;
  // Some file systems cannot flush (EINVAL); that is no failed write.
  if (flushed != 0 && error != EINVAL) fail("cannot flush it");
  if (std::rename(temporary_.c_str(), path_.c_str()) != 0) fail("cannot give it its name");
  open_temporary = nullptr;
}

void OutputFile::fail(const char* what) const {
  throw Failure(Error{
      ErrorCode::output, std::string(what) + ": " + std::strerror(errno), {}, kNoOffset, path_});
}

Result<void> OutputSink::write(std::span<const std::byte> bytes) {
  try {
    file_->write(bytes);
  } catch (const Failure& failure) {
    return failure.error();
  }
  return {};
}

void remove_outputs_on_signals() {
  // Who ignores a signal, as nohup does, goes on doing so.
  for (const int number : kEndingSignals)
    if (std::signal(number, remove_and_die) == SIG_IGN) std::signal(number, SIG_IGN);
}

}  // namespace shm::converters
