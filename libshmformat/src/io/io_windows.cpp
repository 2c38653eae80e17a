// Files on Windows. File names are UTF-8 outside this file and UTF-16 inside it. FileSink and the
// sources store descriptors of the C library, each of which owns a system handle. Data is read and
// written through this handle, which has no text mode.
#ifndef NOMINMAX
#define NOMINMAX
#endif
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
// windows.h must be included before other headers of Windows.
#include <fcntl.h>
#include <io.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string_view>
#include <utility>

#include "io/temporary_names.h"
#include "shm/io.h"

namespace shm {
namespace {

constexpr int kInput = 0, kOutput = 1;
/// Sharing mode of open files: as on POSIX systems, other processes may read, write, rename and
/// remove an open file.
constexpr DWORD kShared = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;
// Maximum number of bytes that one system call reads or writes.
constexpr std::size_t kMostBytes = std::size_t{1} << 30;

class Handle {
 public:
  explicit Handle(HANDLE handle) : handle_(handle) {}
  ~Handle() {
    if (*this) ::CloseHandle(handle_);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  explicit operator bool() const { return handle_ != INVALID_HANDLE_VALUE && handle_ != nullptr; }
  HANDLE get() const { return handle_; }
  HANDLE release() { return std::exchange(handle_, INVALID_HANDLE_VALUE); }

 private:
  HANDLE handle_;
};

/// Converts UTF-8 to UTF-16. Returns an empty string if `text` is not UTF-8.
std::wstring wide(std::string_view text) {
  const int bytes = static_cast<int>(text.size());
  std::wstring units(text.size(), L'\0');
  const int count =
      ::MultiByteToWideChar(CP_UTF8, MB_ERR_INVALID_CHARS, text.data(), bytes, units.data(), bytes);
  units.resize(static_cast<std::size_t>(std::max(count, 0)));
  return units;
}

std::string narrow(std::wstring_view units) {
  const int count = static_cast<int>(units.size());
  std::string text(units.size() * 3, '\0');
  const int bytes = ::WideCharToMultiByte(CP_UTF8, 0, units.data(), count, text.data(),
                                          static_cast<int>(text.size()), nullptr, nullptr);
  text.resize(static_cast<std::size_t>(std::max(bytes, 0)));
  return text;
}

/// Returns `path` in the form that system calls accept. Long paths must be absolute and have a
/// prefix.
std::wstring system_path(const std::string& path) {
  // Longest path, in characters, without a prefix. The system allows 260 characters, but the path
  // of a folder must leave space for a short file name.
  constexpr std::size_t kLongest = 240;
  const std::wstring name = wide(path);
  std::wstring whole(32768, L'\0');
  whole.resize(
      ::GetFullPathNameW(name.c_str(), static_cast<DWORD>(whole.size()), whole.data(), nullptr));
  const std::wstring_view front = std::wstring_view(whole).substr(0, 4);
  if (whole.size() < kLongest || front == L"\\\\?\\" || front == L"\\\\.\\") return name;
  return front.starts_with(L"\\\\") ? L"\\\\?\\UNC" + whole.substr(1) : L"\\\\?\\" + whole;
}

Error system_error(ErrorCode code, const char* what, const std::string& path) {
  const DWORD why = ::GetLastError();
  wchar_t text[512];
  const DWORD size =
      ::FormatMessageW(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, nullptr, why, 0,
                       text, static_cast<DWORD>(std::size(text)), nullptr);
  std::wstring_view sentence(text, size);
  sentence = sentence.substr(0, sentence.find_last_not_of(L" .\r\n") + 1);
  const std::string reason = sentence.empty() ? "error " + std::to_string(why) : narrow(sentence);
  return Error{.code = code, .detail = std::string(what) + ": " + reason, .file = path};
}

HANDLE open_handle(const std::string& path, DWORD access, DWORD existing, DWORD flags = 0) {
  // If `path` is the name of a pipe, the process at its other end must not be allowed to
  // impersonate this process.
  flags |= SECURITY_SQOS_PRESENT | SECURITY_IDENTIFICATION;
  return ::CreateFileW(system_path(path).c_str(), access, kShared, nullptr, existing, flags,
                       nullptr);
}

/// Takes ownership of a handle and returns a descriptor for the handle. Returns -1 if the handle is
/// invalid or the C library has too many open files.
int descriptor_of(HANDLE opened) {
  Handle handle(opened);
  if (!handle) return -1;
  const int descriptor =
      ::_open_osfhandle(reinterpret_cast<std::intptr_t>(handle.get()), _O_BINARY | _O_NOINHERIT);
  if (descriptor >= 0)
    (void)handle.release();
  else
    ::SetLastError(ERROR_TOO_MANY_OPEN_FILES);
  return descriptor;
}

HANDLE handle_of(int descriptor) {
  return descriptor < 0 ? INVALID_HANDLE_VALUE
                        : reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor));
}

/// Returns the index in `path` at which the file name begins.
std::size_t name_in(const std::string& path) {
  const std::size_t before = path.find_last_of("/\\:");
  return before == std::string::npos ? 0 : before + 1;
}

/// Returns true if the path names an object outside the file systems, such as a named pipe.
bool is_device_path(const std::string& path) {
  const auto slash = [&](std::size_t i) { return path[i] == '/' || path[i] == '\\'; };
  return path.size() > 4 && slash(0) && slash(1) && path[2] == '.' && slash(3);
}

/// Returns a name for the machine. Process numbers are unique on one machine.
std::string name_of_machine() {
  wchar_t name[256], id[64];
  DWORD units = static_cast<DWORD>(std::size(name)), bytes = sizeof id;
  if (::GetComputerNameExW(ComputerNameDnsFullyQualified, name, &units) == 0) units = 0;
  // The machine id distinguishes machines that have the same host name.
  if (::RegGetValueW(HKEY_LOCAL_MACHINE, L"SOFTWARE\\Microsoft\\Cryptography", L"MachineGuid",
                     RRF_RT_REG_SZ | RRF_SUBKEY_WOW6464KEY, nullptr, id, &bytes) != ERROR_SUCCESS)
    bytes = 0;
  return machine_name(narrow({name, units}) + " " + narrow({id, bytes / sizeof *id}));
}

bool is_gone(int process) {
  const Handle handle(::OpenProcess(SYNCHRONIZE, FALSE, static_cast<DWORD>(process)));
  if (!handle)
    return ::GetLastError() == ERROR_INVALID_PARAMETER;  // true if no such process exists
  return ::WaitForSingleObject(handle.get(), 0) == WAIT_OBJECT_0;
}

/// Returns the time at which the file was last written, in units of 100 ns.
std::uint64_t last_write(HANDLE file) {
  FILETIME time{};
  ::GetFileTime(file, nullptr, nullptr, &time);
  return std::uint64_t{time.dwHighDateTime} << 32 | time.dwLowDateTime;
}

/// Returns true if the last write to a file was more than an hour before `now`. Reads the time from
/// the file itself, since the time in the folder entry is updated only when the file is closed.
bool is_old(const std::string& path, std::uint64_t now) {
  constexpr std::uint64_t kOld = 3600 * std::uint64_t{10'000'000};
  const Handle file(open_handle(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING));
  return file && last_write(file.get()) + kOld < now;
}

/// Removes temporary files for `path` if the processes that created them have been killed.
/// Temporary files from other machines are removed if they are more than an hour old.
void remove_leftovers(const std::string& path, const std::string& machine, std::uint64_t now) {
  const std::string front = temporary_front(path, name_in(path));
  const std::string folder = front.substr(0, name_in(front)), head = front.substr(folder.size());
  WIN32_FIND_DATAW entry{};
  const HANDLE list = ::FindFirstFileW(system_path(front + "*").c_str(), &entry);
  if (list == INVALID_HANDLE_VALUE) return;
  do {
    const std::string name = narrow(entry.cFileName);
    const auto maker = name.starts_with(head)
                           ? maker_of(std::string_view(name).substr(head.size()), machine)
                           : std::nullopt;
    constexpr DWORD kNoFile = FILE_ATTRIBUTE_DIRECTORY | FILE_ATTRIBUTE_REPARSE_POINT;
    if (!maker || (entry.dwFileAttributes & kNoFile) != 0) continue;
    if (maker->here ? is_gone(maker->process) : is_old(folder + name, now))
      ::DeleteFileW(system_path(folder + name).c_str());
  } while (::FindNextFileW(list, &entry) != 0);
  ::FindClose(list);
}

Error taken_error(const std::string& path) {
  return Error{.code = ErrorCode::output, .detail = "exists already", .file = path};
}

/// Renames a file as POSIX systems do: if the new name belongs to an existing file, that file is
/// replaced, and a process that has it open can still use it. Newer versions of Windows support
/// this on some file systems, but MoveFileExW does not always use it.
bool rename_over_open(const std::string& from, const std::wstring& to) {
  // These constants exist only in recent versions of winbase.h.
  constexpr auto kRenameInfoEx = static_cast<FILE_INFO_BY_HANDLE_CLASS>(22);
  constexpr DWORD kReplace = 1, kPosix = 2;
  struct Head {
    DWORD flags;
    HANDLE folder;
    DWORD bytes;
  };
  constexpr std::size_t kName = offsetof(Head, bytes) + sizeof(DWORD);
  const Handle file(open_handle(from, DELETE, OPEN_EXISTING));
  if (!file) return false;
  const auto bytes = static_cast<DWORD>(to.size() * sizeof(wchar_t));
  std::vector<std::byte> info(kName + bytes + sizeof(wchar_t));
  const Head head{kReplace | kPosix, nullptr, bytes};
  std::copy_n(reinterpret_cast<const std::byte*>(&head), kName, info.begin());
  std::copy_n(reinterpret_cast<const std::byte*>(to.data()), bytes, info.begin() + kName);
  return ::SetFileInformationByHandle(file.get(), kRenameInfoEx, info.data(),
                                      static_cast<DWORD>(info.size())) != 0;
}

}  // namespace

// --- files that appear under their name only when complete

Result<std::unique_ptr<FileSink>> FileSink::create(const std::string& path, Temporary how,
                                                   Existing existing) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->path_ = path;
  sink->replaces_ = existing == Existing::replace;
  if (path == "-") {
    sink->descriptor_ = kOutput;
    return sink;
  }
  const Handle there(is_device_path(path) ? INVALID_HANDLE_VALUE
                                          : open_handle(path, FILE_READ_ATTRIBUTES, OPEN_EXISTING,
                                                        FILE_FLAG_BACKUP_SEMANTICS));
  // Devices and pipes are written directly: they cannot be replaced by renaming.
  if (is_device_path(path) || (there && ::GetFileType(there.get()) != FILE_TYPE_DISK)) {
    sink->descriptor_ = descriptor_of(open_handle(path, GENERIC_WRITE, OPEN_EXISTING));
    if (sink->descriptor_ < 0) return system_error(ErrorCode::output, "cannot be opened", path);
    return sink;
  }
  const DWORD attributes = ::GetFileAttributesW(system_path(path).c_str());
  if (attributes != INVALID_FILE_ATTRIBUTES) {
    const auto refused = [&](const char* why) {
      return Error{.code = ErrorCode::output, .detail = why, .file = path};
    };
    if ((attributes & FILE_ATTRIBUTE_DIRECTORY) != 0) return refused("is a folder");
    if (!sink->replaces_) return taken_error(path);
    if ((attributes & FILE_ATTRIBUTE_READONLY) != 0) return refused("is read-only");
    if ((attributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0) {
      if (!there) return refused("is a symbolic link to a file that does not exist");
      std::wstring real(32768, L'\0');
      real.resize(::GetFinalPathNameByHandleW(there.get(), real.data(),
                                              static_cast<DWORD>(real.size()), 0));
      if (!real.empty()) sink->path_ = narrow(real);
    }
  }
  if (auto status = sink->create_temporary(how); !status) return status.error();
  return sink;
}

Result<std::unique_ptr<FileSink>> FileSink::create_live(const std::string& path,
                                                        Existing existing) {
  auto sink = create(path, Temporary::named, existing);
  if (sink) (*sink)->live_ = !(*sink)->temporary_.empty();
  return sink;
}

Result<std::unique_ptr<FileSink>> FileSink::open_live(const std::string& path) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->path_ = sink->temporary_ = path;
  sink->descriptor_ = descriptor_of(open_handle(path, GENERIC_READ | GENERIC_WRITE, OPEN_EXISTING));
  if (sink->descriptor_ < 0) return system_error(ErrorCode::output, "cannot be opened", path);
  sink->live_ = sink->published_ = true;
  return sink;
}

Result<void> FileSink::continue_at(std::uint64_t bytes) {
  LARGE_INTEGER end{};
  end.QuadPart = static_cast<LONGLONG>(bytes);
  if (::SetFilePointerEx(handle_of(descriptor_), end, nullptr, FILE_BEGIN) == 0 ||
      ::SetEndOfFile(handle_of(descriptor_)) == 0)
    return system_error(ErrorCode::output, "cannot be continued", path_);
  bytes_ = published_bytes_ = bytes;
  return {};
}

Result<std::unique_ptr<FileSink>> FileSink::create_scratch(const std::string& folder,
                                                           const std::string& name, Temporary how) {
  std::unique_ptr<FileSink> sink(new FileSink());
  sink->scratch_ = true;
  wchar_t system[MAX_PATH + 1];
  if (folder.empty() && ::GetTempPathW(MAX_PATH + 1, system) == 0)
    return system_error(ErrorCode::output, "has no folder", name);
  sink->path_ = (folder.empty() ? narrow(system) : folder) + "/" + name;
  if (auto status = sink->create_temporary(how); !status) return status.error();
  return sink;
}

/// Creates a named temporary file, since Windows has no files without names.
Result<void> FileSink::create_temporary(Temporary) { return create_named(); }

Result<void> FileSink::create_named() {
  const std::string machine = name_of_machine();
  // A killed process may have left a file with the same name. The next attempt then uses another
  // name.
  for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
    temporary_ = temporary_name(path_, name_in(path_), static_cast<int>(::GetCurrentProcessId()),
                                machine, attempt);
    descriptor_ = descriptor_of(open_handle(temporary_, GENERIC_READ | GENERIC_WRITE, CREATE_NEW));
    if (descriptor_ >= 0 || ::GetLastError() != ERROR_FILE_EXISTS) break;
  }
  named_ = descriptor_ >= 0;
  if (!named_) return system_error(ErrorCode::output, "cannot be created", path_);
  // Use the modification time of the new file as the current time. It comes from the clock of the
  // file system, as do the modification times of the other temporary files.
  remove_leftovers(path_, machine, last_write(handle_of(descriptor_)));
  return {};
}

FileSink::~FileSink() {
  if (path_ == "-") return;
  cut_back();
  if (descriptor_ >= 0) ::_close(descriptor_);
  if (named_) ::DeleteFileW(system_path(temporary_).c_str());
}

Result<void> FileSink::write(std::span<const std::byte> bytes) {
  if (committed_)
    return Error{
        .code = ErrorCode::misuse, .detail = "cannot be written after commit()", .file = path_};
  while (!bytes.empty()) {
    DWORD done = 0;
    const auto wanted = static_cast<DWORD>(std::min(bytes.size(), kMostBytes));
    if (::WriteFile(handle_of(descriptor_), bytes.data(), wanted, &done, nullptr) == 0)
      return system_error(ErrorCode::output, "cannot be written", path_);
    bytes = bytes.subspan(done);
    bytes_ += done;
  }
  return {};
}

Result<void> FileSink::write_at(std::uint64_t offset, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    OVERLAPPED place{};
    place.Offset = static_cast<DWORD>(offset);
    place.OffsetHigh = static_cast<DWORD>(offset >> 32);
    DWORD done = 0;
    const auto wanted = static_cast<DWORD>(std::min(bytes.size(), kMostBytes));
    if (::WriteFile(handle_of(descriptor_), bytes.data(), wanted, &done, &place) == 0)
      return system_error(ErrorCode::output, "cannot be written", path_);
    offset += done;
    bytes = bytes.subspan(done);
  }
  return {};
}

Result<void> FileSink::copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) {
  return ByteSink::copy(from, offset, bytes);
}

Result<void> FileSink::commit() {
  if (path_ == "-" || scratch_ || committed_) return {};
  if (published_ || named_)
    if (auto status = flush_file(); !status) return status;
  if (auto status = close(); !status) return status;
  if (named_)
    if (auto status = make_visible(); !status) return status;
  committed_ = true;
  return {};
}

/// Gives the file its final name. Precondition: the file is closed.
Result<void> FileSink::make_visible() {
  if (auto status = rename_temporary(); !status) return status;
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
  if (auto status = flush_file(); !status) return status;
  if (!published_) {  // an open file cannot be renamed
    if (auto status = close(); !status) return status;
    if (auto status = make_visible(); !status) return status;
    temporary_ = path_;
    descriptor_ = descriptor_of(open_handle(path_, GENERIC_READ | GENERIC_WRITE, OPEN_EXISTING));
    if (descriptor_ < 0) return system_error(ErrorCode::output, "cannot be opened", path_);
    ::SetFilePointer(handle_of(descriptor_), 0, nullptr, FILE_END);
    published_ = true;
  }
  published_bytes_ = bytes_;
  return {};
}

/// Removes the bytes of a live file that have not been published.
void FileSink::cut_back() {
  if (!published_ || committed_ || descriptor_ < 0 || bytes_ == published_bytes_) return;
  LARGE_INTEGER end{};
  end.QuadPart = static_cast<LONGLONG>(published_bytes_);
  if (::SetFilePointerEx(handle_of(descriptor_), end, nullptr, FILE_BEGIN) != 0)
    (void)::SetEndOfFile(handle_of(descriptor_));
}

Result<void> FileSink::close() {
  if (descriptor_ < 0 || ::_close(std::exchange(descriptor_, -1)) == 0) return {};
  return system_error(ErrorCode::output, "cannot be closed", path_);
}

/// Flushes all data of the file to the disk. Opens the file by its name, since a library that
/// writes through the name may have replaced the file that this sink created. If the file system
/// cannot flush, does nothing.
Result<void> FileSink::flush_file() const {
  const Handle file(open_handle(temporary_, GENERIC_WRITE, OPEN_EXISTING));
  if (file && (::FlushFileBuffers(file.get()) != 0 || ::GetLastError() == ERROR_INVALID_FUNCTION))
    return {};
  return system_error(ErrorCode::output, "cannot be flushed", path_);
}

/// Renames the temporary file to its final name. If an existing file must not be replaced, the
/// system checks in the same call whether the name exists.
Result<void> FileSink::rename_temporary() const {
  const std::wstring from = system_path(temporary_), to = system_path(path_);
  const DWORD how = MOVEFILE_WRITE_THROUGH | (replaces_ ? DWORD{MOVEFILE_REPLACE_EXISTING} : 0);
  if (::MoveFileExW(from.c_str(), to.c_str(), how) != 0) return {};
  const DWORD why = ::GetLastError();
  if (!replaces_ && (why == ERROR_ALREADY_EXISTS || why == ERROR_FILE_EXISTS))
    return taken_error(path_);
  if (replaces_ && why == ERROR_ACCESS_DENIED && rename_over_open(temporary_, to)) return {};
  ::SetLastError(why);
  return system_error(ErrorCode::output, "cannot be stored under its final name", path_);
}

// --- reading

Result<std::unique_ptr<FileSource>> FileSource::open(const std::string& path) {
  std::unique_ptr<FileSource> source(new FileSource());
  source->path_ = path;
  source->descriptor_ = path == "-" ? kInput
                                    : descriptor_of(open_handle(path, GENERIC_READ, OPEN_EXISTING,
                                                                FILE_FLAG_SEQUENTIAL_SCAN));
  if (source->descriptor_ < 0) return system_error(ErrorCode::io, "cannot be opened", path);
  return source;
}

FileSource::~FileSource() {
  if (descriptor_ >= 0 && path_ != "-") ::_close(descriptor_);
}

/// Reads from the file. A read of 0 bytes from a pipe does not always mean the end of the pipe,
/// since the writer may have written 0 bytes.
Result<std::size_t> FileSource::read(std::span<std::byte> into) {
  const HANDLE file = handle_of(descriptor_);
  const auto wanted = static_cast<DWORD>(std::min(into.size(), kMostBytes));
  while (wanted > 0) {
    DWORD done = 0;
    if (::ReadFile(file, into.data(), wanted, &done, nullptr) == 0) {
      if (::GetLastError() == ERROR_BROKEN_PIPE) break;
      return system_error(ErrorCode::io, "cannot be read", path_);
    }
    if (done > 0) return std::size_t{done};
    if (::GetFileType(file) != FILE_TYPE_PIPE) break;
  }
  return std::size_t{0};
}

namespace {

/// Returns the size in bytes of a file with random access; nullopt for other files.
std::optional<std::uint64_t> size_of(int descriptor) {
  const HANDLE file = handle_of(descriptor);
  LARGE_INTEGER size{};
  if (::GetFileType(file) != FILE_TYPE_DISK || ::GetFileSizeEx(file, &size) == 0)
    return std::nullopt;
  return static_cast<std::uint64_t>(size.QuadPart);
}

}  // namespace

/// Opens the file again by name, since duplicates of the open file would share its position.
Result<std::unique_ptr<FileRandomSource>> FileSource::anywhere() const {
  if (path_ == "-" || !size_of(descriptor_))
    return Error{.code = ErrorCode::io, .detail = "is not seekable", .file = path_};
  return FileRandomSource::open(path_);
}

Result<std::unique_ptr<FileRandomSource>> FileRandomSource::open(const std::string& path) {
  std::unique_ptr<FileRandomSource> source(new FileRandomSource());
  source->path_ = path;
  source->descriptor_ = descriptor_of(open_handle(path, GENERIC_READ, OPEN_EXISTING));
  if (source->descriptor_ < 0) return system_error(ErrorCode::io, "cannot be opened", path);
  const auto size = size_of(source->descriptor_);
  if (!size) return Error{.code = ErrorCode::io, .detail = "is not seekable", .file = path};
  source->size_ = *size;
  return source;
}

FileRandomSource::~FileRandomSource() {
  if (descriptor_ >= 0) ::_close(descriptor_);
}

Result<void> FileRandomSource::read_at(std::uint64_t offset, std::span<std::byte> into) {
  while (!into.empty()) {
    OVERLAPPED place{};
    place.Offset = static_cast<DWORD>(offset);
    place.OffsetHigh = static_cast<DWORD>(offset >> 32);
    DWORD done = 0;
    const auto wanted = static_cast<DWORD>(std::min(into.size(), kMostBytes));
    if (::ReadFile(handle_of(descriptor_), into.data(), wanted, &done, &place) == 0 &&
        ::GetLastError() != ERROR_HANDLE_EOF)
      return system_error(ErrorCode::io, "cannot be read", path_);
    if (done == 0)
      return Error{.code = ErrorCode::truncated,
                   .detail = "ends before it should",
                   .offset = offset,
                   .file = path_};
    offset += done;
    into = into.subspan(done);
  }
  return {};
}

std::uint64_t FileRandomSource::copy_to(int, std::uint64_t, std::uint64_t) const { return 0; }

}  // namespace shm
