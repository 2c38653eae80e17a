// Converts a skeleton to lines of text, and lines of text to a skeleton.
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <map>
#include <optional>
#include <type_traits>
#include <utility>

#include "base/stored_value.h"
#include "exodus/numbered_names.h"
#include "exodus/skeleton.h"

namespace shm::converters::exodus {
namespace {

struct TypeWord {
  int nc_type;
  ScalarType type;
  std::string_view word;
};
constexpr std::array<TypeWord, 12> kTypes{{{NC_BYTE, ScalarType::int8, "byte"},
                                           {NC_CHAR, ScalarType::uint8, "char"},
                                           {NC_SHORT, ScalarType::int16, "short"},
                                           {NC_INT, ScalarType::int32, "int"},
                                           {NC_FLOAT, ScalarType::float32, "float"},
                                           {NC_DOUBLE, ScalarType::float64, "double"},
                                           {NC_UBYTE, ScalarType::uint8, "ubyte"},
                                           {NC_USHORT, ScalarType::uint16, "ushort"},
                                           {NC_UINT, ScalarType::uint32, "uint"},
                                           {NC_INT64, ScalarType::int64, "int64"},
                                           {NC_UINT64, ScalarType::uint64, "uint64"},
                                           {NC_STRING, ScalarType::uint8, "string"}}};
constexpr std::array<std::string_view, 5> kKinds{"classic", "64-bit-offset", "cdf5", "netcdf4",
                                                 "netcdf4-classic"};
// First field of the first line. K means that variables refer to dimensions by name. N means that
// they refer to dimensions by index, as in files from versions before 0.10.
constexpr std::string_view kNamesFollow = "K", kPlacesFollow = "N";
constexpr std::string_view kCompact = "compact", kBigEndian = "big-endian", kFilled = "filled";

void append_escaped(std::string& out, std::string_view text, std::string_view also = {}) {
  constexpr char kDigits[] = "0123456789ABCDEF";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x20 || byte == 0x7f || c == '%' || also.find(c) != std::string_view::npos)
      out += {'%', kDigits[byte >> 4], kDigits[byte & 15]};
    else
      out += c;
  }
}

// Escapes the name of a dimension or variable. A '#' in the name is escaped too, because '#'
// represents numbers in the skeleton.
std::string escaped_name(std::string_view name) {
  std::string out;
  append_escaped(out, name, "#");
  return out;
}

template <class T>
bool parse(std::string_view text, T& value, int base = 10) {
  std::from_chars_result result{};
  if constexpr (std::is_floating_point_v<T>)
    result = std::from_chars(text.data(), text.data() + text.size(), value);
  else
    result = std::from_chars(text.data(), text.data() + text.size(), value, base);
  return result.ec == std::errc() && result.ptr == text.data() + text.size();
}

template <class T>
std::string text_of(T value) {
  char text[64];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

// Converts numbers of type T to text and back. Finite numbers are written in decimal. NaN and
// infinity are written as x, followed by their bits in hexadecimal.
template <class T>
struct NumberText {
  using Bits = std::conditional_t<
      sizeof(T) == 8, std::uint64_t,
      std::conditional_t<sizeof(T) == 4, std::uint32_t,
                         std::conditional_t<sizeof(T) == 2, std::uint16_t, std::uint8_t>>>;
  static void append(std::string& out, const std::vector<std::byte>& values) {
    for (std::size_t offset = 0; offset + sizeof(T) <= values.size(); offset += sizeof(T)) {
      T value;
      std::memcpy(&value, values.data() + offset, sizeof value);
      out += '\t';
      if constexpr (std::is_floating_point_v<T>) {
        if (!std::isfinite(value)) {
          Bits bits;
          std::memcpy(&bits, &value, sizeof bits);
          char text[32];
          out += "x" + std::string(text, std::to_chars(text, text + 32, bits, 16).ptr);
          continue;
        }
      }
      out += text_of(value);
    }
  }
  static bool parse_into(std::vector<std::byte>& values, std::string_view text) {
    T value{};
    Bits bits{};
    const bool is_bits = !text.empty() && text.front() == 'x';
    if (!(is_bits ? parse(text.substr(1), bits, 16) : parse(text, value))) return false;
    if (is_bits) std::memcpy(&value, &bits, sizeof value);
    const auto* bytes = reinterpret_cast<const std::byte*>(&value);
    values.insert(values.end(), bytes, bytes + sizeof value);
    return true;
  }
};

// Calls `action` with a NumberText for the C++ type that corresponds to `type`.
template <class Action>
auto with_numbers(ScalarType type, Action&& action) {
  return with_scalar(type, [&](auto zero) { return action(NumberText<decltype(zero)>()); });
}

std::string_view word_of(int type) {
  for (const TypeWord& word : kTypes)
    if (word.nc_type == type) return word.word;
  return "char";
}

void append_attributes(std::string& out, const std::vector<Attribute>& attributes) {
  for (const Attribute& attribute : attributes) {
    out += "A\t";
    append_escaped(out, attribute.name);
    out += '\t';
    out += word_of(attribute.type);
    if (attribute.type == NC_CHAR) {
      out += '\t';
      append_escaped(
          out, {reinterpret_cast<const char*>(attribute.values.data()), attribute.values.size()});
    } else if (attribute.type == NC_STRING) {
      for (const std::string& text : attribute.strings) {
        out += '\t';
        append_escaped(out, text);
      }
    } else {
      with_numbers(scalar_of(attribute.type),
                   [&](auto numbers) { numbers.append(out, attribute.values); });
    }
    out += '\n';
  }
}

void append_storage(std::string& out, const Storage& storage) {
  if (!storage.chunks.empty()) {
    out += "S\t" + std::to_string(storage.deflate_level) + (storage.shuffle ? "\t1" : "\t0") +
           (storage.checksum ? "\t1" : "\t0");
    for (const std::uint64_t chunk : storage.chunks) out += '\t' + std::to_string(chunk);
    out += '\n';
  }
  if (storage.compact || storage.big_endian || storage.filled) {
    out += 'O';
    for (const auto& [set, word] :
         {std::pair(storage.compact, kCompact), std::pair(storage.big_endian, kBigEndian),
          std::pair(storage.filled, kFilled)})
      if (set) (out += '\t') += word;
    out += '\n';
  }
  for (const Filter& filter : storage.filters) {
    out += "F\t" + std::to_string(filter.id);
    for (const unsigned parameter : filter.parameters) out += '\t' + std::to_string(parameter);
    out += '\n';
  }
}

// Parses the lines of a skeleton.
class TextParser {
 public:
  TextParser(const Place& place, std::size_t bytes) : place_(&place), bytes_(bytes) {}

  void line(std::string_view text) {
    ++number_;
    fields_.clear();
    while (true) {
      const std::size_t tab = text.find('\t');
      fields_.push_back(text.substr(0, tab));
      if (tab == std::string_view::npos) break;
      text.remove_prefix(tab + 1);
    }
    const std::string_view head = fields_[0];
    if (number_ == 1) by_name_ = head == kNamesFollow;
    if (head == (by_name_ ? kNamesFollow : kPlacesFollow))
      kind();
    else if (head == "D")
      dimension();
    else if (head == "A")
      attribute();
    else if (head == "V")
      variable();
    else if (head == "S")
      storage();
    else if (head == "O")
      options();
    else if (head == "F")
      filter();
    else
      wrong();
  }
  Skeleton skeleton;

 private:
  [[noreturn]] void wrong() const {
    place_->fail(ErrorCode::corrupt, "exodus/skeleton",
                 "line " + std::to_string(number_) + " is invalid");
  }
  void need(bool condition) const {
    if (!condition) wrong();
  }
  template <class T>
  T number(std::size_t field) const {
    T value{};
    need(field < fields_.size() && parse(fields_[field], value));
    return value;
  }
  std::string text(std::size_t field) const {
    need(field < fields_.size());
    return unescaped_text(fields_[field]);
  }
  std::string unescaped_text(std::string_view text) const {
    auto value = unescaped(text);
    need(value.has_value());
    return *value;
  }
  // Returns the name in the current line, with numbers in place of '#'. The name is still escaped.
  std::string name(NumberedNames& names) const {
    need(fields_.size() > 1);
    return by_name_ ? names.expanded(fields_[1]) : std::string(fields_[1]);
  }
  int type(std::size_t field) const {
    need(field < fields_.size());
    for (const TypeWord& word : kTypes)
      if (word.word == fields_[field]) return word.nc_type;
    wrong();
  }
  void kind() {
    need(fields_.size() == 2);
    const auto* found = std::find(kKinds.begin(), kKinds.end(), fields_[1]);
    need(found != kKinds.end());
    skeleton.kind = static_cast<Kind>(found - kKinds.begin());
  }
  void dimension() {
    const bool unlimited = fields_.size() == 4 && fields_[3] == "unlimited";
    need(unlimited || fields_.size() == 3);
    const std::string name = this->name(dimension_names_);
    if (by_name_) need(places_.emplace(name, skeleton.dimensions.size()).second);
    skeleton.dimensions.push_back({unescaped_text(name), number<std::uint64_t>(2), unlimited});
  }
  void attribute() {
    Attribute attribute{text(1), type(2), {}, {}};
    if (attribute.type == NC_CHAR) {
      const std::string value = text(3);
      const auto* bytes = reinterpret_cast<const std::byte*>(value.data());
      attribute.values.assign(bytes, bytes + value.size());
    } else if (attribute.type == NC_STRING) {
      for (std::size_t i = 3; i < fields_.size(); ++i) attribute.strings.push_back(text(i));
    } else {
      for (std::size_t i = 3; i < fields_.size(); ++i)
        need(with_numbers(scalar_of(attribute.type), [&](auto numbers) {
          return numbers.parse_into(attribute.values, fields_[i]);
        }));
    }
    auto& owner =
        skeleton.variables.empty() ? skeleton.attributes : skeleton.variables.back().attributes;
    owner.push_back(std::move(attribute));
  }
  void variable() {
    Variable variable;
    const std::string name = this->name(variable_names_), own = last_number(name);
    variable.name = unescaped_text(name);
    variable.type = type(2);
    for (std::size_t i = 3; i < fields_.size(); ++i) {
      variable.dimensions.push_back(by_name_ ? place_of(expanded_beside(own, fields_[i]))
                                             : number<std::size_t>(i));
      need(variable.dimensions.back() < skeleton.dimensions.size());
      mentioned_ += skeleton.dimensions[variable.dimensions.back()].name.size();
      need(mentioned_ / kMostGrowth <= bytes_);
    }
    skeleton.variables.push_back(std::move(variable));
  }
  std::size_t place_of(const std::string& dimension) const {
    const auto found = places_.find(dimension);
    need(found != places_.end());
    return found->second;
  }
  void storage() {
    need(!skeleton.variables.empty());
    Variable& variable = skeleton.variables.back();
    Storage& into = variable.storage;
    into.deflate_level = number<int>(1);
    into.shuffle = number<int>(2) != 0;
    into.checksum = number<int>(3) != 0;
    into.chunks.clear();
    for (std::size_t i = 4; i < fields_.size(); ++i)
      into.chunks.push_back(number<std::uint64_t>(i));
    need(into.chunks.size() == variable.dimensions.size());
  }
  void options() {
    need(!skeleton.variables.empty());
    Storage& into = skeleton.variables.back().storage;
    for (std::size_t i = 1; i < fields_.size(); ++i) {
      need(fields_[i] == kCompact || fields_[i] == kBigEndian || fields_[i] == kFilled);
      into.compact |= fields_[i] == kCompact;
      into.big_endian |= fields_[i] == kBigEndian;
      into.filled |= fields_[i] == kFilled;
    }
  }
  void filter() {
    need(!skeleton.variables.empty());
    Filter one{number<unsigned>(1), {}};
    for (std::size_t i = 2; i < fields_.size(); ++i) one.parameters.push_back(number<unsigned>(i));
    skeleton.variables.back().storage.filters.push_back(std::move(one));
  }

  // Limit on the total size of all dimension names to which variables refer, as a multiple of the
  // size of the text. The limit is needed because in a damaged file, many variables could refer by
  // index to one dimension with a long name. When names replace the indices, the skeleton would
  // become far larger than the file.
  static constexpr std::size_t kMostGrowth = 32;

  const Place* place_;
  // `bytes_` is the size of the text. `mentioned_` is the total size of the dimension names to
  // which variables have referred so far. Both are in bytes.
  std::size_t bytes_, mentioned_ = 0;
  std::vector<std::string_view> fields_;
  std::size_t number_ = 0;
  bool by_name_ = false;
  NumberedNames dimension_names_, variable_names_;
  std::map<std::string, std::size_t> places_;  // index of each dimension, by escaped name
};

}  // namespace

std::optional<std::string> unescaped(std::string_view text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%') {
      out += text[i];
      continue;
    }
    unsigned byte = 0;
    if (i + 3 > text.size()) return std::nullopt;
    const auto [end, error] = std::from_chars(text.data() + i + 1, text.data() + i + 3, byte, 16);
    if (error != std::errc() || end != text.data() + i + 3) return std::nullopt;
    out += static_cast<char>(byte);
    i += 2;
  }
  return out;
}

ScalarType scalar_of(int nc_type) {
  for (const TypeWord& word : kTypes)
    if (word.nc_type == nc_type) return word.type;
  return ScalarType::uint8;
}

std::string to_text(const Skeleton& skeleton) {
  std::string out(kNamesFollow);
  out += '\t';
  out += kKinds[static_cast<std::size_t>(skeleton.kind)];
  out += '\n';
  std::vector<std::string> dimensions;
  NumberedNames names, variable_names;
  for (const Dimension& dimension : skeleton.dimensions) {
    dimensions.push_back(escaped_name(dimension.name));
    out += "D\t" + names.shortened(dimensions.back());
    out += '\t' + std::to_string(dimension.length);
    if (dimension.unlimited) out += "\tunlimited";
    out += '\n';
  }
  append_attributes(out, skeleton.attributes);
  for (const Variable& variable : skeleton.variables) {
    const std::string name = escaped_name(variable.name), own = last_number(name);
    out += "V\t" + variable_names.shortened(name) + '\t';
    out += word_of(variable.type);
    for (const std::size_t d : variable.dimensions)
      out += '\t' + shortened_beside(own, dimensions[d]);
    out += '\n';
    append_storage(out, variable.storage);
    append_attributes(out, variable.attributes);
  }
  return out;
}

Skeleton from_text(std::string_view text, const Place& place) {
  TextParser parser(place, text.size());
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    parser.line(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return std::move(parser.skeleton);
}

}  // namespace shm::converters::exodus
