// Abbreviates names that contain consecutive numbers, so that files with different numbers of items
// have the same text.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters::exodus {

// Abbreviates names that differ only in their numbers (elem_ss1, elem_ss2 ...). A number is
// replaced by '#' if it is one more than the number at the same place in the previous such name, or
// 1 in the first name. Works on escaped names, which contain no other '#'.
class NumberedNames {
 public:
  std::string shortened(std::string_view name) { return next(name, false); }
  std::string expanded(std::string_view text) { return next(text, true); }

 private:
  std::string next(std::string_view text, bool expand);

  // Last numbers, by the name with '#' for all numbers.
  std::map<std::string, std::vector<std::uint64_t>> last_;
};

// Returns the last number of a name. Returns an empty string if the name has no number, or if the
// number is so long that replacing many '#' by it would produce far more text than the file has.
std::string last_number(std::string_view name);
// Abbreviates a name that is mentioned next to another name. Each number that equals `own`, the
// last number of the other name, is replaced by '#'.
std::string shortened_beside(const std::string& own, std::string_view name);
std::string expanded_beside(const std::string& own, std::string_view text);

}  // namespace shm::converters::exodus
