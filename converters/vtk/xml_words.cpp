#include "vtk/xml_words.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <utility>

namespace shm::converters::vtu {
namespace {

constexpr ArrayType number(ScalarType type) { return {ArrayKind::number, type}; }

constexpr std::array<std::pair<std::string_view, ArrayType>, 12> kArrayTypes{{
    {"Int8", number(ScalarType::int8)},
    {"UInt8", number(ScalarType::uint8)},
    {"Int16", number(ScalarType::int16)},
    {"UInt16", number(ScalarType::uint16)},
    {"Int32", number(ScalarType::int32)},
    {"UInt32", number(ScalarType::uint32)},
    {"Int64", number(ScalarType::int64)},
    {"UInt64", number(ScalarType::uint64)},
    {"Float32", number(ScalarType::float32)},
    {"Float64", number(ScalarType::float64)},
    {"Bit", {ArrayKind::bit, ScalarType::uint8}},
    {"String", {ArrayKind::string, ScalarType::uint8}},
}};

constexpr std::string_view kWords[] = {"points",
                                       kConnectivity,
                                       kOffsets,
                                       kTypes,
                                       kFaces,
                                       kFaceOffsets,
                                       kFaceConnectivity,
                                       kFaceEnds,
                                       kPolyhedronFaces,
                                       kPolyhedronEnds,
                                       "block_ids",
                                       "time",
                                       "none"};

bool take_number(std::string_view& text, std::uint64_t& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

std::optional<ArrayType> type_of_word(std::string_view word) {
  for (const auto& [known, type] : kArrayTypes)
    if (known == word) return type;
  return std::nullopt;
}

std::string_view word_of_type(ScalarType type) {
  for (const auto& [word, known] : kArrayTypes)
    if (known == number(type)) return word;
  return "Float64";
}

std::optional<std::uint64_t> parse_count(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first, text.find_last_not_of(kBlank) + 1 - first);
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string data_key(std::uint64_t index) { return "vtu/data/" + std::to_string(index); }

std::optional<ValuesWord> parse_values_word(std::string_view text) {
  ValuesWord result;
  const std::size_t blank = text.find(' ');
  std::string_view word = text.substr(0, blank);
  if (blank != std::string_view::npos) {
    std::string_view rest = text.substr(blank + 1);
    if (rest.empty() || rest[0] != 'b') return std::nullopt;
    rest.remove_prefix(1);
    if (!take_number(rest, result.block_bytes) || !rest.empty() || result.block_bytes == 0 ||
        result.block_bytes > kMostBlockBytes)
      return std::nullopt;
  }
  result.word = word;
  if (std::find(std::begin(kWords), std::end(kWords), word) != std::end(kWords)) return result;
  if (word.empty() || (word[0] != 'a' && word[0] != 'x')) return std::nullopt;
  result.kind = word[0] == 'a' ? ValuesWord::Kind::array : ValuesWord::Kind::extra;
  word.remove_prefix(1);
  if (!take_number(word, result.index)) return std::nullopt;
  if (result.kind == ValuesWord::Kind::array && word.starts_with('s')) {
    word.remove_prefix(1);
    if (!take_number(word, result.step.emplace())) return std::nullopt;
  }
  if (!word.empty()) return std::nullopt;
  return result;
}

std::optional<ValuesWord> values_word(Node& array) {
  const Node* values = array.is_array() ? array.values() : nullptr;
  return values == nullptr ? std::nullopt : parse_values_word(values->text);
}

}  // namespace shm::converters::vtu
