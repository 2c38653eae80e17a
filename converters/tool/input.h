// ToolInput: opens the mesh that a command of the tool reads. The input may be a file, a pipe, or
// standard input ("-"), and it may be packed with gzip, xz or zstd. If a .shm file is packed or
// comes through a pipe, it is decoded as it arrives. Any other packed or piped input is first
// copied to a temporary file, because its reader needs to seek. The name of a series, or a
// collection (.pvd), is opened as a series of files.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "archive/archive_files.h"
#include "base/output_file.h"
#include "compression/decompress.h"
#include "series/series_mesh.h"
#include "tool/support.h"

namespace shm::converters {

class ToolInput {
 public:
  // Opens the input and reads its first bytes. If a temporary copy is needed, it is written to
  // spool_directory(options), and its path is stored in options.spooled, for messages. Throws
  // Failure.
  explicit ToolInput(CommonOptions& options) : ToolInput(options, options.input) {}
  ToolInput(CommonOptions& options, const std::string& path)
      : ToolInput(options, path, options.part) {}
  ToolInput(CommonOptions& options, const std::string& path, std::string part);
  ~ToolInput();
  ToolInput(const ToolInput&) = delete;
  ToolInput& operator=(const ToolInput&) = delete;

  // Returns the path of the input file or of its temporary copy. Call this only if is_stream()
  // returns false.
  const std::string& path() const { return path_; }
  bool is_stream() const { return stream_ != nullptr; }
  bool is_series() const { return series_.has_value(); }
  std::uint64_t bytes() const;  // size of all input files in bytes; 0 if unknown
  bool is_shm() const;
  // Throws Failure if the input is not a .shm file.
  void require_shm() const;

  // Opens the mesh. If the input is an archive, opens the member that --part names, or the only
  // member. Call this only once. Throws Failure.
  std::unique_ptr<MeshSource> open(Spool& spool, const Progress& progress, unsigned threads = 0);
  FileSummary summarize(const Progress& progress);

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;   // a .shm file that is packed or comes through a pipe
  std::unique_ptr<FileSink> spool_;  // temporary copy of the input
  std::optional<RemovedOnSignals> on_signals_;
  std::string name_, path_, part_;
  std::optional<std::vector<SeriesFile>> series_;
};

// Returns true if the file at `path` is packed with gzip, xz or zstd. Returns false for all other
// files, and for files that cannot be read or can be read only once.
bool is_packed(const std::string& path);

// Returns the archive member that is named `part`. If `part` is empty, returns the only member.
// Throws Failure (misuse) with a list of the members if no member has this name, or if `part` is
// empty and the archive has several members.
const ArchiveMember& part_of(const std::vector<ArchiveMember>& members, const std::string& part,
                             const std::string& path);

// Prints a remark to standard error, for example that a file of a series differs from the first
// file.
void print_remark(const std::string& sentence);

}  // namespace shm::converters
