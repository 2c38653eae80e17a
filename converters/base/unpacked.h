// What is in files that gzip, xz or zstd made, read from their beginning to their end by
// libarchive.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "shm/io.h"

struct archive;

namespace shm::converters {

// The name that the file had before: "run.e" of "run.e.gz"; any other name as it is.
std::string unpacked_name(const std::string& path);

class UnpackedSource final : public ByteSource {
 public:
  // `name` is for messages. Throws Failure where libarchive does not load.
  UnpackedSource(std::unique_ptr<ByteSource> packed, std::string name);
  ~UnpackedSource() override;
  UnpackedSource(const UnpackedSource&) = delete;
  UnpackedSource& operator=(const UnpackedSource&) = delete;

  // Errors: those of the packed source, and corrupt where it does not unpack.
  Result<std::size_t> read(std::span<std::byte> into) override;

 private:
  struct Closed {
    void operator()(archive* reader) const;
  };
  static std::ptrdiff_t give(archive* reader, void* self, const void** bytes);
  Error error() const;

  std::unique_ptr<ByteSource> packed_;
  std::string name_;
  std::vector<std::byte> piece_;
  Result<void> refusal_;  // of the packed source
  std::unique_ptr<archive, Closed> reader_;
  bool begun_ = false, at_end_ = false;  // of the packed source
};

}  // namespace shm::converters
