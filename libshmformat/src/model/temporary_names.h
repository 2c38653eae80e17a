// What a file is called that has not got its own name yet: ".NAME.tmpPROCESS-MACHINE" beside it,
// and -N where that is taken.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace shm {

/// The front, which says for which file it is; of a long name its beginning. `path` has its name
/// from `name` on.
std::string temporary_front(const std::string& path, std::size_t name);

std::string temporary_name(const std::string& path, std::size_t name, int process,
                           const std::string& machine, int attempt);
inline constexpr int kMostAttempts = 100;

/// A short name for the machine of which `text` says all that is known.
std::string machine_name(std::string_view text);

/// Who has made a file, by what stands behind the front of its name. None where it is no such name.
struct Maker {
  int process = 0;
  bool here = false;  // on `machine`
};
std::optional<Maker> maker_of(std::string_view behind_front, std::string_view machine);

}  // namespace shm
