// Definitions that all commands of the tool shm share: exit codes, common options, and helper
// functions for files and messages.
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
  std::string input;   // path of the input; used in messages that name no other file
  std::string output;  // empty: none; "-": standard output

  // If the input is copied to a temporary file: path of the copy, and name of the original input.
  std::string spooled, spooled_from;
  // Member to read if the input is an archive; if empty, the archive's only member.
  std::string part;
  std::string temp;  // folder for temporary files; if empty, see spool_directory()
  std::optional<std::uint64_t> memory;  // limit of the spool, in bytes

  // Limits for meshes: size in bytes of coordinates, values and cells, and number of cells or
  // vertices.
  std::optional<std::uint64_t> max_output, max_cells;
  bool quiet = false;
  bool force = false;  // overwrite an existing output
};

// Returns the memory limit of the spool in bytes: the user's choice, or a default. The default is
// higher if `any_order` is true, i.e. if vertices or cells are accessed in random order.
std::size_t spool_memory(const CommonOptions& options, bool any_order = false);

MeshLimits mesh_limits(const CommonOptions& options);

// Returns the folder for the files of spools (temporary storage): the user's choice, otherwise the
// folder of the output, which usually has enough space for meshes. If the output is not a regular
// file, returns the system's folder for temporary files.
std::string spool_directory(const CommonOptions& options);

std::uint64_t file_bytes(
    const std::string& path);  // size of the file in bytes; 0 if the file does not exist

// Makes text safe for a terminal by replacing control characters with \xNN. Names that come from
// files could otherwise contain characters that move the cursor or end a line.
std::string printable(std::string_view text);
// Escapes text for SVG and HTML, for use as content or in an attribute. Removes control
// characters.
std::string escaped_markup(std::string_view text);

// Prints text to standard output, or to standard error if the command writes its output file to
// standard output. Prints nothing with --quiet.
void print(const CommonOptions& options, const std::string& text);

// Copies the attributes that gzip, xz and zstd keep: permissions and modification time. Does
// nothing if one of the two files is not a regular file.
void keep_attributes(const std::string& from, const std::string& to);

bool is_shm(const std::string& path);
// require_shm() throws Failure if the file is not a .shm file. require_no_archive() throws Failure
// if the file is an archive.
void require_shm(const std::string& path);
void require_no_archive(const std::string& path);

// Reports on standard error which data of the mesh the output lacks, even with --quiet, so that no
// loss goes unnoticed.
void report_losses(const LossList& losses, const std::string& output);

}  // namespace shm::converters
