// OutputFile: a file that appears under its final name only when it is complete. It wraps a
// FileSink (shm/io.h); libraries can also open its temporary file by path and write to it. After a
// call to remove_outputs_on_signals(), the signals SIGINT, SIGTERM and SIGHUP remove a named
// temporary file. If the output is a device or a pipe, commit() sends all bytes to it.
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

// Registers a file as long as this object exists. If a signal arrives during this time, the
// handlers of remove_outputs_on_signals() remove the file. At most four files can be registered at
// a time; further files are not registered.
class RemovedOnSignals {
 public:
  // `name` is borrowed and must stay at the same address.
  explicit RemovedOnSignals(const char* name);
  ~RemovedOnSignals();
  RemovedOnSignals(const RemovedOnSignals&) = delete;
  RemovedOnSignals& operator=(const RemovedOnSignals&) = delete;

  // Blocks the signals as long as it exists. Used from the creation of a file to its registration:
  // a signal in between could not remove the file.
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
  // Creates an empty temporary file. Throws Failure (output). If the output is standard output
  // ("-"), a device or a pipe, the temporary file is in `folder`, and commit() copies its bytes to
  // the output. `how` selects a named or an unnamed temporary file; libraries that cannot open a
  // path in /proc need a named one.
  explicit OutputFile(std::string path, const std::string& folder = {},
                      FileSink::Temporary how = FileSink::Temporary::unnamed);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  const std::string& path() const { return path_; }
  const std::string& temporary() const { return sink_->temporary(); }  // path for writing by name
  void write(std::span<const std::byte> bytes);                        // writes front to back

  // Returns a sink for writing front to back. The writer of a .shm file calls commit() of this
  // sink. That call has no effect, because parity or an error may still follow. Only
  // OutputFile::commit() makes the file appear.
  ByteSink& sink() { return uncommitted_; }
  // Flushes the file to disk and renames it to its final name. Throws Failure (output).
  void commit();

  // Returns the folder of the file `path`. `path` may also be a link in /proc to an open file
  // without a name.
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
  bool is_stream_ = false;  // true: the output is a device, a pipe or standard output
  std::unique_ptr<FileSink> sink_;
  Uncommitted uncommitted_{sink_};
  // Removes the temporary file on a signal. Set only if the file has a name.
  std::optional<RemovedOnSignals> on_signals_;
};

// Installs signal handlers. From this call on, a signal that ends the process first removes the
// temporary files of open OutputFiles, and all other files registered by RemovedOnSignals.
void remove_outputs_on_signals();

// NumberOutput: a file of text and numbers that is written front to back. Numbers are written as
// text or as big-endian bytes. Output is buffered; every error of the operating system is thrown as
// Failure (output).
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
  // Writes `count` values, which are given in host byte order. If they are written as text, they
  // are separated by spaces, and each line has `per_line` values.
  void numbers(ScalarType type, const std::byte* values, std::size_t count, std::size_t per_line);
  // Ends the current line. A text file receives a newline only if the line contains numbers; a
  // binary file receives a newline in any case.
  void end_column() {
    if (binary_ || in_line_ > 0) text("\n");
    in_line_ = 0;
  }
  // position() returns the number of bytes written so far. patch() replaces the bytes at `offset`
  // with `text`; these bytes must have been written already.
  std::uint64_t position() const { return flushed_ + buffer_.size(); }
  void patch(std::uint64_t offset, std::string_view text);
  // Passes all buffered bytes to the operating system and closes the file. The file is complete
  // only if this call does not throw.
  void finish();

 private:
  template <class T>
  void number_text(const T* values, std::size_t count, std::size_t per_line);
  void flush();
  [[noreturn]] void fail(const char* what) const;

  std::string path_;
  bool binary_;
  int descriptor_ = -1;
  std::size_t in_line_ = 0;  // count of numbers in the current line
  std::uint64_t flushed_ = 0;
  std::vector<char> buffer_;
  std::vector<std::byte> swapped_;
};

}  // namespace shm::converters
