// Temporary names of files that are still being written: ".NAME.tmpPROCESS-MACHINE" in the same
// folder, with "-N" appended if that name is already used.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace shm {

/// Returns the folder and the beginning of the temporary name, which depend only on `path`, the
/// final name. Long names are cut off. The file name begins at index `name` of `path`.
std::string temporary_front(const std::string& path, std::size_t name);

std::string temporary_name(const std::string& path, std::size_t name, int process,
                           const std::string& machine, int attempt);
inline constexpr int kMostAttempts = 100;

/// Returns a short name, a hexadecimal checksum, for the machine that is described by `text`.
std::string machine_name(std::string_view text);

/// The process that created a temporary file. maker_of() derives it from the rest of the file name
/// after temporary_front(), and returns nullopt if the rest has another form.
struct Maker {
  int process = 0;
  bool here = false;  // true: the process runs or ran on `machine`
};
std::optional<Maker> maker_of(std::string_view after_front, std::string_view machine);

}  // namespace shm
