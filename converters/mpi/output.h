// SharedOutput: one file that all ranks write with MPI-IO. They write to a temporary file, which is
// renamed to the final name when it is complete.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "base/output_file.h"
#include "exodus/parts/ranks.h"

namespace shm::converters {

class SharedOutput {
 public:
  // Collective. Rank 0 creates a temporary file in the folder of `path`. All ranks must see this
  // folder. `ranks` is borrowed. Throws SharedFailure (output).
  SharedOutput(Ranks& ranks, std::string path);
  ~SharedOutput();
  SharedOutput(const SharedOutput&) = delete;
  SharedOutput& operator=(const SharedOutput&) = delete;

  // Writes bytes at position `offset` of the file. Not collective. Throws Failure (output).
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  // Collective. Flushes the file to disk, then renames it to its final name.
  void commit();

 private:
  struct Handle;
  void close();

  Ranks* ranks_;
  std::string path_;
  std::optional<OutputFile> file_;  // set on rank 0 only
  std::unique_ptr<Handle> handle_;
};

}  // namespace shm::converters
