#include "exodus/numbered_names.h"

#include <charconv>
#include <cstddef>

namespace shm::converters::exodus {
namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Returns `text` in which each run of digits and each '#' is replaced by the result of `change`.
template <class Change>
std::string with_numbers_changed(std::string_view text, Change&& change) {
  std::string out;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = begin + 1;
    if (is_digit(text[begin]))
      while (end < text.size() && is_digit(text[end])) ++end;
    const std::string_view piece = text.substr(begin, end - begin);
    out += is_digit(piece[0]) || piece[0] == '#' ? change(piece) : std::string(piece);
    begin = end;
  }
  return out;
}

// Returns the value of `digits`. Returns 0 if `digits` is not a number or is too large.
std::uint64_t number_of(std::string_view digits) {
  std::uint64_t number = 0;
  std::from_chars(digits.data(), digits.data() + digits.size(), number);
  return number;
}

}  // namespace

std::string NumberedNames::next(std::string_view text, bool expand) {
  const std::string kind = with_numbers_changed(text, [](std::string_view) { return "#"; });
  std::vector<std::uint64_t>& last = last_[kind];
  std::size_t index = 0;
  return with_numbers_changed(text, [&](std::string_view number) {
    if (index == last.size()) last.push_back(0);
    const std::string expected = std::to_string(last[index] + 1);
    const bool as_expected = number == (expand ? "#" : expected);
    last[index++] = number_of(as_expected ? expected : number);
    return as_expected ? std::string(expand ? expected : "#") : std::string(number);
  });
}

std::string last_number(std::string_view name) {
  constexpr std::size_t kLongest = 20;
  std::string last;
  with_numbers_changed(name, [&](std::string_view number) { return last = number; });
  return last.size() > kLongest ? std::string() : last;
}

std::string shortened_beside(const std::string& own, std::string_view name) {
  return with_numbers_changed(
      name, [&](std::string_view number) { return number == own ? "#" : std::string(number); });
}

std::string expanded_beside(const std::string& own, std::string_view text) {
  return with_numbers_changed(
      text, [&](std::string_view number) { return number == "#" ? own : std::string(number); });
}

}  // namespace shm::converters::exodus
