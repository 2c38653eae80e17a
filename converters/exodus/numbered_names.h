// Abbreviates names that contain consecutive numbers. Files with different numbers of blocks, sets
// and so on then have the same text.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace shm::converters::exodus {

// Abbreviates names that differ only in their numbers (elem_ss1, elem_ss2 ...). Replaces a number
// by '#' if it is one more than the number at the same place in the previous such name, or if it is
// 1 in the first such name. Requires escaped names, which contain no other '#'.
class NumberedNames {
 public:
  std::string shortened(std::string_view name) { return next(name, false); }
  std::string expanded(std::string_view text) { return next(text, true); }

 private:
  std::string next(std::string_view text, bool expand);

  // Numbers of the last name of each kind. The key is the name with '#' for each number.
  std::map<std::string, std::vector<std::uint64_t>> last_;
};

// Returns the last number of a name. Returns an empty string if the name has no number. Also
// returns an empty string if the number is very long: replacing many '#' by such a number would
// produce far more text than the file has.
std::string last_number(std::string_view name);
// Abbreviates a name that is mentioned next to another name. Replaces each number that equals `own`
// by '#'; `own` is the last number of the other name.
std::string shortened_beside(const std::string& own, std::string_view name);
std::string expanded_beside(const std::string& own, std::string_view text);

}  // namespace shm::converters::exodus
