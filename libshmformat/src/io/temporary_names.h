// Temporary names of files that are still being written. Such a name is ".NAME.tmpPROCESS-MACHINE"
// in the same folder, with "-N" appended if that name is already used.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace shm {

/// Returns the part of the temporary name that depends only on `path`, the final path: the folder
/// and the beginning of the file name. Long names are truncated. `name` is the index in `path` at
/// which the file name begins.
std::string temporary_front(const std::string& path, std::size_t name);

std::string temporary_name(const std::string& path, std::size_t name, int process,
                           const std::string& machine, int attempt);
inline constexpr int kMostAttempts = 100;

/// Returns a short name for a machine: the checksum of `text`, which describes the machine, in
/// hexadecimal.
std::string machine_name(std::string_view text);

/// Process that created a temporary file. maker_of() determines it from the part of the file name
/// after temporary_front(). maker_of() returns nullopt if this part is not that of a temporary
/// name.
struct Maker {
  int process = 0;
  bool here = false;  // true if the process runs or ran on the machine passed to maker_of()
};
std::optional<Maker> maker_of(std::string_view after_front, std::string_view machine);

}  // namespace shm
