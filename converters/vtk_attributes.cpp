// Reads point, cell and field data of VTK legacy files.
#include <utility>

#include "vtk_parser.h"

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
    input_.fail(ErrorCode::corrupt, "states " + std::to_string(count) + " values an array for " +
                                        std::to_string(section_size()) +
                                        (of_cells ? " cells" : " points"));
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
        input_.fail(ErrorCode::corrupt,
                    "the number of components or LOOKUP_TABLE should stand here");
      word = lower_case(input_.word());
    }
    if (word != "lookup_table") input_.fail(ErrorCode::corrupt, "LOOKUP_TABLE should stand here");
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

// The values that `entry` announces, where the input stands behind the announcement.
void Parser::values(Entry entry) {
  const ValueForm form = form_of_word(entry.type);
  if (form == ValueForm::unknown)
    input_.fail(ErrorCode::corrupt, "'" + entry.type.substr(0, 40) + "' is no type of values");
  if (form == ValueForm::number) {
    numbers(entry, *scalar_of_word(entry.type, skeleton_.binary));
  } else {
    odd_values(entry, form);
  }
  if (entry.kind != EntryKind::lookup_table) metadata(entry.components, entry.metadata);
  skeleton_.entries.push_back(std::move(entry));
}

void Parser::numbers(Entry& entry, ScalarType type) {
  Values column_values = column(type, product(entry.tuples, entry.components));
  if (is_per_element(entry)) {
    entry.origin = Origin::array;
    entry.index = source_.arrays_.size();
    source_.arrays_.push_back(std::move(column_values));
    ArrayInfo array;
    array.name = decode_name(entry.name);
    array.location = section_ == Section::cell_data ? Location::cell : Location::point;
    array.type = type;
    array.components = static_cast<std::uint32_t>(entry.components);
    info_.schema.arrays.push_back(std::move(array));
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

bool Parser::is_per_element(const Entry& entry) const {
  if (entry.kind == EntryKind::blanking) return true;
  return section_ != Section::dataset && entry.kind != EntryKind::lookup_table &&
         entry.tuples == section_size() && entry.components >= 1 &&
         entry.components <= kMostComponents;
}

// Strings, variants and bits: kept as the bytes or words that the file has.
void Parser::odd_values(Entry& entry, ValueForm form) {
  std::string data;
  const std::uint64_t count = product(entry.tuples, entry.components);
  if (form == ValueForm::string) {
    input_.skip_line();
    strings(count, data);
  } else if (form == ValueForm::variant) {
    for (std::uint64_t i = 0; i < count; ++i) {
      data.append(input_.word()).append(" ");
      data.append(input_.word()).append("\n");
    }
  } else if (skeleton_.binary) {
    const std::uint64_t bytes = count / 8 + (count % 8 != 0);
    if (count > 0) next_line_is_binary();
    if (bytes > input_.left()) input_.fail(ErrorCode::truncated, "the file ends within the bits");
    data.resize(bytes);
    input_.bytes(reinterpret_cast<std::byte*>(data.data()), bytes);
  } else {
    for (std::uint64_t i = 0; i < count; ++i)
      data += static_cast<char>(input_.number<std::int64_t>() != 0);
  }
  entry.origin = Origin::extra;
  entry.index = data_count_++;
  add_text_extra(data_key(entry.index), data);
}

// Text: one %-encoded line a string. Binary: a length in 1, 2, 4 or 8 bytes, whose first two bits
// say which (3, 2, 1, 0), then the characters.
void Parser::strings(std::uint64_t count, std::string& out) {
  for (std::uint64_t i = 0; i < count; ++i) {
    if (!skeleton_.binary) {
      out.append(input_.line()).append("\n");
      continue;
    }
    std::byte head[8] = {};
    input_.bytes(head, 1);
    const std::size_t head_bytes = std::size_t{8} >> (static_cast<unsigned>(head[0]) >> 6);
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
}

// METADATA, when it stands here, up to the empty line that ends it. Component names may be empty
// lines themselves, and empty lines may stand before the keys of an INFORMATION.
void Parser::metadata(std::uint64_t components, std::string& out) {
  if (lower_case(input_.peek_word()) != "metadata") return;
  input_.skip_line();
  read_metadata(components, out);
}

void Parser::read_metadata(std::uint64_t components, std::string& out) {
  std::uint64_t keys = 0;
  while (!input_.at_end()) {
    const std::string line = input_.line();
    const std::string lower = lower_case(line);
    if (line.empty()) {
      if (keys > 0 && input_.peek_word() == "NAME") continue;
      return;
    }
    out.append(line).append("\n");
    if (lower.starts_with("component_names")) {
      for (std::uint64_t i = 0; i < components; ++i) out.append(input_.line()).append("\n");
    } else if (lower.starts_with("information ")) {
      const std::string_view count = std::string_view(line).substr(12);
      TextInput::parse(count.substr(0, count.find(' ')), keys);
    } else if (line.starts_with("NAME ") && keys > 0) {
      --keys;
    }
  }
}

}  // namespace shm::converters::vtk
