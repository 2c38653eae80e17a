// Reads the contents of a file compressed by gzip, xz or zstd from beginning to end, using
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

// Returns the name without the extension of the compression, e.g. "run.e" for "run.e.gz". Other
// names are returned unchanged.
std::string unpacked_name(const std::string& path);

class UnpackedSource final : public ByteSource {
 public:
  // `name` is used in messages. Throws Failure if libarchive cannot be loaded.
  UnpackedSource(std::unique_ptr<ByteSource> packed, std::string name);
  ~UnpackedSource() override;
  UnpackedSource(const UnpackedSource&) = delete;
  UnpackedSource& operator=(const UnpackedSource&) = delete;

  // Reads decompressed bytes. Returns the errors of the packed source, and corrupt if the data
  // cannot be decompressed.
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
  Result<void> refusal_;  // error of the packed source, if it reported one
  std::unique_ptr<archive, Closed> reader_;
  // begun_: reading has begun. at_end_: the packed source is at its end.
  bool begun_ = false, at_end_ = false;
};

}  // namespace shm::converters
