#include "formats/unread_formats.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>

namespace shm::converters {
namespace {

// Returns the first line that is neither empty nor a comment, converted to upper case and without
// leading white space. A comment is a line that begins with `comment`.
std::string first_line(std::string_view text, std::string_view comment) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.front())) != 0)
      line.remove_prefix(1);
    if (line.empty() || (!comment.empty() && line.starts_with(comment))) continue;
    std::string found(line);
    std::transform(found.begin(), found.end(), found.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return found;
  }
  return {};
}

bool begins_with_any(const std::string& line, std::span<const std::string_view> words) {
  return std::any_of(words.begin(), words.end(),
                     [&](std::string_view word) { return line.starts_with(word); });
}

}  // namespace

bool is_cgns(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  // Names that identify a CGNS file stored in HDF5: those of its root node and of the first nodes
  // that the CGNS library writes below the root.
  constexpr std::array<std::string_view, 3> kWords = {"HDF5 MotherNode", " hdf5version",
                                                      "CGNSLibraryVersion"};
  if (text.starts_with("@(#)ADF Database")) return true;
  return text.starts_with("\x89HDF") &&
         std::any_of(kWords.begin(), kWords.end(), [&](std::string_view word) {
           return text.find(word) != std::string_view::npos;
         });
}

std::string_view unread_format(std::span<const std::byte> head) {
  const std::string_view text(reinterpret_cast<const char*>(head.data()), head.size());
  if (is_cgns(head)) return "a CGNS file";
  constexpr std::array<std::string_view, 7> kAbaqus = {
      "*HEADING", "*NODE", "*PART", "*INCLUDE", "*PREPRINT", "*PARAMETER", "*ASSEMBLY"};
  if (begins_with_any(first_line(text, "**"), kAbaqus)) return "Abaqus or CalculiX input";
  constexpr std::array<std::string_view, 6> kNastran = {"BEGIN BULK", "SOL ",   "CEND",
                                                        "NASTRAN ",   "GRID  ", "GRID,"};
  if (begins_with_any(first_line(text, "$"), kNastran)) return "Nastran bulk data";
  constexpr std::array<std::string_view, 1> kSu2 = {"NDIME="};
  if (begins_with_any(first_line(text, "%"), kSu2)) return "an SU2 mesh";
  constexpr std::array<std::string_view, 1> kMedit = {"MESHVERSIONFORMATTED"};
  if (begins_with_any(first_line(text, "#"), kMedit)) return "a Medit mesh";
  return {};
}

}  // namespace shm::converters
