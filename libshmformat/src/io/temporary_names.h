// Temporary names of files that are still being written. Such a name is ".NAME.tmpPROCESS-MACHINE"
// in the same folder, with "-N" appended if that name is already used.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace shm {

/// Returns the folder and the beginning of the temporary name, which depend only on `path`, the
/// final path. Long names are cut off. The file name begins at index `name` of `path`.
std::string temporary_front(const std::string& path, std::size_t name);

std::string temporary_name(const std::string& path, std::size_t name, int process,
                           const std::string& machine, int attempt);
inline constexpr int kMostAttempts = 100;

/// Returns a short name for the machine described by `text`: a hexadecimal checksum.
std::string machine_name(std::string_view text);

/// Process that created a temporary file. maker_of() derives it from the part of the file name
/// after temporary_front(). It returns nullopt if this part has another form.
struct Maker {
  int process = 0;
  bool here = false;  // true: the process runs or ran on the machine passed to maker_of()
};
std::optional<Maker> maker_of(std::string_view after_front, std::string_view machine);

}  // namespace shm
