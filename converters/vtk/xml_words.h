// Words of VTK's XML files and their meaning: types of arrays, and the words in the skeleton (see
// vtu.h) in place of the numbers of an array.
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
  ScalarType stored = ScalarType::float64;  // bits as uint8 0 and 1, strings as their bytes
  bool operator==(const ArrayType&) const = default;
};

// Returns nothing for types that VTK does not read either.
std::optional<ArrayType> type_of_word(std::string_view word);
std::string_view word_of_type(ScalarType type);  // "Float64"

// Parses a number that fills `text`, except for blanks around it. Returns nothing if there is none.
std::optional<std::uint64_t> parse_count(std::string_view text);

std::string data_key(std::uint64_t index);  // "vtu/data/<index>"

// Names of the arrays of <Cells>, in files and in the skeleton.
inline constexpr std::string_view kConnectivity = "connectivity", kOffsets = "offsets",
                                  kTypes = "types", kFaces = "faces", kFaceOffsets = "faceoffsets",
                                  kFaceConnectivity = "face_connectivity",
                                  kFaceEnds = "face_offsets",
                                  kPolyhedronFaces = "polyhedron_to_faces",
                                  kPolyhedronEnds = "polyhedron_offsets";

// VTK compresses arrays in blocks of 32 KiB. Files with blocks larger than kMostBlockBytes are
// refused.
inline constexpr std::uint64_t kUsualBlockBytes = 32768;
inline constexpr std::uint64_t kMostBlockBytes = std::uint64_t{1} << 26;

// The word in the skeleton in place of the numbers of an array (see vtu.h).
struct ValuesWord {
  enum class Kind : std::uint8_t { array, extra, other };
  Kind kind = Kind::other;
  std::string word;         // "connectivity", ...
  std::uint64_t index = 0;  // index of the array or extra
  std::optional<std::uint64_t> step;
  std::uint64_t block_bytes = kUsualBlockBytes;
};
// Returns nothing if `text` is invalid.
std::optional<ValuesWord> parse_values_word(std::string_view text);

// The word in place of the values of an array. Nothing if it is missing or invalid.
std::optional<ValuesWord> values_word(Node& array);

}  // namespace shm::converters::vtu
