#include "model/temporary_names.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <span>
#include <system_error>

#include "bytes/binary.h"

namespace shm {

std::string temporary_front(const std::string& path, std::size_t name) {
  constexpr std::size_t kLongest = 200;  // bytes; numbers follow
  std::size_t end = std::min(path.size(), name + kLongest);
  // No half a character of UTF-8, which some systems take for no name.
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

std::optional<Maker> maker_of(std::string_view behind_front, std::string_view machine) {
  Maker maker;
  const auto [end, error] = std::from_chars(
      behind_front.data(), behind_front.data() + behind_front.size(), maker.process);
  if (error != std::errc() || maker.process <= 0) return std::nullopt;
  behind_front.remove_prefix(static_cast<std::size_t>(end - behind_front.data()));
  if (!behind_front.starts_with('-')) return std::nullopt;
  behind_front.remove_prefix(1);
  maker.here = behind_front.substr(0, behind_front.find('-')) == machine;
  return maker;
}

}  // namespace shm
