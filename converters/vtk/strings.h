// Lists of strings, in the forms that VTK's formats and our extras keep them in, and what is made
// with them: the strings of an array of points or cells.
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
  lines,    // text of legacy files: each %-encoded, or a variant, on a line with its end
  lengths,  // binary legacy files: each behind its length in 1, 2, 4 or 8 bytes, whose first two
            // bits stand for that (3, 2, 1, 0)
  zeros,    // XML files: each ended by a 0
};
StringForm string_form(ValueForm form, bool binary);

// The strings of a list, each as it stands there, with its end or length. Nothing when the list
// ends within one.
std::optional<std::vector<std::string_view>> split_strings(std::string_view list, StringForm form);
// One of them as plain text; of a variant: its line.
std::string plain_string(std::string_view piece, StringForm form);
// Adds a string in the form `lengths` or `zeros`; the latter holds it up to a 0 of its own.
void append_string(std::string& list, std::string_view plain, StringForm form);
// A list in another form, as far as it goes; `to` is `lengths` or `zeros`.
std::string recoded(std::string_view list, StringForm from, StringForm to);

// Bytes of the length that a string of a binary file begins with, out of its first byte.
inline std::size_t length_bytes(std::byte first) {
  return std::size_t{8} >> (static_cast<unsigned>(first) >> 6);
}

// Makes a list of the different strings among many.
class StringLister {
 public:
  // In about `most_bytes` of memory.
  explicit StringLister(std::uint64_t most_bytes) : most_bytes_(most_bytes) {}
  // The place of a string, given as it shall stand in the list. Nothing when there is no room.
  std::optional<std::uint32_t> place_of(const std::string& piece);
  const std::string& list() const { return list_; }

 private:
  std::uint64_t most_bytes_;
  std::unordered_map<std::string, std::uint32_t> places_;
  std::string list_;
};

// Arrays of points and cells with this role are uint32: places in a list, the extra
// "vtk/strings/<index of the array>".
inline constexpr std::string_view kStringRole = "vtk:string";
inline constexpr std::string_view kStringLists = "vtk/strings/";
std::string strings_key(std::size_t array);

// The form of the list of an array with that role, in the mesh of a legacy or XML file.
StringForm form_of_strings(const MeshInfo& info, std::size_t array);
// Its list as plain strings. Empty where the extra is missing or broken.
std::vector<std::string> strings_of_array(const MeshInfo& info, std::size_t array);

}  // namespace shm::converters::vtk
