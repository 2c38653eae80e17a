// What the commands of the tool shm have in common: exit codes, the line of progress, places.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "base/progress.h"
#include "shm/result.h"
#include "transfer/losses.h"

namespace shm::converters {

enum ExitCode {
  kDone = 0,
  kDifferent = 1,
  kWrongUse = 2,
  kBadInput = 3,
  kBadOutput = 4,
  kLimit = 5,
  kIncomplete = 6,
  kSalvaged = 7
};
ExitCode exit_code(ErrorCode code);

// What every command is given.
struct CommonOptions {
  std::string input;                    // what messages about no other file mean
  std::string output;                   // empty: none; "-": standard output
  std::string spooled, spooled_from;    // where what came through a pipe went, and its name
  std::string temp;                     // empty: beside the output
  std::optional<std::uint64_t> memory;  // bytes of the spool
  bool quiet = false;
  bool force = false;  // write over the output where it is there
};

// Memory of the spool: as the user wants it, or what is usual; more where `any_order` of vertices
// or cells is likely.
std::size_t spool_memory(const CommonOptions& options, bool any_order = false);

// One line on the terminal, rewritten at most ten times a second and wiped at the end.
class ProgressLine {
 public:
  explicit ProgressLine(bool quiet);
  ~ProgressLine() { wipe(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  Progress callback() {
    if (!shown_) return {};
    return [this](std::string_view phase, std::uint64_t done, std::uint64_t total) {
      show(phase, done, total);
    };
  }
  void show(std::string_view phase, std::uint64_t done = 0, std::uint64_t total = 0);
  void wipe();

 private:
  bool shown_, dirty_ = false;
  std::chrono::steady_clock::time_point last_{};
};

// Spools go beside the output, which has room for meshes, or where the user wants them.
std::string spool_directory(const CommonOptions& options);

std::uint64_t file_bytes(const std::string& path);  // 0 where there is none

// To standard output, or to standard error where the output itself goes there.
void print(const CommonOptions& options, const std::string& text);

bool is_shm(const std::string& path);
// Throw Failure where it is no .shm file, where it is an archive.
void require_shm(const std::string& path);
void require_no_archive(const std::string& path);

// On standard error, with --quiet too: nothing goes silently.
void report_losses(const LossList& losses, const std::string& output);

}  // namespace shm::converters
