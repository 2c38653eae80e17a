// OutputFile: a file that appears whole under its name or not at all: a FileSink (shm/io.h) that is
// also written by name, and whose temporary file, where it has a name, is removed by SIGINT,
// SIGTERM and SIGHUP after remove_outputs_on_signals(). Devices and pipes get all of it at the end.
#pragma once

#include <csignal>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "shm/io.h"
#include "shm/schema.h"

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
  // "-", standard output, a device and a pipe get all at commit, from a temporary file in `folder`.
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
  bool is_stream_ = false;  // nothing to rename over
  std::unique_ptr<FileSink> sink_;
  Uncommitted uncommitted_{sink_};
  std::optional<RemovedOnSignals> on_signals_;  // where the temporary file has a name
};

// From here on a signal that ends the process first removes open OutputFiles and their like.
void remove_outputs_on_signals();

// NumberOutput: a file being written front to back: text, or numbers as text or big-endian bytes.
// Buffered; every refusal of the operating system is thrown as Failure (output).
class NumberOutput {
 public:
  NumberOutput(const std::string& path, bool binary);
  ~NumberOutput();
  NumberOutput(const NumberOutput&) = delete;
  NumberOutput& operator=(const NumberOutput&) = delete;

  bool binary() const { return binary_; }
  void text(std::string_view text);
  void line(std::string_view words) {
    text(words);
    text("\n");
  }
  // `count` values in host order. As text: separated by blanks, `per_line` to a line.
  void numbers(ScalarType type, const std::byte* values, std::size_t count, std::size_t per_line);
  // Ends the last line of a column of numbers.
  void end_column() {
    if (binary_ || in_line_ > 0) text("\n");
    in_line_ = 0;
  }
  // Bytes so far, and others over what stands at `offset`, all of them before position().
  std::uint64_t position() const { return flushed_ + buffer_.size(); }
  void patch(std::uint64_t offset, std::string_view text);
  // Hands everything to the operating system. The file is good only if this returns.
  void finish();

 private:
  template <class T>
  void number_text(const T* values, std::size_t count, std::size_t per_line);
  void flush();
  [[noreturn]] void fail(const char* what) const;

  std::string path_;
  bool binary_;
  int descriptor_ = -1;
  std::size_t in_line_ = 0;  // numbers in the current line
  std::uint64_t flushed_ = 0;
  std::vector<char> buffer_;
  std::vector<std::byte> swapped_;
};

}  // namespace shm::converters
