// The only file of the library that meets the operating system.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "shm/io.h"

namespace shm {
namespace {

Error system_error(ErrorCode code, const std::string& what, const std::string& path) {
  return Error{code, what + ": " + std::strerror(errno), {}, kNoOffset, path};
}

}  // namespace

Result<void> ByteSink::copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) {
  constexpr std::uint64_t kPiece = std::uint64_t{1} << 20;
  std::vector<std::byte> piece;
  while (bytes > 0) {
    piece.resize(static_cast<std::size_t>(std::min(kPiece, bytes)));
    if (auto good = from.read_at(offset, piece); !good) return good;
    if (auto good = write(piece); !good) return good;
    offset += piece.size();
    bytes -= piece.size();
  }
  return {};
}

Result<void> MemorySink::write(std::span<const std::byte> more) {
  bytes.insert(bytes.end(), more.begin(), more.end());
  return {};
}

Result<std::size_t> MemorySource::read(std::span<std::byte> into) {
  const std::size_t n = std::min(into.size(), left_.size());
  std::copy_n(left_.begin(), n, into.begin());
  left_ = left_.subspan(n);
  return n;
}

Result<void> NullSink::write(std::span<const std::byte> more) {
  bytes += more.size();
  return {};
}

Result<std::unique_ptr<FileSink>> FileSink::create(const std::string& path) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->path_ = path;
  if (path == "-") {
    sink->descriptor_ = STDOUT_FILENO;
    return sink;
  }
  // A device or a pipe is written as it is: there is nothing to rename over.
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && !S_ISREG(status.st_mode)) {
    sink->descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (sink->descriptor_ < 0) return system_error(ErrorCode::output, "cannot be opened", path);
    return sink;
  }
  sink->temporary_ = path + ".part-" + std::to_string(::getpid());
  sink->descriptor_ =
      ::open(sink->temporary_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (sink->descriptor_ < 0) {
    sink->temporary_.clear();
    return system_error(ErrorCode::output, "cannot be created", path);
  }
  return sink;
}

FileSink::~FileSink() {
  if (path_ == "-") return;
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

Result<void> FileSink::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(ErrorCode::output, "cannot be written", path_);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

Result<void> FileSink::copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) {
  std::uint64_t done = 0;
  if (const auto* file = dynamic_cast<const FileRandomSource*>(&from))
    done = file->copy_to(descriptor_, offset, bytes);
  return ByteSink::copy(from, offset + done, bytes - done);
}

Result<void> FileSink::commit() {
  if (path_ == "-") return {};
  if (::fsync(descriptor_) != 0 && errno != EINVAL)
    return system_error(ErrorCode::output, "cannot be flushed", path_);
  if (::close(std::exchange(descriptor_, -1)) != 0)
    return system_error(ErrorCode::output, "cannot be closed", path_);
  if (temporary_.empty()) return {};
  if (::rename(temporary_.c_str(), path_.c_str()) != 0)
    return system_error(ErrorCode::output, "cannot be given its name", path_);
  temporary_.clear();
  return {};
}

Result<std::unique_ptr<FileSource>> FileSource::open(const std::string& path) {
  std::unique_ptr<FileSource> source(new FileSource());
  source->path_ = path;
  source->descriptor_ = path == "-" ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (source->descriptor_ < 0) return system_error(ErrorCode::io, "cannot be opened", path);
  return source;
}

FileSource::~FileSource() {
  if (descriptor_ >= 0 && path_ != "-") ::close(descriptor_);
}

Result<std::size_t> FileSource::read(std::span<std::byte> into) {
  while (true) {
    const ssize_t n = ::read(descriptor_, into.data(), into.size());
    if (n >= 0) return static_cast<std::size_t>(n);
    if (errno != EINTR) return system_error(ErrorCode::io, "cannot be read", path_);
  }
}

Result<void> MemoryRandomSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  if (offset > bytes_.size() || into.size() > bytes_.size() - offset)
    return Error{ErrorCode::truncated, "ends before it should", {}, bytes_.size(), {}};
  const auto from = bytes_.subspan(static_cast<std::size_t>(offset), into.size());
  std::copy(from.begin(), from.end(), into.begin());
  return {};
}

Result<void> SectionSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  if (offset > bytes_ || into.size() > bytes_ - offset)
    return Error{ErrorCode::truncated, "ends before it should", {}, offset_ + bytes_, {}};
  return whole_->read_at(offset_ + offset, into);
}

Result<std::size_t> SectionSource::read(std::span<std::byte> into) {
  const auto n = static_cast<std::size_t>(std::min<std::uint64_t>(into.size(), bytes_ - at_));
  if (auto good = read_at(at_, into.first(n)); !good) return good.error();
  at_ += n;
  return n;
}

Result<std::unique_ptr<FileRandomSource>> FileRandomSource::open(const std::string& path) {
  std::unique_ptr<FileRandomSource> source(new FileRandomSource());
  source->path_ = path;
  source->descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (source->descriptor_ < 0) return system_error(ErrorCode::io, "cannot be opened", path);
  const off_t end = ::lseek(source->descriptor_, 0, SEEK_END);
  if (end < 0) return system_error(ErrorCode::io, "cannot be sought in", path);
  source->size_ = static_cast<std::uint64_t>(end);
  return source;
}

FileRandomSource::~FileRandomSource() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

Result<void> FileRandomSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  while (!into.empty()) {
    const ssize_t n = ::pread(descriptor_, into.data(), into.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(ErrorCode::io, "cannot be read", path_);
    if (n == 0) return Error{ErrorCode::truncated, "ends before it should", {}, offset, path_};
    offset += static_cast<std::uint64_t>(n);
    into = into.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

std::uint64_t FileRandomSource::copy_to(int descriptor, std::uint64_t offset,
                                        std::uint64_t bytes) const {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 30;
  auto from = static_cast<off_t>(offset);
  std::uint64_t done = 0;
  while (done < bytes) {
    const auto wanted = static_cast<std::size_t>(std::min(kMost, bytes - done));
    const ssize_t n = ::copy_file_range(descriptor_, &from, descriptor, nullptr, wanted, 0);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) break;
    done += static_cast<std::uint64_t>(n);
  }
  return done;
}

}  // namespace shm
