#include "base/output_file.h"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <system_error>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

// What a signal handler may look at: names of files, owned by others.
std::array<std::atomic<const char*>, 4> names_to_remove{};
static_assert(std::atomic<const char*>::is_always_lock_free);

extern "C" void remove_and_die(int signal_number) {
  for (auto& place : names_to_remove)
    if (const char* name = place.exchange(nullptr)) ::unlink(name);
  std::signal(signal_number, SIG_DFL);
  ::raise(signal_number);
}

constexpr int kEndingSignals[] = {SIGINT, SIGTERM, SIGHUP};

}  // namespace

RemovedOnSignals::RemovedOnSignals(const char* name) : place_(0) {
  for (const char* none = nullptr; place_ < names_to_remove.size(); none = nullptr, ++place_)
    if (names_to_remove[place_].compare_exchange_strong(none, name)) return;
}
RemovedOnSignals::~RemovedOnSignals() {
  if (place_ < names_to_remove.size()) names_to_remove[place_] = nullptr;
}

RemovedOnSignals::Pause::Pause() {
  sigset_t held;
  ::sigemptyset(&held);
  for (const int number : kEndingSignals) ::sigaddset(&held, number);
  ::pthread_sigmask(SIG_BLOCK, &held, &before_);
}
RemovedOnSignals::Pause::~Pause() { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

OutputFile::OutputFile(std::string path, const std::string& folder, FileSink::Temporary how)
    : path_(std::move(path)) {
  // Renaming over a device or a folder would do harm, or nothing.
  std::error_code none;
  const auto status = std::filesystem::status(path_, none);
  if (path_ != "-" && std::filesystem::exists(status) && !std::filesystem::is_regular_file(status))
    throw Failure(
        Error{ErrorCode::output, "is there, and is no regular file", {}, kNoOffset, path_});
  const RemovedOnSignals::Pause pause;
  sink_ = unwrap(
      path_ == "-" ? FileSink::create_scratch(folder.empty() ? "." : folder, "standard-output", how)
                   : FileSink::create(path_, how),
      path_);
  if (sink_->is_named()) on_signals_.emplace(sink_->temporary().c_str());
}

OutputFile::~OutputFile() = default;

void OutputFile::write(std::span<const std::byte> bytes) { unwrap(sink_->write(bytes), path_); }

void OutputFile::commit() {
  if (path_ == "-") {
    const auto all = unwrap(FileRandomSource::open(temporary()), path_);
    const auto out = unwrap(FileSink::create(path_), path_);
    unwrap(out->copy(*all, 0, all->size()), path_);
    return;
  }
  unwrap(sink_->commit(), path_);
  on_signals_.reset();
}

std::string OutputFile::folder_of(const std::string& path) {
  // The link of an open file without a name leads to it.
  std::error_code none;
  const std::filesystem::path link = std::filesystem::read_symlink(path, none);
  return (path.starts_with("/proc/") && !none ? link : std::filesystem::path(path))
      .parent_path()
      .string();
}

void remove_outputs_on_signals() {
  // Who ignores a signal, as nohup does, goes on doing so.
  for (const int number : kEndingSignals)
    if (std::signal(number, remove_and_die) == SIG_IGN) std::signal(number, SIG_IGN);
}

}  // namespace shm::converters
