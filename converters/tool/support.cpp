#include "tool/support.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "archive/archive_files.h"
#include "base/failure.h"
#include "base/spool.h"
#include "formats/formats.h"

namespace shm::converters {

ExitCode exit_code(ErrorCode code) {
  switch (code) {
    case ErrorCode::misuse: return kWrongUse;
    case ErrorCode::output: return kBadOutput;
    case ErrorCode::over_limit: return kLimit;
    case ErrorCode::io:
    case ErrorCode::truncated:
    case ErrorCode::corrupt:
    case ErrorCode::unsupported: return kBadInput;
  }
  return kBadInput;
}

std::string spool_directory(const CommonOptions& options) {
  if (!options.temp.empty()) return options.temp;
  std::error_code none;
  const auto status = std::filesystem::status(options.output, none);
  const bool is_place =
      !std::filesystem::exists(status) || std::filesystem::is_regular_file(status);
  if (options.output.empty() || options.output == "-" || !is_place)
    return std::filesystem::temp_directory_path().string();
  const std::filesystem::path parent = std::filesystem::path(options.output).parent_path();
  return parent.empty() ? "." : parent.string();
}

std::size_t spool_memory(const CommonOptions& options, bool any_order) {
  constexpr std::size_t kAnyOrder = std::size_t{1} << 30;
  return options.memory ? *options.memory : any_order ? kAnyOrder : Spool::kUsualBudget;
}

MeshLimits mesh_limits(const CommonOptions& options) {
  MeshLimits limits;
  if (options.max_cells) limits.most = *options.max_cells;
  if (options.max_output) limits.bytes = *options.max_output;
  return limits;
}

std::uint64_t file_bytes(const std::string& path) {
  struct stat status {};
  return ::stat(path.c_str(), &status) == 0 ? static_cast<std::uint64_t>(status.st_size) : 0;
}

std::string printable(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string shown;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x20 && byte != 0x7f)
      shown += c;
    else
      shown += std::string("\\x") + kDigits[byte >> 4] + kDigits[byte & 15];
  }
  return shown;
}

std::string escaped_markup(std::string_view text) {
  std::string out;
  for (const char one : text) switch (one) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      default:
        if (static_cast<unsigned char>(one) >= 0x20) out += one;
    }
  return out;
}

void keep_attributes(const std::string& from, const std::string& to) {
  struct stat source {
  }, made{};
  if (::stat(from.c_str(), &source) != 0 || ::stat(to.c_str(), &made) != 0) return;
  if (!S_ISREG(source.st_mode) || !S_ISREG(made.st_mode)) return;
  // Errors are ignored: a user who does not own the file cannot change its attributes, but its
  // contents are complete in any case.
  const std::array<struct timespec, 2> times = {source.st_atim, source.st_mtim};
  if (::utimensat(AT_FDCWD, to.c_str(), times.data(), 0) != 0) return;
  if (::chmod(to.c_str(), source.st_mode & 0777) != 0) return;
}

void print(const CommonOptions& options, const std::string& text) {
  if (!options.quiet) std::fputs(text.c_str(), options.output == "-" ? stderr : stdout);
}

bool is_shm(const std::string& path) {
  const Format* format = format_of_file(path);
  return format != nullptr && format->name == "shm";
}

void require_shm(const std::string& path) {
  if (is_shm(path)) return;
  std::error_code none;
  if (std::filesystem::is_empty(path, none)) throw Failure(ErrorCode::truncated, "is empty", path);
  throw Failure(ErrorCode::unsupported, "is not a .shm file; use shm compress to create one", path);
}

void require_no_archive(const std::string& path) {
  if (is_archive(path))
    throw Failure(ErrorCode::unsupported, "is an archive of several files; shm split restores them",
                  path);
}

void report_losses(const LossList& losses, const std::string& output) {
  for (const std::string& loss : losses)
    std::fprintf(stderr, "shm: not in %s: %s\n", output.c_str(), printable(loss).c_str());
}

}  // namespace shm::converters
