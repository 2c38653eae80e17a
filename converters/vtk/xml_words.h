// Parses keywords: the type names in VTK's XML files, and the words that replace the numbers of
// arrays in the skeleton (see vtu.h).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "shm/schema.h"
#include "vtk/xml_document.h"

namespace shm::converters::vtu {

enum class ArrayKind : std::uint8_t { number, bit, string };

struct ArrayType {
  ArrayKind kind = ArrayKind::number;
  ScalarType stored = ScalarType::float64;  // type of the stored values; uint8 for bits (stored as
                                            // 0 and 1) and for the bytes of strings
  bool operator==(const ArrayType&) const = default;
};

// Returns the array type that `word`, such as "Float64", denotes. Returns nothing for unknown
// types. (VTK ignores arrays of such types, too.)
std::optional<ArrayType> type_of_word(std::string_view word);
std::string_view word_of_type(ScalarType type);  // "Float64"

// Parses a non-negative integer. `text` may contain blanks before and after the digits. Returns
// nothing if `text` is invalid.
std::optional<std::uint64_t> parse_count(std::string_view text);

std::string data_key(std::uint64_t index);  // "vtu/data/<index>"

// Names of the arrays in the element <Cells>. The same words are used in the skeleton.
inline constexpr std::string_view kConnectivity = "connectivity", kOffsets = "offsets",
                                  kTypes = "types", kFaces = "faces", kFaceOffsets = "faceoffsets",
                                  kFaceConnectivity = "face_connectivity",
                                  kFaceEnds = "face_offsets",
                                  kPolyhedronFaces = "polyhedron_to_faces",
                                  kPolyhedronEnds = "polyhedron_offsets";

// Block sizes in bytes. VTK compresses arrays in blocks of 32 KiB. Files with blocks larger than
// kMostBlockBytes are refused.
inline constexpr std::uint64_t kUsualBlockBytes = 32768;
inline constexpr std::uint64_t kMostBlockBytes = std::uint64_t{1} << 26;

// A reference to the stored numbers of an array. The skeleton (the XML of a file without its
// numbers, see vtu.h) contains each reference as a word, e.g. "a3s1" or "points".
struct ValuesWord {
  enum class Kind : std::uint8_t { array, extra, other };
  Kind kind = Kind::other;
  std::string word;         // "connectivity", ...
  std::uint64_t index = 0;  // index of the array or extra
  std::optional<std::uint64_t> step;
  std::uint64_t block_bytes = kUsualBlockBytes;
};
// Parses a word of the skeleton. Returns nothing if `text` is not such a word.
std::optional<ValuesWord> parse_values_word(std::string_view text);

// Returns the parsed word of the element `array`. Returns nothing if the word is missing or
// invalid.
std::optional<ValuesWord> values_word(Node& array);

}  // namespace shm::converters::vtu
