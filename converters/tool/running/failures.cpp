#include "tool/running/failures.h"

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include "base/failure.h"

namespace shm::converters {
namespace {

// Whether standard output is a pipe that nobody reads any more: `shm info x | head` is no mistake.
bool nobody_listens() {
  struct pollfd out = {STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
}

// Whether `path` is a file, and a .shm file by its beginning.
bool is_shm_file(const std::string& path) {
  std::error_code none;
  try {
    return std::filesystem::is_regular_file(path, none) && is_shm(path);
  } catch (const Failure&) {
    return false;
  }
}

int complain(int code, const std::string& sentence) {
  if (code == kBadOutput && nobody_listens()) return code;
  std::fprintf(stderr, "shm: %s\n", printable(sentence).c_str());
  return code;
}

}  // namespace

int reported(const Command* const& chosen, const std::function<int()>& work) {
  const auto input = [&] { return chosen != nullptr ? chosen->input : std::string(); };
  try {
    return work();
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (chosen != nullptr && !chosen->spooled.empty() && error.file == chosen->spooled)
      error.file = chosen->spooled_from;
    if (error.file.empty() && error.code != ErrorCode::misuse) error.file = input();
    const bool damaged = error.code == ErrorCode::corrupt || error.code == ErrorCode::truncated;
    if (damaged && chosen != nullptr && !chosen->names_repair() && is_shm_file(error.file))
      error.detail += "; shm verify lists what is damaged, shm repair -o OUT.shm writes the rest";
    return complain(exit_code(error.code), error.message());
  } catch (const std::bad_alloc&) {
    return complain(kLimit, input() + ": needs more memory than there is");
  } catch (const std::length_error&) {
    return complain(kLimit, input() + ": needs more memory than there is");
  } catch (const std::exception& error) {
    return complain(kBadInput, input() + ": " + error.what());
  }
}

}  // namespace shm::converters
