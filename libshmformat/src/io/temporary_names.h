// Names of files that do not have their final name yet: ".NAME.tmpPROCESS-MACHINE" in the same
// folder, with "-N" appended if that name is taken.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace shm {

/// Returns the folder and the beginning of the temporary name, which depends only on the final name
/// (long names are cut off). The file name begins at index `name` of `path`.
std::string temporary_front(const std::string& path, std::size_t name);

std::string temporary_name(const std::string& path, std::size_t name, int process,
                           const std::string& machine, int attempt);
inline constexpr int kMostAttempts = 100;

/// Returns a short name for a machine that is described by `text`.
std::string machine_name(std::string_view text);

/// The creator of a temporary file, from the part of the file name after the front. maker_of()
/// returns nullopt if it is not such a name.
struct Maker {
  int process = 0;
  bool here = false;  // the process runs or ran on `machine`
};
std::optional<Maker> maker_of(std::string_view after_front, std::string_view machine);

}  // namespace shm
