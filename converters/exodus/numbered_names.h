// Abbreviates names that contain consecutive numbers. The skeleton text of files with more or fewer
// blocks, sets and so on then consists of the same lines, which compress well with the dictionary.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters::exodus {

// Abbreviates names that differ only in their numbers (elem_ss1, elem_ss2 ...). Replaces a number
// with '#' if it is one more than the corresponding number in the previous name of this kind. In
// the first name of a kind, replaces the number 1 with '#'. Names must be escaped, so that they
// contain no other '#'.
class NumberedNames {
 public:
  std::string shortened(std::string_view name) { return next(name, false); }
  std::string expanded(std::string_view text) { return next(text, true); }

 private:
  std::string next(std::string_view text, bool expand);

  // The key is a kind: a name with '#' in place of each number. The value contains the numbers in
  // the most recent name of this kind.
  std::map<std::string, std::vector<std::uint64_t>> last_;
};

// Returns the last number in a name. Returns an empty string if the name has no number, or if the
// number is very long. Very long numbers are excluded, because '#' can represent the last number
// many times: a small file could otherwise expand to far more text than it contains.
std::string last_number(std::string_view name);
// Abbreviates a dimension name in the line of a variable. `own` is the last number in the name of
// the variable. Each number that equals `own` is replaced with '#'.
std::string shortened_beside(const std::string& own, std::string_view name);
std::string expanded_beside(const std::string& own, std::string_view text);

}  // namespace shm::converters::exodus
