#include "io/temporary_names.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <span>
#include <system_error>

#include "base/binary.h"

namespace shm {

std::string temporary_front(const std::string& path, std::size_t name) {
  // Maximum length in bytes of a temporary name, without the process, machine and attempt.
  constexpr std::size_t kLongest = 200;
  std::size_t end = std::min(path.size(), name + kLongest);
  // A long name must not be cut inside a UTF-8 character, since some systems reject invalid UTF-8.
  while (end < path.size() && end > name && (static_cast<unsigned char>(path[end]) & 0xC0) == 0x80)
    --end;
  return path.substr(0, name) + "." + path.substr(name, end - name) + ".tmp";
}

std::string temporary_name(const std::string& path, std::size_t name, int process,
                           const std::string& machine, int attempt) {
  return temporary_front(path, name) + std::to_string(process) + "-" + machine +
         (attempt > 0 ? "-" + std::to_string(attempt) : "");
}

std::string machine_name(std::string_view text) {
  const std::uint32_t number = checksum(std::as_bytes(std::span(text)));
  char digits[8];
  const auto end = std::to_chars(digits, digits + sizeof digits, number, 16).ptr;
  return {digits, end};
}

std::optional<Maker> maker_of(std::string_view after_front, std::string_view machine) {
  Maker maker;
  const auto [end, error] =
      std::from_chars(after_front.data(), after_front.data() + after_front.size(), maker.process);
  if (error != std::errc() || maker.process <= 0) return std::nullopt;
  after_front.remove_prefix(static_cast<std::size_t>(end - after_front.data()));
  if (!after_front.starts_with('-')) return std::nullopt;
  after_front.remove_prefix(1);
  maker.here = after_front.substr(0, after_front.find('-')) == machine;
  return maker;
}

}  // namespace shm
