// What the commands of the tool shm have in common: exit codes, options of all, places.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/spool.h"
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
  std::string part;                     // of an archive; empty: its only one
  std::string temp;                     // empty: beside the output
  std::optional<std::uint64_t> memory;  // bytes of the spool
  std::optional<std::uint64_t> max_output, max_cells;  // of a mesh: bytes of its numbers; cells
  bool quiet = false;
  bool force = false;  // write over the output where it is there
};

// Memory of the spool: as the user wants it, or what is usual; more where `any_order` of vertices
// or cells is likely.
std::size_t spool_memory(const CommonOptions& options, bool any_order = false);

MeshLimits mesh_limits(const CommonOptions& options);

// Spools go beside the output, which has room for meshes, or where the user wants them.
std::string spool_directory(const CommonOptions& options);

std::uint64_t file_bytes(const std::string& path);  // 0 where there is none

// Text for a terminal: names come from files, and their control characters would move its cursor,
// or end a line. They are shown as \xNN.
std::string printable(std::string_view text);
/// As text, or in an attribute, of SVG and HTML; without control characters.
std::string escaped_markup(std::string_view text);

// To standard output, or to standard error where the output itself goes there.
void print(const CommonOptions& options, const std::string& text);

// What gzip, xz and zstd keep: who may read the file, and when it was changed. Nothing where one of
// the two is no file.
void keep_attributes(const std::string& from, const std::string& to);

bool is_shm(const std::string& path);
// Throw Failure where it is no .shm file, where it is an archive.
void require_shm(const std::string& path);
void require_no_archive(const std::string& path);

// On standard error, with --quiet too: nothing goes silently.
void report_losses(const LossList& losses, const std::string& output);

}  // namespace shm::converters
