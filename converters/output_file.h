// OutputFile: a file that appears whole under its name or not at all: a FileSink (shm/io.h) that is
// also written by name, that takes no devices, and whose temporary file, where it has a name, is
// removed by SIGINT, SIGTERM and SIGHUP after remove_outputs_on_signals().
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "shm/io.h"

namespace shm::converters {

class OutputFile {
 public:
  // Creates the temporary file, empty. Throws Failure (output). One at a time in a process.
  // "-" is standard output: it gets all at commit, from a temporary file in `folder`.
  // `how`: named for libraries that take no name in /proc.
  explicit OutputFile(std::string path, const std::string& folder = {},
                      FileSink::Temporary how = FileSink::Temporary::unnamed);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::string& temporary() const { return sink_->temporary(); }  // write here, by name
  void write(std::span<const std::byte> bytes);                        // or here, front to back
  FileSink& sink() { return *sink_; }                                  // or here, likewise
  // Flushes to the disk and gives the file its name. Throws Failure (output).
  void commit();

  // The folder of a file, even of one that is in /proc only.
  static std::string folder_of(const std::string& path);

 private:
  std::string path_;
  std::unique_ptr<FileSink> sink_;
};

// From here on a signal that ends the process first removes the OutputFile that is open.
void remove_outputs_on_signals();

}  // namespace shm::converters
