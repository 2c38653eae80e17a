// OutputFile: a file that appears whole under its name or not at all: a FileSink (shm/io.h) that is
// also written by name, that takes no devices, and whose temporary file, where it has a name, is
// removed by SIGINT, SIGTERM and SIGHUP after remove_outputs_on_signals().
#pragma once

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "shm/io.h"

namespace shm::converters {

// A file that remove_outputs_on_signals() removes while this lives. A few at a time in a process;
// of more, those that come first.
class RemovedOnSignals {
 public:
  // `name` is borrowed, and must not move.
  explicit RemovedOnSignals(const char* name);
  ~RemovedOnSignals();
  RemovedOnSignals(const RemovedOnSignals&) = delete;
  RemovedOnSignals& operator=(const RemovedOnSignals&) = delete;

  // Holds the signals back while a file is there and its name is not yet registered.
  class Pause;

 private:
  std::size_t place_;
};
class RemovedOnSignals::Pause {
 public:
  Pause();
  ~Pause();
  Pause(const Pause&) = delete;
  Pause& operator=(const Pause&) = delete;

 private:
  sigset_t before_;
};

class OutputFile {
 public:
  // Creates the temporary file, empty. Throws Failure (output).
  // "-" is standard output: it gets all at commit, from a temporary file in `folder`.
  // `how`: named for libraries that take no name in /proc.
  explicit OutputFile(std::string path, const std::string& folder = {},
                      FileSink::Temporary how = FileSink::Temporary::unnamed);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::string& path() const { return path_; }
  const std::string& temporary() const { return sink_->temporary(); }  // write here, by name
  void write(std::span<const std::byte> bytes);                        // or here, front to back
  // Or here, likewise. Its commit(), which who writes a .shm file calls, is left to commit() below:
  // parity may follow, or an error.
  ByteSink& sink() { return uncommitted_; }
  // Flushes to the disk and gives the file its name. Throws Failure (output).
  void commit();

  // The folder of a file, even of one that is in /proc only.
  static std::string folder_of(const std::string& path);

 private:
  class Uncommitted final : public ByteSink {
   public:
    explicit Uncommitted(const std::unique_ptr<FileSink>& sink) : sink_(&sink) {}
    Result<void> write(std::span<const std::byte> bytes) override { return (*sink_)->write(bytes); }
    Result<void> copy(RandomSource& from, std::uint64_t offset, std::uint64_t bytes) override {
      return (*sink_)->copy(from, offset, bytes);
    }

   private:
    const std::unique_ptr<FileSink>* sink_;
  };

  std::string path_;
  std::unique_ptr<FileSink> sink_;
  Uncommitted uncommitted_{sink_};
  std::optional<RemovedOnSignals> on_signals_;  // where the temporary file has a name
};

// From here on a signal that ends the process first removes open OutputFiles and their like.
void remove_outputs_on_signals();

}  // namespace shm::converters
