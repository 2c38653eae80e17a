// Sources and sinks that call the caller's functions, and the class Watch, which reports progress.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "errors.h"
#include "shm/io.h"
#include "shm/reader.h"
#include "shmformat.h"

namespace shmf {

/// Returns `path`, or "./-" for the path "-", because the library treats "-" as standard input or
/// output. In the C interface, "-" is the name of a file.
inline std::string path_of(const char* path) {
  const std::string name(path);
  return name == "-" ? "./-" : name;
}

/// A source that reads through the caller's function. The destructor closes the source.
class CallbackSource final : public shm::RandomSource {
 public:
  explicit CallbackSource(const shmf_source& source) : source_(source) {}
  ~CallbackSource() override {
    if (source_.close != nullptr) source_.close(source_.context);
  }
  CallbackSource(const CallbackSource&) = delete;
  CallbackSource& operator=(const CallbackSource&) = delete;
  std::uint64_t size() const override { return source_.bytes; }
  shm::Result<void> read_at(std::uint64_t offset, std::span<std::byte> into) override;
  void prefetch(std::span<const shm::ByteRange> ranges) override;

 private:
  shmf_source source_;
};

class CallbackSink final : public shm::ByteSink {
 public:
  using Write = int (*)(void* context, const void* bytes, std::uint64_t count);
  CallbackSink(Write taker, void* context) : write_(taker), context_(context) {}
  shm::Result<void> write(std::span<const std::byte> bytes) override;

 private:
  Write write_;
  void* context_;
};

/// Returns options for reading with the number of threads in `run`.
shm::ReadOptions read_options(const shmf_run_options& run);

/// Passes the progress of a library call to the caller's function progress().
class Watch {
 public:
  explicit Watch(const shmf_run_options& run) : run_(run) {}
  /// Reports the completed fraction, `done` / `all`. Fails if the caller cancels.
  shm::Result<void> tell(double done, double all);

 private:
  shmf_run_options run_;
  double told_ = -1;
};

}  // namespace shmf
