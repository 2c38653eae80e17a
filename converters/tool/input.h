// The mesh that a command of the tool reads: a file, standard input for "-", or a pipe, either
// plain or packed by gzip, xz or zstd. A .shm file that is packed or comes through a pipe is
// decoded as it arrives. Any other packed or piped input is first copied to a temporary file, since
// its reader needs to seek. A name for many files, or a collection, is opened as a series.
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
  // Opens the input and reads its first bytes. A temporary copy is written to
  // spool_directory(options). Its name is stored in options.spooled, for messages. Throws Failure.
  explicit ToolInput(CommonOptions& options) : ToolInput(options, options.input) {}
  ToolInput(CommonOptions& options, const std::string& path)
      : ToolInput(options, path, options.part) {}
  ToolInput(CommonOptions& options, const std::string& path, std::string part);
  ~ToolInput();
  ToolInput(const ToolInput&) = delete;
  ToolInput& operator=(const ToolInput&) = delete;

  // The path of a file with the whole input. Requires !is_stream().
  const std::string& path() const { return path_; }
  bool is_stream() const { return stream_ != nullptr; }
  bool is_series() const { return series_.has_value(); }
  std::uint64_t bytes() const;  // size of all input files in bytes; 0 if unknown
  bool is_shm() const;
  // Throws Failure if the input is not a .shm file.
  void require_shm() const;

  // Opens the mesh. If the input is an archive, opens the part that the options name, or the only
  // part. Call this once. Throws Failure.
  std::unique_ptr<MeshSource> open(Spool& spool, const Progress& progress, unsigned threads = 0);
  FileSummary summarize(const Progress& progress);

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;   // a .shm file that comes through a pipe
  std::unique_ptr<FileSink> spool_;  // temporary copy of the input
  std::optional<RemovedOnSignals> on_signals_;
  std::string name_, path_, part_;
  std::optional<std::vector<SeriesFile>> series_;
};

// Returns true if a file is packed by gzip, xz or zstd; false if it cannot be read, or can be read
// only once.
bool is_packed(const std::string& path);

// Returns the part of an archive with this name, or its only part. Throws Failure (misuse) that
// lists the parts.
const ArchiveMember& part_of(const std::vector<ArchiveMember>& members, const std::string& part,
                             const std::string& path);

// Prints a remark to standard error, for example on a file of a series that differs from the first.
void print_remark(const std::string& sentence);

}  // namespace shm::converters
