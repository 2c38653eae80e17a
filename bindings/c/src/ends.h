// Sources and sinks whose bytes come from and go to functions of the caller; what watches a run.
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

/// Where the library would take a "-" for standard input or output, it is a file like others.
inline std::string path_of(const char* path) {
  const std::string name(path);
  return name == "-" ? "./-" : name;
}

/// Bytes that a function of the caller gives. Closes when it is destroyed.
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

/// With as many threads as the caller wants.
shm::ReadOptions read_options(const shmf_run_options& run);

/// Tells the caller how far a run is.
class Watch {
 public:
  explicit Watch(const shmf_run_options& run) : run_(run) {}
  /// `done` of `all` is done. Fails where the caller wants no more.
  shm::Result<void> tell(double done, double all);

 private:
  shmf_run_options run_;
  double told_ = -1;
};

}  // namespace shmf
