// Names that count up, written so that files of other numbers have the same text.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters::exodus {

// Of names that differ in their numbers only (elem_ss1, elem_ss2 ...) each number that is one more
// than the one at its place in the name before, or 1 at first, is written as '#'. Works on escaped
// names, in which '#' stands for nothing else.
class NumberedNames {
 public:
  std::string shortened(std::string_view name) { return next(name, false); }
  std::string expanded(std::string_view text) { return next(text, true); }

 private:
  std::string next(std::string_view text, bool expand);

  std::map<std::string, std::vector<std::uint64_t>> last_;  // by name with '#' for all numbers
};

// The last number of a name; empty when it has none, or one so long that many '#' for it would be
// far more text than a damaged file has.
std::string last_number(std::string_view name);
// A name that is mentioned beside another one: '#' for each number that is `own`, the last one of
// that other.
std::string shortened_beside(const std::string& own, std::string_view name);
std::string expanded_beside(const std::string& own, std::string_view text);

}  // namespace shm::converters::exodus
