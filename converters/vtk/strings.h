// Lists of strings, as VTK's formats and the extras of .shm files store them, and arrays with one
// string per point or cell.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "mesh/mesh_source.h"
#include "vtk/words.h"

namespace shm::converters::vtk {

enum class StringForm : std::uint8_t {
  // Text of legacy files: each string (%-encoded) or variant is one line, with its '\n'.
  lines,
  // Binary legacy files: the length of each string precedes the string, and uses 1, 2, 4 or 8
  // bytes. The top two bits of the first byte of the length state its size: 3 for 1 byte, 2 for 2
  // bytes, 1 for 4 bytes, 0 for 8 bytes.
  lengths,
  zeros,  // XML files: each string ends with a zero byte
};
StringForm string_form(ValueForm form, bool binary);

// Splits `list`, the bytes of several strings, into strings. Each returned string includes its
// terminator or its length. Returns nothing if the list ends within a string.
std::optional<std::vector<std::string_view>> split_strings(std::string_view list, StringForm form);
// Converts a string that split_strings() returned to plain text. A variant is returned as its whole
// line.
std::string plain_string(std::string_view piece, StringForm form);
// Appends the string `plain` to `list`, in the encoding `form`, which is `lengths` or `zeros`. With
// `zeros`, the string is cut at its first zero byte.
void append_string(std::string& list, std::string_view plain, StringForm form);
// Converts a list of strings from the encoding `from` to the encoding `to`, which is `lengths` or
// `zeros`. Returns an empty list if `list` ends within a string.
std::string recoded(std::string_view list, StringForm from, StringForm to);

// Returns the size in bytes of the length that precedes a string in a binary file. `first` is the
// first byte of the length.
inline std::size_t length_bytes(std::byte first) {
  return std::size_t{8} >> (static_cast<unsigned>(first) >> 6);
}

// Collects the distinct strings of an array in a list.
class StringLister {
 public:
  // `most_bytes` is the approximate memory limit in bytes.
  explicit StringLister(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}
  // Returns the index of a string in the list. Appends the string if it is not in the list yet.
  // `piece` is the string in the StringForm of the list. Returns nothing if the memory limit is
  // reached.
  std::optional<std::uint32_t> place_of(const std::string& piece);
  const std::string& list() const { return list_; }

 private:
  std::uint64_t most_bytes_;
  std::unordered_map<std::string, std::uint32_t> places_;
  std::string list_;
};

// Role of arrays of points and cells whose elements are strings. The values of such an array are
// uint32 indices into a list of strings, which is the extra "vtk/strings/<index of the array>".
inline constexpr std::string_view kStringRole = "vtk:string";
inline constexpr std::string_view kStringLists = "vtk/strings/";
std::string strings_key(std::size_t array);

// Returns how the strings of an array with the role kStringRole are encoded. The encoding depends
// on whether the mesh came from a legacy or an XML file.
StringForm form_of_strings(const MeshInfo& info, std::size_t array);
// Returns the list of strings of an array with the role kStringRole, as plain strings. Returns an
// empty list if the extra with the list is missing or damaged.
std::vector<std::string> strings_of_array(const MeshInfo& info, std::size_t array);

}  // namespace shm::converters::vtk
