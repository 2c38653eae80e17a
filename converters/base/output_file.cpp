#include "base/output_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <type_traits>
#include <utility>

#include "base/byte_order.h"
#include "base/failure.h"
#include "base/stored_value.h"

namespace shm::converters {
namespace {

// Names of the files that the signal handler removes. The objects that registered the names own the
// strings.
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
  std::error_code none;
  const auto status = std::filesystem::status(path_, none);
  if (std::filesystem::is_directory(status)) throw Failure(ErrorCode::output, "is a folder", path_);
  is_stream_ = path_ == "-" ||
               (std::filesystem::exists(status) && !std::filesystem::is_regular_file(status));
  const RemovedOnSignals::Pause pause;
  sink_ = unwrap(
      is_stream_ ? FileSink::create_scratch(folder.empty() ? "." : folder, "standard-output", how)
                 : FileSink::create(path_, how),
      path_);
  if (sink_->is_named()) on_signals_.emplace(sink_->temporary().c_str());
}

OutputFile::~OutputFile() = default;

void OutputFile::write(std::span<const std::byte> bytes) { unwrap(sink_->write(bytes), path_); }

void OutputFile::commit() {
  if (is_stream_) {
    const auto all = unwrap(FileRandomSource::open(temporary()), path_);
    const auto out = unwrap(FileSink::create(path_), path_);
    unwrap(out->copy(*all, 0, all->size()), path_);
    return;
  }
  unwrap(sink_->commit(), path_);
  on_signals_.reset();
}

std::string OutputFile::folder_of(const std::string& path) {
  // `path` may be a link in /proc to an open file without a name. The target of such a link is a
  // path whose folder is the folder of the file.
  std::error_code none;
  const std::filesystem::path link = std::filesystem::read_symlink(path, none);
  return (path.starts_with("/proc/") && !none ? link : std::filesystem::path(path))
      .parent_path()
      .string();
}

void remove_outputs_on_signals() {
  // Signals that are ignored, e.g. because of nohup, stay ignored.
  for (const int number : kEndingSignals)
    if (std::signal(number, remove_and_die) == SIG_IGN) std::signal(number, SIG_IGN);
}

namespace {

constexpr std::size_t kFlushBytes = std::size_t{1} << 18;
constexpr std::size_t kLongestNumber = 32;  // "-2.2250738585072014e-308" has 24 characters

}  // namespace

NumberOutput::NumberOutput(const std::string& path, bool binary) : path_(path), binary_(binary) {
  descriptor_ = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor_ < 0) fail("cannot create it");
  buffer_.reserve(kFlushBytes);
}

NumberOutput::~NumberOutput() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

void NumberOutput::fail(const char* what) const {
  throw Failure(ErrorCode::output, std::string(what) + ": " + std::strerror(errno), path_);
}

void NumberOutput::flush() {
  std::size_t done = 0;
  while (done < buffer_.size()) {
    const ssize_t n = ::write(descriptor_, buffer_.data() + done, buffer_.size() - done);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("cannot write it");
    done += static_cast<std::size_t>(n);
  }
  flushed_ += buffer_.size();
  buffer_.clear();
}

void NumberOutput::patch(std::uint64_t offset, std::string_view text) {
  if (offset >= flushed_) {
    std::copy(text.begin(), text.end(),
              buffer_.begin() + static_cast<std::ptrdiff_t>(offset - flushed_));
    return;
  }
  flush();
  while (!text.empty()) {
    const ssize_t n = ::pwrite(descriptor_, text.data(), text.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail("cannot write it");
    text.remove_prefix(static_cast<std::size_t>(n));
    offset += static_cast<std::uint64_t>(n);
  }
}

void NumberOutput::finish() {
  flush();
  const int closing = descriptor_;
  descriptor_ = -1;
  if (::close(closing) != 0) fail("cannot close it");
}

void NumberOutput::text(std::string_view text) {
  if (buffer_.size() + text.size() > kFlushBytes) flush();
  buffer_.insert(buffer_.end(), text.begin(), text.end());
}

template <class T>
void NumberOutput::number_text(const T* values, std::size_t count, std::size_t per_line) {
  for (std::size_t i = 0; i < count; ++i) {
    char word[kLongestNumber];
    T value;
    std::memcpy(&value, values + i, sizeof value);
    char* end = nullptr;
    if constexpr (sizeof(T) == 1) {
      end = std::to_chars(word, word + sizeof word, static_cast<int>(value)).ptr;
    } else {
      end = std::to_chars(word, word + sizeof word, value).ptr;
    }
    ++in_line_;
    const bool last = in_line_ == per_line;
    *end++ = last ? '\n' : ' ';
    if (last) in_line_ = 0;
    text({word, end});
  }
}

void NumberOutput::numbers(ScalarType type, const std::byte* values, std::size_t count,
                           std::size_t per_line) {
  const std::size_t bytes = count * scalar_bytes(type);
  if (binary_) {
    swapped_.assign(values, values + bytes);
    swap_from_file(swapped_.data(), count, scalar_bytes(type), true);
    text({reinterpret_cast<const char*>(swapped_.data()), bytes});
    return;
  }
  with_scalar(type, [&](auto zero) {
    number_text(reinterpret_cast<const decltype(zero)*>(values), count, per_line);
  });
}

}  // namespace shm::converters
