#include "tool/running/failures.h"

#include <poll.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "base/failure.h"

namespace shm::converters {
namespace {

// Returns true if standard output is a pipe and the program that reads it has exited, as in `shm
// info x | head`. This is not an error.
bool nobody_listens() {
  struct pollfd out = {STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
}

// Returns true if the file at `path` begins with the signature of .shm files.
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

// Reports that there is not enough memory. Allocates no memory itself.
int complain_of_memory(const Command* chosen) noexcept {
  std::fputs("shm: ", stderr);
  for (const char c : chosen != nullptr ? std::string_view(chosen->input) : std::string_view()) {
    const auto byte = static_cast<unsigned char>(c);
    std::fputc(byte >= 0x20 && byte != 0x7f ? c : '?', stderr);
  }
  std::fputs(": needs more memory than there is\n", stderr);
  return kLimit;
}

// Reports the exception that is being handled. Returns its exit code.
int complain_of_failure(const Command* chosen) {
  const auto input = [&] { return chosen != nullptr ? chosen->input : std::string(); };
  try {
    throw;
  } catch (const Failure& failure) {
    Error error = failure.error();
    if (chosen != nullptr && !chosen->spooled.empty() && error.file == chosen->spooled)
      error.file = chosen->spooled_from;
    if (error.file.empty() && error.code != ErrorCode::misuse) error.file = input();
    const bool damaged = error.code == ErrorCode::corrupt || error.code == ErrorCode::truncated;
    if (damaged && chosen != nullptr && !chosen->names_repair() && is_shm_file(error.file))
      error.detail +=
          "; shm verify lists the damage, shm repair -o OUT.shm writes the undamaged parts";
    return complain(exit_code(error.code), error.message());
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::length_error&) {
    throw;
  } catch (const std::exception& error) {
    return complain(kBadInput, input() + ": " + error.what());
  }
}

}  // namespace

int code_of_failure(const Command* chosen) noexcept {
  try {
    return complain_of_failure(chosen);
  } catch (...) {  // the command, or the code that composes the message, ran out of memory
    return complain_of_memory(chosen);
  }
}

}  // namespace shm::converters
