#include "tool/destination.h"

#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string_view>
#include <system_error>
#include <utility>

#include "base/failure.h"

namespace shm::converters {
namespace {

constexpr std::string_view kStandardStream = "-";

[[noreturn]] void refuse(const std::string& path, std::string detail) {
  throw Failure(ErrorCode::output, std::move(detail), path);
}

// Returns the status of the file at `path`, or nothing if no such file exists. If `path` is "-",
// returns the status of the file descriptor `standard`.
std::optional<struct stat> status_of(const std::string& path, int standard) {
  struct stat status {};
  const int failed =
      path == kStandardStream ? ::fstat(standard, &status) : ::stat(path.c_str(), &status);
  if (failed != 0) return std::nullopt;
  return status;
}

bool is_same(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

void refuse_inputs(const std::string& path, const struct stat& output,
                   const std::vector<std::string>& inputs) {
  if (!S_ISREG(output.st_mode)) return;  // a terminal or a socket may be both input and output
  for (const std::string& input : inputs) {
    const auto status = status_of(input, STDIN_FILENO);
    if (!status || !is_same(*status, output)) continue;
    if (input == path) refuse(path, "is an input, and is not overwritten");
    refuse(path, "is the same file as " + input + ", which is an input, and is not overwritten");
  }
}

// Asks the user on the terminal whether existing output may be replaced. Returns false if there is
// no terminal.
bool may_replace(const std::string& what) {
  if (::isatty(STDIN_FILENO) == 0 || ::isatty(STDERR_FILENO) == 0) return false;
  std::fprintf(stderr, "shm: %s already. Overwrite? [y/N] ", what.c_str());
  std::array<char, 16> answer{};
  if (std::fgets(answer.data(), answer.size(), stdin) == nullptr) return false;
  return answer[0] == 'y' || answer[0] == 'Y';
}

// Checks that the folder of an output exists and is writable. Without this check, the error would
// only be found after all the work is done.
void check_folder(const std::string& path) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  const std::string folder = parent.empty() ? "." : parent.string();
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error))
    refuse(path, "cannot be written: there is no folder " + folder);
  if (::access(folder.c_str(), W_OK | X_OK) != 0)
    refuse(path, "cannot be written: " + folder + ": " + std::strerror(errno));
}

// Checks all existing output files of a series. Asks the user only once whether they may be
// replaced.
void check_series(const Places& places, bool force) {
  for (const std::string& path : places.series) {
    const auto status = status_of(path, STDOUT_FILENO);
    if (!status) continue;
    if (S_ISDIR(status->st_mode)) refuse(path, "is a folder");
    refuse_inputs(path, *status, places.inputs);
  }
  if (places.series.empty() || force) return;
  const std::string& first = places.series.front();
  const std::size_t others = places.series.size() - 1;
  const std::string more = others == 0 ? ""
                                       : std::to_string(others) +
                                             (others == 1 ? " other file" : " other files") +
                                             " of " + *places.output;
  if (!may_replace(first + (others == 0 ? " exists" : " and " + more + " exist")))
    refuse(first, "exists already" + (others == 0 ? "" : ", as well as " + more) +
                      "; --force replaces existing files");
}

}  // namespace

std::string standard_or(std::string path, int descriptor) {
  const std::string number = std::to_string(descriptor);
  const bool is_standard = path == (descriptor == STDIN_FILENO ? "/dev/stdin" : "/dev/stdout") ||
                           path == "/dev/fd/" + number || path == "/proc/self/fd/" + number;
  return is_standard ? std::string(kStandardStream) : path;
}

void check_places(const Places& places, bool force) {
  if (!places.output) return;
  check_series(places, force);
  const std::string& path = *places.output;
  if (path == kStandardStream && places.compressed && ::isatty(STDOUT_FILENO) != 0)
    refuse("standard output", "is a terminal; write compressed data to a file: -o FILE");
  const auto status = status_of(path, STDOUT_FILENO);
  if (!status) {
    if (errno != ENOENT) refuse(path, std::string("cannot be written: ") + std::strerror(errno));
    check_folder(path);
    return;
  }
  if (S_ISDIR(status->st_mode)) refuse(path, "is a folder");
  refuse_inputs(path, *status, places.inputs);
  if (path == kStandardStream || !S_ISREG(status->st_mode)) return;
  check_folder(path);
  if (!force && !may_replace(path + " exists")) refuse(path, "exists already; --force replaces it");
}

}  // namespace shm::converters
