// The mesh that a command of the tool reads: a file, standard input for "-", a pipe, each as it is
// or packed by gzip, xz or zstd. A .shm file that comes through a pipe or packed is read as it
// comes; anything else then goes to a temporary file first, since its reader needs to seek.
// A name of many files, and a collection, are a series of them.
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
  // Of standard input reads the beginning. What is spooled goes to spool_directory(options), and
  // its name to options.spooled, for messages. Throws Failure.
  explicit ToolInput(CommonOptions& options) : ToolInput(options, options.input) {}
  ToolInput(CommonOptions& options, const std::string& path)
      : ToolInput(options, path, options.part) {}
  ToolInput(CommonOptions& options, const std::string& path, std::string part);
  ~ToolInput();
  ToolInput(const ToolInput&) = delete;
  ToolInput& operator=(const ToolInput&) = delete;

  // A file with all of it, where is_stream() is false.
  const std::string& path() const { return path_; }
  bool is_stream() const { return stream_ != nullptr; }
  bool is_series() const { return series_.has_value(); }
  std::uint64_t bytes() const;  // of all files; 0 where that is not known
  bool is_shm() const;
  // Throws Failure where it is none.
  void require_shm() const;

  // Once. Of an archive the part that the options name, or its only one. Throws Failure.
  std::unique_ptr<MeshSource> open(Spool& spool, const Progress& progress, unsigned threads = 0);
  FileSummary summarize(const Progress& progress);

 private:
  class Stream;
  std::unique_ptr<Stream> stream_;   // of a .shm file that comes through a pipe
  std::unique_ptr<FileSink> spool_;  // holds what came
  std::optional<RemovedOnSignals> on_signals_;
  std::string name_, path_, part_;
  std::optional<std::vector<SeriesFile>> series_;
};

// Whether a file was packed by gzip, xz or zstd; false where it cannot be read, or only once.
bool is_packed(const std::string& path);

// The part of an archive of that name, or its only one. Throws Failure (misuse) naming all.
const ArchiveMember& part_of(const std::vector<ArchiveMember>& members, const std::string& part,
                             const std::string& path);

// Prints what of a series is not that of its first file.
void print_remark(const std::string& sentence);

}  // namespace shm::converters
