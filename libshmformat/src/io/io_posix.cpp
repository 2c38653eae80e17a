// Files on POSIX systems. In this library, only this file and io_windows.cpp call the operating
// system.
#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include "io/temporary_names.h"
#include "shm/io.h"

namespace shm {
namespace {

Error system_error(ErrorCode code, const std::string& what, const std::string& path) {
  return Error{.code = code, .detail = what + ": " + std::strerror(errno), .file = path};
}

/// Opens a file. If a signal interrupts the call, tries again. Interruptions are likely if the file
/// is a named pipe, since opening it waits until another process opens it, too.
int open_patiently(const std::string& path, int flags) {
  while (true) {
    const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
    if (descriptor >= 0 || errno != EINTR) return descriptor;
  }
}

/// Returns the index in `path` at which the file name begins.
std::size_t name_in(const std::string& path) {
  const std::size_t slash = path.rfind('/');
  return slash == std::string::npos ? 0 : slash + 1;
}

std::string folder_of(const std::string& path) {
  const std::size_t name = name_in(path);
  return name == 0 ? "." : path.substr(0, name);
}

/// Returns a name for the scope in which process numbers are unique: the machine, or a PID
/// namespace on the machine.
std::string name_of_machine() {
  struct utsname names {};
  (void)::uname(&names);
  std::string text = names.nodename;
  text.resize(text.size() + 64);
  (void)!::readlink("/proc/self/ns/pid", text.data() + text.size() - 64, 64);
  // The boot id distinguishes machines that have the same host name.
  if (const int boot = ::open("/proc/sys/kernel/random/boot_id", O_RDONLY | O_CLOEXEC); boot >= 0) {
    text.resize(text.size() + 36);
    (void)!::read(boot, text.data() + text.size() - 36, 36);
    ::close(boot);
  }
  return machine_name(text);
}

/// State of the process that created a temporary file. For a process on another machine, the state
/// cannot be determined, and is may_be_gone. `name`: the part of the file name after
/// temporary_front(), which identifies the process.
enum class Process { lives, may_be_gone, gone };
Process process_of(std::string_view name, std::string_view machine) {
  const auto maker = maker_of(name, machine);
  if (!maker) return Process::lives;
  if (!maker->here) return Process::may_be_gone;
  return ::kill(maker->process, 0) != 0 && errno == ESRCH ? Process::gone : Process::lives;
}

/// Removes temporary files for `path` if the processes that created them have been killed.
/// Temporary files from other machines are removed if they are more than an hour old.
void remove_leftovers(const std::string& path, const std::string& machine, std::int64_t now) {
  constexpr std::int64_t kOld = 3600;  // age in seconds
  const std::string folder = folder_of(path), front = temporary_front(path, name_in(path));
  const std::string_view head = std::string_view(front).substr(name_in(front));
  DIR* directory = ::opendir(folder.c_str());
  if (directory == nullptr) return;
  while (const dirent* entry = ::readdir(directory)) {
    const std::string_view name = entry->d_name;
    if (!name.starts_with(head)) continue;
    const Process process = process_of(name.substr(head.size()), machine);
    struct stat status {};
    const int folder_descriptor = ::dirfd(directory);
    if (process == Process::lives ||
        ::fstatat(folder_descriptor, entry->d_name, &status, AT_SYMLINK_NOFOLLOW) != 0 ||
        !S_ISREG(status.st_mode))
      continue;
    if (process == Process::gone || status.st_mtime < now - kOld)
      ::unlinkat(folder_descriptor, entry->d_name, 0);
  }
  ::closedir(directory);
}

std::string own_name(const std::string& path, const std::string& machine, int attempt) {
  return temporary_name(path, name_in(path), ::getpid(), machine, attempt);
}

Error taken_error(const std::string& path) {
  return Error{.code = ErrorCode::output, .detail = "exists already", .file = path};
}

Error busy_error(const std::string& path) {
  return Error{
      .code = ErrorCode::output, .detail = "is being written by another program", .file = path};
}

/// Returns true if a live file at this path is being written.
bool is_locked(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool locked = ::flock(file, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(file);
  return locked;
}

/// Flushes the folder that contains `path`, so that the file's name is stored on the disk, too. If
/// the folder cannot be opened or flushed (EINVAL), does nothing.
Result<void> flush_folder(const std::string& path) {
  const int descriptor = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return {};
  const bool flushed = ::fsync(descriptor) == 0 || errno == EINVAL;
  const Error error = system_error(ErrorCode::output,
                                   "is written, but the folder cannot be flushed: until the system "
                                   "flushes it, a crash may lose the file's name",
                                   path);
  ::close(descriptor);
  return flushed ? Result<void>() : error;
}

}  // namespace

// --- files that appear under their name only when complete

Result<std::unique_ptr<FileSink>> FileSink::create(const std::string& path, Temporary how,
                                                   Existing existing) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->path_ = path;
  sink->replaces_ = existing == Existing::replace;
  if (path == "-") {
    sink->descriptor_ = STDOUT_FILENO;
    return sink;
  }
  // Devices and pipes are written directly: they cannot be replaced by renaming.
  struct stat status {};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  if (exists && !S_ISREG(status.st_mode)) {
    sink->descriptor_ = open_patiently(path, O_WRONLY);
    if (sink->descriptor_ < 0) return system_error(ErrorCode::output, "cannot be opened", path);
    return sink;
  }
  if (!sink->replaces_ && ::lstat(path.c_str(), &status) == 0) return taken_error(path);
  if (!exists && ::lstat(path.c_str(), &status) == 0) {
    errno = ENOENT;
    return system_error(ErrorCode::output, "is a symbolic link to a file that does not exist",
                        path);
  }
  if (exists) {
    if (is_locked(path)) return busy_error(path);
    sink->permissions_ = Permissions{status.st_mode & 0777u, status.st_gid};
    if (char* real = ::realpath(path.c_str(), nullptr); real != nullptr) {
      sink->path_ = real;
      std::free(real);
    }
  }
  if (auto result = sink->create_temporary(how); !result) return result.error();
  return sink;
}

Result<std::unique_ptr<FileSink>> FileSink::create_live(const std::string& path,
                                                        Existing existing) {
  auto sink = create(path, Temporary::unnamed, existing);
  if (!sink || (*sink)->temporary_.empty()) return sink;
  (*sink)->live_ = true;
  // A file system without locks has no protection against two writers.
  (void)::flock((*sink)->descriptor_, LOCK_EX | LOCK_NB);
  return sink;
}

Result<std::unique_ptr<FileSink>> FileSink::open_live(const std::string& path) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->path_ = sink->temporary_ = path;
  sink->descriptor_ = ::open(path.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (sink->descriptor_ < 0 && errno == ELOOP)
    return Error{.code = ErrorCode::output,
                 .detail = "is a symbolic link, so it cannot be changed in place",
                 .file = path};
  if (sink->descriptor_ < 0) return system_error(ErrorCode::output, "cannot be opened", path);
  struct stat status {};
  if (::fstat(sink->descriptor_, &status) != 0 || !S_ISREG(status.st_mode) || status.st_nlink != 1)
    return Error{.code = ErrorCode::output,
                 .detail = "is not a file with one name, so it cannot be changed in place",
                 .file = path};
  if (::flock(sink->descriptor_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    return busy_error(path);
  sink->live_ = sink->published_ = true;
  sink->bytes_ = sink->published_bytes_ = static_cast<std::uint64_t>(status.st_size);
  return sink;
}

Result<void> FileSink::continue_at(std::uint64_t bytes) {
  if (::ftruncate(descriptor_, static_cast<off_t>(bytes)) != 0 ||
      ::lseek(descriptor_, static_cast<off_t>(bytes), SEEK_SET) < 0)
    return system_error(ErrorCode::output, "cannot be continued", path_);
  bytes_ = published_bytes_ = bytes;
  return {};
}

Result<std::unique_ptr<FileSink>> FileSink::create_scratch(const std::string& folder,
                                                           const std::string& name, Temporary how) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->scratch_ = true;
  // Files in /tmp may be in memory.
  sink->path_ = (folder.empty() ? "/var/tmp" : folder) + "/" + name;
  if (auto result = sink->create_temporary(how); !result) return result.error();
  return sink;
}

Result<void> FileSink::create_temporary(Temporary how) {
  if (how == Temporary::unnamed)
    descriptor_ =
        ::open(folder_of(path_).c_str(), O_RDWR | O_TMPFILE | O_CLOEXEC, scratch_ ? 0600 : 0666);
  if (descriptor_ >= 0) {
    temporary_ = "/proc/self/fd/" + std::to_string(descriptor_);
    if (::access(temporary_.c_str(), F_OK) != 0) ::close(std::exchange(descriptor_, -1));
  }
  return descriptor_ >= 0 ? Result<void>() : create_named();
}

Result<void> FileSink::create_named() {
  const std::string machine = name_of_machine();
  // A killed process may have left a file with the same name. The next attempt then uses another
  // name.
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    temporary_ = own_name(path_, machine, attempt);
    descriptor_ =
        ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, scratch_ ? 0600 : 0666);
    if (descriptor_ >= 0 || errno != EEXIST) break;
  }
  named_ = descriptor_ >= 0;
  if (!named_) return system_error(ErrorCode::output, "cannot be created", path_);
  // Use the modification time of the new file as the current time. It comes from the clock of the
  // file system, as do the modification times of the other temporary files.
  struct stat status {};
  if (::fstat(descriptor_, &status) == 0) remove_leftovers(path_, machine, status.st_mtime);
  return {};
}

FileSink::~FileSink() {
  if (path_ == "-") return;
  cut_back();
  if (descriptor_ >= 0) ::close(descriptor_);
  if (named_) ::unlink(temporary_.c_str());
}

Result<void> FileSink::write(std::span<const std::byte> bytes) {
  if (committed_)
    return Error{
        .code = ErrorCode::misuse, .detail = "cannot be written after commit()", .file = path_};
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(ErrorCode::output, "cannot be written", path_);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
    bytes_ += static_cast<std::size_t>(n);
  }
  return {};
}

Result<void> FileSink::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(ErrorCode::output, "cannot be written", path_);
    offset += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

Result<void> FileSink::copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) {
  std::uint64_t done = 0;
  if (const auto* file = dynamic_cast<const FileRandomSource*>(&from))
    done = file->copy_to(descriptor_, offset, bytes);
  bytes_ += done;
  return ByteSink::copy(from, offset + done, bytes - done);
}

Result<void> FileSink::commit() {
  if (path_ == "-" || scratch_ || committed_) return {};
  if (auto result = flush_file(); !result) return result;
  if (!published_)
    if (auto result = make_visible(); !result) return result;
  // Some file systems report a failed write only when the file is closed.
  if (auto result = close(); !result) return result;
  committed_ = true;
  return temporary_.empty() || published_ ? Result<void>() : flush_folder(path_);
}

/// Gives the file its final name.
Result<void> FileSink::make_visible() {
  if (!temporary_.empty() && is_locked(path_)) return busy_error(path_);
  pass_permissions_on();
  if (named_) {
    if (!live_)
      if (auto result = close(); !result) return result;
    if (auto result = rename_temporary(); !result) return result;
  } else if (!temporary_.empty()) {
    if (const int again = ::fcntl(descriptor_, F_DUPFD_CLOEXEC, 0);
        again >= 0 && ::close(again) != 0)
      return system_error(ErrorCode::output, "cannot be closed", path_);
    if (auto result = link(); !result) return result;
  }
  named_ = false;
  return {};
}

Result<void> FileSink::flush() { return live_ ? flush_file() : Result<void>(); }

Result<void> FileSink::publish() {
  if (temporary_.empty()) return {};
  if (!live_)
    return Error{.code = ErrorCode::misuse,
                 .detail = "cannot be published before it is complete: it is not a live file",
                 .file = path_};
  if (auto result = flush_file(); !result) return result;
  if (published_) {
    published_bytes_ = bytes_;
    return {};
  }
  if (auto result = make_visible(); !result) return result;
  published_ = true;
  published_bytes_ = bytes_;
  return flush_folder(path_);
}

/// Removes the bytes of a live file that have not been published.
void FileSink::cut_back() {
  if (published_ && !committed_ && descriptor_ >= 0 && bytes_ != published_bytes_)
    (void)!::ftruncate(descriptor_, static_cast<off_t>(published_bytes_));
}

Result<void> FileSink::close() {
  if (descriptor_ < 0 || ::close(std::exchange(descriptor_, -1)) == 0) return {};
  return system_error(ErrorCode::output, "cannot be closed", path_);
}

/// Sets the permissions of the file to those of the file that it replaces. Called only when the
/// file is complete: until then, a writer may open the file again by its name, which these
/// permissions could forbid. If the group of the file cannot be set, the permission bits for the
/// group are cleared, since they would apply to a different group.
void FileSink::pass_permissions_on() const {
  if (!permissions_) return;
  const int file = named_ ? ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC) : descriptor_;
  if (file < 0) return;
  struct stat status {};
  const bool same = ::fstat(file, &status) == 0 && status.st_gid == permissions_->group;
  const bool passed = same || ::fchown(file, ~uid_t{0}, permissions_->group) == 0;
  (void)::fchmod(file, permissions_->mode & (passed ? 0777u : 0707u));
  if (named_) ::close(file);
}

/// Flushes all data of the file to the disk. A named file is opened again by its name, since a
/// library that writes through the name may have replaced the file that this sink created. If the
/// file system cannot flush (EINVAL), does nothing.
Result<void> FileSink::flush_file() const {
  const int file = named_ ? ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC) : descriptor_;
  const bool flushed = file >= 0 && (::fsync(file) == 0 || errno == EINVAL);
  const Error error = system_error(ErrorCode::output, "cannot be flushed", path_);
  if (named_ && file >= 0) ::close(file);
  return flushed ? Result<void>() : error;
}

/// Gives a file without a name its final name. If no file has that name, links the file directly to
/// the name. Otherwise links the file to a temporary name, and then renames it to the final name.
Result<void> FileSink::link() {
  const auto link_as = [this](const std::string& name) {
    return ::linkat(AT_FDCWD, temporary_.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
  };
  if (link_as(path_)) return {};
  bool taken = errno == EEXIST;
  const Error error =
      system_error(ErrorCode::output, "cannot be stored under its final name", path_);
  if (!taken) return rename_copy(error);
  if (!replaces_) return taken_error(path_);
  const std::string machine = name_of_machine();
  for (int attempt = 0; attempt < kMostAttempts && taken; ++attempt) {
    const std::string beside = own_name(path_, machine, attempt);
    if (!link_as(beside)) {
      taken = errno == EEXIST;
      continue;
    }
    // Remove temporary files that processes left because they were killed between link and rename.
    struct stat status {};
    if (::fstat(descriptor_, &status) == 0) remove_leftovers(path_, machine, status.st_mtime);
    if (::rename(beside.c_str(), path_.c_str()) == 0) return {};
    const Error why =
        system_error(ErrorCode::output, "cannot be stored under its final name", path_);
    ::unlink(beside.c_str());
    return why;
  }
  return system_error(ErrorCode::output, "cannot be stored under its final name", path_);
}

/// Renames the temporary file to its final name. If an existing file must not be replaced, the
/// function uses a variant of rename or a hard link; both fail if the name exists. If the system
/// supports neither, the function checks whether the name exists, and then renames.
Result<void> FileSink::rename_temporary() const {
  if (!replaces_) {
#ifdef RENAME_NOREPLACE
    if (::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, path_.c_str(), RENAME_NOREPLACE) == 0)
      return {};
#endif
    if (::link(temporary_.c_str(), path_.c_str()) == 0) {
      ::unlink(temporary_.c_str());
      return {};
    }
    struct stat status {};
    if (errno == EEXIST || ::lstat(path_.c_str(), &status) == 0) return taken_error(path_);
  }
  if (::rename(temporary_.c_str(), path_.c_str()) == 0) return {};
  return system_error(ErrorCode::output, "cannot be stored under its final name", path_);
}

/// Copies the contents of a file without a name to a named file. Used if the system cannot give a
/// name to an unnamed file, as in some containers and on some file systems. `why` is the error that
/// the system returned when this was attempted.
Result<void> FileSink::rename_copy(const Error& why) {
  const auto whole = FileRandomSource::open(temporary_);
  if (!whole) return why;
  const int unnamed = descriptor_;
  const std::string in_proc = temporary_;
  if (!create_named()) {
    descriptor_ = unnamed;
    temporary_ = in_proc;
    return why;
  }
  ::close(unnamed);
  if (live_) (void)::flock(descriptor_, LOCK_EX | LOCK_NB);
  bytes_ = 0;
  if (auto result = copy(**whole, 0, (*whole)->size()); !result) return result;
  if (auto result = flush_file(); !result) return result;
  pass_permissions_on();
  if (!live_)
    if (auto result = close(); !result) return result;
  return rename_temporary();
}

// --- reading

Result<std::unique_ptr<FileSource>> FileSource::open(const std::string& path) {
  std::unique_ptr<FileSource> source(new FileSource());
  source->path_ = path;
  source->descriptor_ = path == "-" ? STDIN_FILENO : open_patiently(path, O_RDONLY);
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

Result<std::unique_ptr<FileRandomSource>> FileSource::anywhere() const {
  struct stat status {};
  if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode))
    return Error{.code = ErrorCode::io, .detail = "is not seekable", .file = path_};
  std::unique_ptr<FileRandomSource> source(new FileRandomSource());
  source->path_ = path_;
  source->size_ = static_cast<std::uint64_t>(status.st_size);
  source->descriptor_ = ::fcntl(descriptor_, F_DUPFD_CLOEXEC, 0);
  if (source->descriptor_ < 0) return system_error(ErrorCode::io, "cannot be opened", path_);
  return source;
}

Result<std::unique_ptr<FileRandomSource>> FileRandomSource::open(const std::string& path) {
  std::unique_ptr<FileRandomSource> source(new FileRandomSource());
  source->path_ = path;
  source->descriptor_ = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (source->descriptor_ < 0) return system_error(ErrorCode::io, "cannot be opened", path);
  const off_t end = ::lseek(source->descriptor_, 0, SEEK_END);
  if (end < 0) return system_error(ErrorCode::io, "is not seekable", path);
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
    if (n == 0)
      return Error{.code = ErrorCode::truncated,
                   .detail = "ends before it should",
                   .offset = offset,
                   .file = path_};
    offset += static_cast<std::uint64_t>(n);
    into = into.subspan(static_cast<std::size_t>(n));
  }
  return {};
}

std::uint64_t FileRandomSource::copy_to(int descriptor, std::uint64_t offset,
                                        std::uint64_t bytes) const {
  constexpr std::uint64_t kMost = std::uint64_t{1} << 30;
  auto from = static_cast<off64_t>(offset);
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
