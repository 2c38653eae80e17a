// Reads point, cell and field data of VTK legacy files.
#include <limits>
#include <utility>

#include "mesh/mesh_source.h"
#include "vtk/legacy/reader.h"
#include "vtk/strings.h"

namespace shm::converters::vtk {
namespace {

constexpr std::uint64_t kMostComponents = 65535;

}  // namespace

void Parser::begin_section(EntryKind kind) {
  input_.enter(std::string(keyword(kind)));
  const bool of_cells = kind == EntryKind::cell_data;
  const auto count = input_.number<std::uint64_t>();
  section_ = of_cells ? Section::cell_data : Section::point_data;
  if (count != section_size())
    input_.fail(ErrorCode::corrupt,
                "states " + std::to_string(count) + " values per array, but there are " +
                    std::to_string(section_size()) + (of_cells ? " cells" : " points"));
  skeleton_.entries.push_back(Entry{.kind = kind});
}

std::uint64_t Parser::section_size() const {
  if (section_ != Section::cell_data) return info_.vertices;
  if (source_.lattice_) return source_.lattice_->cells();
  std::uint64_t cells = 0;
  for (const CellTable& list : source_.lists_) cells += list.cells();
  return cells;
}

void Parser::field() {
  input_.enter("FIELD");
  Entry entry{.kind = EntryKind::field, .name = std::string(input_.word())};
  entry.tuples = input_.number<std::uint64_t>();
  const std::uint64_t arrays = entry.tuples;
  skeleton_.entries.push_back(std::move(entry));
  for (std::uint64_t i = 0; i < arrays; ++i) field_array();
}

void Parser::field_array() {
  input_.enter("FIELD");
  std::string name(input_.word());
  if (name == "NULL_ARRAY") {
    skeleton_.entries.push_back(Entry{.kind = EntryKind::null_array});
    return;
  }
  input_.enter("FIELD, array '" + name.substr(0, 80) + "'");
  Entry entry{.kind = EntryKind::array, .name = std::move(name)};
  entry.components = input_.number<std::uint64_t>();
  entry.tuples = input_.number<std::uint64_t>();
  entry.type = input_.word();
  values(std::move(entry));
}

void Parser::attribute(EntryKind kind) {
  Entry entry{.kind = kind, .name = std::string(input_.word()), .components = 1};
  entry.tuples = section_size();
  input_.enter(std::string(keyword(kind)) + " '" + entry.name.substr(0, 80) + "'");
  if (kind == EntryKind::texture_coordinates || kind == EntryKind::color_scalars)
    entry.components = input_.number<std::uint64_t>();
  if (kind == EntryKind::color_scalars) {
    entry.type = skeleton_.binary ? "unsigned_char" : "float";
  } else {
    entry.type = input_.word();
  }
  if (const std::uint64_t fixed = fixed_components(kind); fixed > 0) entry.components = fixed;
  if (kind == EntryKind::scalars) {
    std::string word = lower_case(input_.word());
    if (word != "lookup_table") {
      if (!TextInput::parse(word, entry.components))
        input_.fail(ErrorCode::corrupt, "expected the number of components or LOOKUP_TABLE");
      word = lower_case(input_.word());
    }
    if (word != "lookup_table") input_.fail(ErrorCode::corrupt, "expected LOOKUP_TABLE");
    entry.second = input_.word();
  }
  values(std::move(entry));
}

void Parser::lookup_table() {
  Entry entry{.kind = EntryKind::lookup_table,
              .name = std::string(input_.word()),
              .type = skeleton_.binary ? "unsigned_char" : "float",
              .components = 4};
  entry.tuples = input_.number<std::uint64_t>();
  values(std::move(entry));
}

// Reads the values of an array. `entry` describes the line that announces the array. The input must
// be at the first byte after this line.
void Parser::values(Entry entry) {
  const ValueForm form = form_of_word(entry.type);
  if (form == ValueForm::unknown)
    input_.fail(ErrorCode::corrupt, "'" + entry.type.substr(0, 40) + "' is not a known value type");
  if (form == ValueForm::number) {
    numbers(entry, *scalar_of_word(entry.type, skeleton_.binary));
  } else {
    other_values(entry, form);
  }
  if (entry.kind != EntryKind::lookup_table) metadata(entry.components, entry.metadata);
  skeleton_.entries.push_back(std::move(entry));
}

void Parser::numbers(Entry& entry, ScalarType type) {
  Values column_values = column(type, product(entry.tuples, entry.components));
  if (is_per_element(entry)) {
    add_array(entry, std::move(column_values), {});
    return;
  }
  entry.origin = Origin::extra;
  entry.index = data_count_++;
  Extra extra{
      data_key(entry.index), type, Reference::nothing, {entry.tuples, entry.components}, {}};
  extra.data.resize(column_values.size() * scalar_bytes(type));
  column_values.read(0, column_values.size(), extra.data.data());
  info_.extras.push_back(std::move(extra));
}

void Parser::add_array(Entry& entry, Values column_values, std::string_view role) {
  entry.origin = Origin::array;
  entry.index = source_.arrays_.size();
  ArrayInfo array;
  array.name = decode_name(entry.name);
  array.location = section_ == Section::cell_data ? Location::cell : Location::point;
  array.type = column_values.type();
  array.components = static_cast<std::uint32_t>(entry.components);
  array.role = role;
  if (const auto before = written_before(entry.kind, array, column_values)) {
    entry.index = *before;
    return;
  }
  source_.arrays_.push_back(std::move(column_values));
  info_.schema.arrays.push_back(std::move(array));
}

// If the array has been read before under another role, returns the index of the earlier array;
// otherwise returns nothing. This is necessary because VTK writes an array with several roles once
// per role. For example, SCALARS and VECTORS with equal names and values become one array of the
// mesh.
std::optional<std::size_t> Parser::written_before(EntryKind kind, const ArrayInfo& array,
                                                  Values& values) {
  // Maximum number of earlier arrays of the same name with which an array is compared. If a name
  // occurs more often, the array may be stored again although it equals an earlier array.
  constexpr std::size_t kMostOfAName = 4;
  const auto& arrays = info_.schema.arrays;
  auto& of_name = named_[{array.location, array.name}];
  for (const std::size_t a : of_name)
    if (arrays[a] == array && array.role.empty() && !roles_.contains({a, kind}) &&
        source_.arrays_[a].equals(values)) {
      roles_.emplace(a, kind);
      return a;
    }
  roles_.emplace(arrays.size(), kind);
  if (of_name.size() < kMostOfAName) of_name.push_back(arrays.size());
  return std::nullopt;
}

bool Parser::is_per_element(const Entry& entry) const {
  if (entry.kind == EntryKind::blanking) return true;
  return section_ != Section::dataset && entry.kind != EntryKind::lookup_table &&
         entry.tuples == section_size() && entry.components >= 1 &&
         entry.components <= kMostComponents;
}

// Reads strings, variants and bits. If they belong to points or cells, they become arrays of the
// mesh. Otherwise the bytes or words of the file become an extra.
void Parser::other_values(Entry& entry, ValueForm form) {
  const std::uint64_t count = product(entry.tuples, entry.components);
  if (form == ValueForm::bit) return bits(entry, count);
  if (form == ValueForm::string) input_.skip_line();
  if (is_per_element(entry)) return listed_strings(entry, form, count);
  std::string data;
  for (std::uint64_t i = 0; i < count; ++i) one_string(form, data);
  entry.origin = Origin::extra;
  entry.index = data_count_++;
  info_.extras.push_back(text_extra(data_key(entry.index), data));
}

// Reads bits. In text files, each bit is a number. In binary files, each byte contains eight bits,
// beginning with the most significant bit.
void Parser::bits(Entry& entry, std::uint64_t count) {
  const bool array = is_per_element(entry);
  if (count > 0) next_line_is_binary();
  if (skeleton_.binary && count / 8 > input_.left())
    input_.fail(ErrorCode::truncated, "the file ends within the bits");
  PagedArray values(spool_, 1);
  std::string kept;  // bits as stored in the file
  std::byte byte{};
  for (std::uint64_t i = 0; i < count; ++i) {
    if (skeleton_.binary && i % 8 == 0) {
      input_.bytes(&byte, 1);
      if (!array) kept += static_cast<char>(byte);
    }
    const bool bit = skeleton_.binary ? (byte & std::byte{0x80} >> (i % 8)) != std::byte{}
                                      : input_.number<std::int64_t>() != 0;
    const auto value = static_cast<char>(bit);
    if (array) values.append(1, reinterpret_cast<const std::byte*>(&value));
    if (!array && !skeleton_.binary) kept += value;
  }
  if (array) return add_array(entry, Values(ScalarType::uint8, std::move(values)), {});
  entry.origin = Origin::extra;
  entry.index = data_count_++;
  info_.extras.push_back(text_extra(data_key(entry.index), kept));
}

// Reads strings into a list of distinct strings and an array of indices into this list. If points
// or cells are reordered, only the array of indices is reordered.
void Parser::listed_strings(Entry& entry, ValueForm form, std::uint64_t count) {
  // The list needs no limit, because it cannot be larger than the file.
  StringLister strings(std::numeric_limits<std::uint64_t>::max());
  PagedArray values(spool_, sizeof(std::uint32_t));
  std::string one;
  for (std::uint64_t i = 0; i < count; ++i) {
    one.clear();
    one_string(form, one);
    const auto place = strings.place_of(one);
    if (!place) input_.fail(ErrorCode::unsupported, "has more distinct strings than are supported");
    values.append(1, reinterpret_cast<const std::byte*>(&*place));
  }
  add_array(entry, Values(ScalarType::uint32, std::move(values)), kStringRole);
  info_.extras.push_back(text_extra(strings_key(entry.index), strings.list()));
}

// Reads one string or variant. A variant is a line that contains its type and its %-encoded text. A
// string in a text file is one %-encoded line. In a binary file, the length of a string precedes
// the string. The length uses 1, 2, 4 or 8 bytes if the top two bits of its first byte are 3, 2, 1
// or 0, respectively.
void Parser::one_string(ValueForm form, std::string& out) {
  if (form == ValueForm::variant) {
    out.append(input_.word()).append(" ");
    out.append(input_.word()).append("\n");
    return;
  }
  if (!skeleton_.binary) {
    out.append(input_.line()).append("\n");
    return;
  }
  std::byte head[8] = {};
  input_.bytes(head, 1);
  const std::size_t head_bytes = length_bytes(head[0]);
  input_.bytes(head + 1, head_bytes - 1);
  std::uint64_t length = static_cast<unsigned>(head[0]) & 63U;
  for (std::size_t b = 1; b < head_bytes; ++b)
    length = length << 8 | static_cast<std::uint64_t>(head[b]);
  if (length > input_.left()) input_.fail(ErrorCode::truncated, "the file ends within a string");
  out.append(reinterpret_cast<const char*>(head), head_bytes);
  const std::size_t old_size = out.size();
  out.resize(old_size + length);
  input_.bytes(reinterpret_cast<std::byte*>(out.data() + old_size), length);
}

}  // namespace shm::converters::vtk
