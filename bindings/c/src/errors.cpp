#include "errors.h"

#include <algorithm>
#include <cstring>
#include <string_view>

namespace shmf {
namespace {

/// Copies `text` and a terminating 0. If the text does not fit, it is cut between two UTF-8
/// characters.
template <std::size_t room>
void copy_text(char (&to)[room], std::string_view text) noexcept {
  std::size_t length = std::min(text.size(), room - 1);
  const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xc0) == 0x80; };
  if (length < text.size())
    while (length > 0 && continues(text[length])) --length;
  std::memcpy(to, text.data(), length);
  std::memset(to + length, 0, room - length);
}

shmf_status fill(shmf_error* error, shmf_status status, std::uint64_t offset,
                 std::string_view section, std::string_view detail,
                 std::string_view message) noexcept {
  if (error == nullptr) return status;
  error->status = status;
  error->reserved = 0;
  error->offset = offset;
  copy_text(error->section, section);
  copy_text(error->detail, detail);
  copy_text(error->message, message);
  return status;
}

}  // namespace

shmf_status report(shmf_error* error, const shm::Error& why) {
  const auto status = static_cast<shmf_status>(why.code);
  return fill(error, status, why.offset, why.section, why.detail,
              error == nullptr ? std::string() : why.message());
}

shmf_status report_no_memory(shmf_error* error) noexcept {
  return fill(error, SHMF_NO_MEMORY, SHMF_NO_OFFSET, "", "out of memory", "out of memory");
}

shmf_status report_other(shmf_error* error, const char* what) noexcept {
  return fill(error, SHMF_IO, SHMF_NO_OFFSET, "", what, what);
}

}  // namespace shmf

uint32_t shmf_version(void) { return SHMF_VERSION; }

#define SHMF_TEXT_OF(number) #number
#define SHMF_TEXT(number) SHMF_TEXT_OF(number)
const char* shmf_version_string(void) {
  return SHMF_TEXT(SHMF_VERSION_MAJOR) "." SHMF_TEXT(SHMF_VERSION_MINOR) "." SHMF_TEXT(
      SHMF_VERSION_PATCH);
}

const char* shmf_status_name(int32_t status) {
  constexpr const char* kNames[] = {"ok",         "io",     "truncated", "corrupt",   "unsupported",
                                    "over limit", "misuse", "output",    "no memory", "cancelled"};
  return status >= 0 && status <= SHMF_CANCELLED ? kNames[status] : "unknown";
}
