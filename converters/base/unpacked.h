// UnpackedSource: decompresses a file that was compressed with gzip, xz or zstd, from beginning to
// end. Uses libarchive.
#pragma once

#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "shm/io.h"

struct archive;

namespace shm::converters {

// Returns `path` without the extension of a compression format, e.g. "run.e" for "run.e.gz".
// Returns other paths unchanged.
std::string unpacked_name(const std::string& path);

class UnpackedSource final : public ByteSource {
 public:
  // `name` is used in messages. Throws Failure if libarchive cannot be loaded.
  UnpackedSource(std::unique_ptr<ByteSource> packed, std::string name);
  ~UnpackedSource() override;
  UnpackedSource(const UnpackedSource&) = delete;
  UnpackedSource& operator=(const UnpackedSource&) = delete;

  // Reads decompressed bytes. If reading the compressed source fails, returns the error of that
  // source. If the data cannot be decompressed, returns the error `corrupt`.
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
  Result<void> refusal_;  // error of the compressed source, if it reported one
  std::unique_ptr<archive, Closed> reader_;
  // begun_ is true if reading has begun. at_end_ is true if all bytes of the compressed source have
  // been read.
  bool begun_ = false, at_end_ = false;
};

}  // namespace shm::converters
