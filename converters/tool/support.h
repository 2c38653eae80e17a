// Parts that the commands of the tool shm share: exit codes, common options, locations of files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/spool.h"
#include "interface/losses.h"
#include "shm/result.h"

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

// Options of every command.
struct CommonOptions {
  std::string input;   // path of the input; messages that name no file refer to it
  std::string output;  // empty: none; "-": standard output

  // Path of the temporary copy of a piped input, and name of the pipe.
  std::string spooled, spooled_from;
  std::string part;  // name of the part of an archive to read; empty: the only part
  std::string temp;  // folder for temporary files; empty: next to the output
  std::optional<std::uint64_t> memory;  // limit of the spool, in bytes

  // Largest mesh that is accepted: size of its numbers in bytes, and number of cells.
  std::optional<std::uint64_t> max_output, max_cells;
  bool quiet = false;
  bool force = false;  // overwrite an existing output
};

// Returns the memory limit of the spool in bytes: the user's choice, or the default. The default is
// higher if vertices or cells are likely to be accessed in `any_order`.
std::size_t spool_memory(const CommonOptions& options, bool any_order = false);

MeshLimits mesh_limits(const CommonOptions& options);

// Returns the folder for spools: the user's choice, or the folder of the output, which has space
// for meshes.
std::string spool_directory(const CommonOptions& options);

std::uint64_t file_bytes(
    const std::string& path);  // size of the file in bytes; 0 if no file exists

// Makes text safe for a terminal. Names come from files, and control characters in them could move
// the cursor or end a line. Control characters are shown as \xNN.
std::string printable(std::string_view text);
/// Escapes text for SVG and HTML, as content or attribute, and removes control characters.
std::string escaped_markup(std::string_view text);

// Prints to standard output, or to standard error if the output itself goes to standard output.
void print(const CommonOptions& options, const std::string& text);

// Copies the attributes that gzip, xz and zstd keep: permissions and modification time. Does
// nothing if one of the two files is not a regular file.
void keep_attributes(const std::string& from, const std::string& to);

bool is_shm(const std::string& path);
// require_shm() throws Failure if the file is not a .shm file, require_no_archive() if it is an
// archive.
void require_shm(const std::string& path);
void require_no_archive(const std::string& path);

// Prints the lost data to standard error, even with --quiet, so that no loss goes unnoticed.
void report_losses(const LossList& losses, const std::string& output);

}  // namespace shm::converters
