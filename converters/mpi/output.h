// SharedOutput: one file that all ranks write with MPI-IO, and that appears whole or not at all.
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
  // Collective. A temporary file beside `path`, of rank 0, which all ranks must see. `ranks` is
  // borrowed. Throws SharedFailure (output).
  SharedOutput(Ranks& ranks, std::string path);
  ~SharedOutput();
  SharedOutput(const SharedOutput&) = delete;
  SharedOutput& operator=(const SharedOutput&) = delete;

  // Not collective. Throws Failure (output).
  void write(std::uint64_t offset, std::span<const std::byte> bytes);
  // Collective. All is on the disk, and then the file has its name.
  void commit();

 private:
  struct Handle;
  void close();

  Ranks* ranks_;
  std::string path_;
  std::optional<OutputFile> file_;  // of rank 0
  std::unique_ptr<Handle> handle_;
};

}  // namespace shm::converters
