// What the words of VTK's XML files mean: types of arrays, and what stands in the skeleton (see
// vtu.h) for the numbers of an array.
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
  ScalarType stored = ScalarType::float64;  // bits as uint8 of 0 and 1, strings as their bytes
  bool operator==(const ArrayType&) const = default;
};

// Nothing for types that VTK does not read either.
std::optional<ArrayType> type_of_word(std::string_view word);
std::string_view word_of_type(ScalarType type);  // "Float64"

// A number that fills all of `text`, blanks around it aside; nothing when there is none.
std::optional<std::uint64_t> parse_count(std::string_view text);

std::string data_key(std::uint64_t index);  // "vtu/data/<index>"

// What the arrays of <Cells> are called, by themselves and in the skeleton.
inline constexpr std::string_view kConnectivity = "connectivity", kOffsets = "offsets",
                                  kTypes = "types", kFaces = "faces", kFaceOffsets = "faceoffsets",
                                  kFaceConnectivity = "face_connectivity",
                                  kFaceEnds = "face_offsets",
                                  kPolyhedronFaces = "polyhedron_to_faces",
                                  kPolyhedronEnds = "polyhedron_offsets";

// VTK cuts arrays into blocks of 32 KiB; larger ones than this are refused.
inline constexpr std::uint64_t kUsualBlockBytes = 32768;
inline constexpr std::uint64_t kMostBlockBytes = std::uint64_t{1} << 26;

// What stands for the numbers of an array (see vtu.h).
struct ValuesWord {
  enum class Kind : std::uint8_t { array, extra, other };
  Kind kind = Kind::other;
  std::string word;         // "connectivity", ...
  std::uint64_t index = 0;  // of the array or extra
  std::optional<std::uint64_t> step;
  std::uint64_t block_bytes = kUsualBlockBytes;
};
// Nothing when it makes no sense.
std::optional<ValuesWord> parse_values_word(std::string_view text);

// What stands for the values of an array; nothing where that makes no sense.
std::optional<ValuesWord> values_word(Node& array);

}  // namespace shm::converters::vtu
