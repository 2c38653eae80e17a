// Reads arbitrary bytes as an AVS UCD file. The result must be a complete mesh or a Failure.
#include "ucd/ucd.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>

#include "base/failure.h"
#include "base/spool.h"
#include "memory_file.h"
#include "read_everything.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const MemoryFile file(data, size);
  shm::converters::Spool spool(std::filesystem::temp_directory_path().string());
  try {
    const auto mesh = shm::converters::open_ucd(file.path(), spool);
    read_everything(*mesh);
  } catch (const shm::converters::Failure&) {
  }
  return 0;
}
