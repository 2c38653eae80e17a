// OutputFile: a file that appears whole under its name or not at all.
// It is written under a temporary name beside the final one, flushed and renamed by commit(),
// and removed on destruction and, after remove_outputs_on_signals(), by SIGINT, SIGTERM and SIGHUP.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "shm/io.h"

namespace shm::converters {

class OutputFile {
 public:
  // Creates the temporary file, empty. Throws Failure (output). One at a time in a process.
  explicit OutputFile(std::string path);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::string& temporary() const { return temporary_; }  // write here, by name
  void write(std::span<const std::byte> bytes);                // or here, front to back
  // Flushes to the disk and gives the file its name. Throws Failure (output).
  void commit();

 private:
  [[noreturn]] void fail(const char* what) const;
  std::string path_, temporary_;
  int descriptor_ = -1;
};

// The same as a sink of the library.
class OutputSink final : public ByteSink {
 public:
  explicit OutputSink(OutputFile& file) : file_(&file) {}
  Result<void> write(std::span<const std::byte> bytes) override;

 private:
  OutputFile* file_;
};

// From here on a signal that ends the process first removes the OutputFile that is open.
void remove_outputs_on_signals();

}  // namespace shm::converters
