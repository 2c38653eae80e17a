#include "vtu_legacy.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "vtk_field_data.h"
#include "vtu_loader.h"
#include "vtu_plan.h"

namespace shm::converters::vtu {
namespace {

using vtk::Entry;
using vtk::EntryKind;
using vtk::Origin;
using vtk::ValueForm;

struct Attribute {
  EntryKind kind;
  std::string_view name;
  std::uint64_t least, most;  // components
};
constexpr Attribute kAttributes[] = {
    {EntryKind::scalars, "Scalars", 1, 4},
    {EntryKind::vectors, "Vectors", 3, 3},
    {EntryKind::normals, "Normals", 3, 3},
    {EntryKind::tensors, "Tensors", 9, 9},
    {EntryKind::texture_coordinates, "TCoords", 1, 3},
    {EntryKind::global_ids, "GlobalIds", 1, 1},
    {EntryKind::pedigree_ids, "PedigreeIds", 1, 1},
};
// The time of a file: what each of the formats calls it.
constexpr std::string_view kLegacyTime = "TIME", kXmlTime = "TimeValue";

constexpr int kLagrangeHexahedron = 72, kBezierHexahedron = 79;

std::string_view text_of(const Extra& extra) {
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

Extra text_extra(const std::string& text) {
  Extra extra{{}, ScalarType::uint8, Reference::nothing, {text.size()}, {}};
  const auto* bytes = reinterpret_cast<const std::byte*>(text.data());
  extra.data.assign(bytes, bytes + text.size());
  return extra;
}

std::string_view take_line(std::string_view& text) {
  const std::size_t end = text.find('\n');
  const std::string_view line = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return line;
}

std::string_view take_word(std::string_view& text) {
  const std::size_t end = text.find(' ');
  const std::string_view word = text.substr(0, end);
  text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  return word;
}

std::string_view take(std::string_view& text, std::size_t count) {
  const std::string_view head = text.substr(0, count);
  text.remove_prefix(head.size());
  return head;
}

// --- legacy to XML

// Strings of a legacy file, each ended by a 0.
std::string strings_with_zeros(std::string_view text, bool binary) {
  std::string out;
  while (!text.empty()) {
    if (!binary) {
      out += vtk::decode_name(take_line(text)) + '\0';
      continue;
    }
    // A length in 1, 2, 4 or 8 bytes, which the first two bits tell.
    const auto first = static_cast<unsigned char>(text[0]);
    const std::string_view head = take(text, std::size_t{8} >> (first >> 6));
    std::uint64_t length = first & 63U;
    for (const char byte : head.substr(1)) length = length << 8 | static_cast<unsigned char>(byte);
    out.append(take(text, static_cast<std::size_t>(length))) += '\0';
  }
  return out;
}

std::string bits_as_bytes(std::string_view text, bool binary, std::uint64_t count) {
  if (!binary) return std::string(text);
  std::string out;
  for (std::uint64_t i = 0; i < count && i / 8 < text.size(); ++i)
    out += static_cast<char>(static_cast<unsigned char>(text[i / 8]) >> (7 - i % 8) & 1);
  return out;
}

// One line of an INFORMATION, "NAME <key> LOCATION <class>", and the next, "DATA <value>" or
// "DATA <count> <values>".
void add_information(Node& array, std::string_view name_line, std::string_view data_line) {
  take_word(name_line);
  const std::string key = vtk::decode_name(take_word(name_line));
  take_word(name_line);
  const std::string location = vtk::decode_name(take_word(name_line));
  take_word(data_line);
  while (data_line.ends_with(' ')) data_line.remove_suffix(1);
  Node node = element("InformationKey", {{"name", key}, {"location", location}});
  const auto text_node = [](std::string_view word) {
    return Node{.kind = NodeKind::text, .name = {}, .text = valid_name(vtk::decode_name(word))};
  };
  const auto words =
      static_cast<std::uint64_t>(std::count(data_line.begin(), data_line.end(), ' '));
  const auto stated = parse_count(data_line.substr(0, data_line.find(' ')));
  if (words > 0 && stated == words) {
    node.set_attribute("length", std::to_string(words));
    take_word(data_line);
    for (std::uint64_t i = 0; i < words; ++i) {
      Node value = element("Value", {{"index", std::to_string(i)}});
      value.children.push_back(text_node(take_word(data_line)));
      node.children.push_back(std::move(value));
    }
  } else {
    node.children.push_back(text_node(data_line));
  }
  array.children.push_back(std::move(node));
}

void add_metadata(Node& array, const Entry& entry) {
  std::string_view text = entry.metadata;
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (line.starts_with("COMPONENT_NAMES")) {
      for (std::uint64_t c = 0; c < entry.components; ++c)
        array.set_attribute("ComponentName" + std::to_string(c),
                            valid_name(vtk::decode_name(take_line(text))));
    } else if (line.starts_with("NAME ")) {
      add_information(array, line, take_line(text));
    }
  }
}

// The array of an entry; nothing for those that XML files cannot have.
std::optional<Node> array_of_entry(const Entry& entry, const MeshInfo& info, const ExtraMap& extras,
                                   bool binary, LegacyParts& parts) {
  const std::string name = valid_name(vtk::decode_name(entry.name));
  if (entry.origin == Origin::array) {
    const auto& arrays = info.schema.arrays;
    if (entry.index >= arrays.size() || !arrays[entry.index].role.empty() ||
        arrays[entry.index].per_step || !parts.placed.insert(entry.index).second)
      return std::nullopt;
    return array_element(std::string(word_of_type(arrays[entry.index].type)), name,
                         arrays[entry.index].components, parts.format,
                         'a' + std::to_string(entry.index));
  }
  const auto found = extras.find(vtk::data_key(entry.index));
  if (found == extras.end() || entry.kind == EntryKind::lookup_table) return std::nullopt;
  const ValueForm form = vtk::form_of_word(entry.type);
  std::string type;
  Extra values;
  if (form == ValueForm::number) {
    type = word_of_type(found->second->type);
    values = *found->second;
  } else if (form == ValueForm::string) {
    type = "String";
    values = text_extra(strings_with_zeros(text_of(*found->second), binary));
  } else if (form == ValueForm::bit) {
    type = "Bit";
    values =
        text_extra(bits_as_bytes(text_of(*found->second), binary, entry.components * entry.tuples));
  } else {
    return std::nullopt;
  }
  Node array = array_element(type, name, entry.components, parts.format,
                             'x' + std::to_string(parts.made.size()));
  if (form == ValueForm::string) array.name = "Array";
  parts.made.push_back(std::move(values));
  return array;
}

// Legacy files from 5.1 on and XML files from 2.1 on number the nodes of these cells anew.
bool numbers_nodes_anew(const MeshInfo& info, bool new_version) {
  const auto is_one = [](const BlockInfo& block) {
    return block.id == kLagrangeHexahedron || block.id == kBezierHexahedron;
  };
  return new_version && std::any_of(info.schema.blocks.begin(), info.schema.blocks.end(), is_one);
}

// --- XML to legacy

std::string strings_with_lengths(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find('\0'));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
    const std::uint64_t length = word.size();
    const int bytes = length < 64 ? 1 : length < 16384 ? 2 : length < (1U << 30) ? 4 : 8;
    const std::uint64_t mark = bytes == 1 ? 3 : bytes == 2 ? 2 : bytes == 4 ? 1 : 0;
    const std::uint64_t head = length | mark << (8 * bytes - 2);
    for (int b = bytes - 1; b >= 0; --b) out += static_cast<char>(head >> (8 * b) & 0xff);
    out.append(word);
  }
  return out;
}

// The words of an information key, "<value>" or "<count> <values>".
std::string information_data(const Node& key) {
  const auto word_of = [](const Node& node) {
    for (const Node& each : node.children) {
      if (each.kind != NodeKind::text) continue;
      constexpr std::string_view kBlank = " \t\r\n";
      const std::size_t first = each.text.find_first_not_of(kBlank);
      if (first == std::string::npos) break;
      return vtk::encode_name(std::string_view(each.text).substr(
          first, each.text.find_last_not_of(kBlank) + 1 - first));
    }
    return std::string();
  };
  std::string values;
  std::uint64_t count = 0;
  for (const Node& each : key.children) {
    if (!each.is("Value")) continue;
    values += ' ' + word_of(each);
    ++count;
  }
  return count > 0 ? std::to_string(count) + values : word_of(key);
}

std::string metadata_of(const Node& array, std::uint64_t components) {
  std::string names, keys;
  bool all_named = true;
  for (std::uint64_t c = 0; all_named && c < components; ++c) {
    const std::string* name = array.attribute("ComponentName" + std::to_string(c));
    all_named = name != nullptr;
    if (all_named) names += (name->empty() ? "" : vtk::encode_name(*name)) + '\n';
  }
  std::size_t count = 0;
  for (const Node& each : array.children) {
    if (!each.is("InformationKey")) continue;
    ++count;
    keys += "NAME " + vtk::encode_name(each.attribute_or("name", "")) + " LOCATION " +
            vtk::encode_name(each.attribute_or("location", "")) + "\nDATA " +
            information_data(each) + '\n';
  }
  return (all_named ? "COMPONENT_NAMES\n" + names : "") +
         (count > 0 ? "INFORMATION " + std::to_string(count) + '\n' + keys : "");
}

class LegacyBuilder {
 public:
  LegacyBuilder(const MeshInfo& info, const ExtraMap& extras, std::set<std::size_t>& placed,
                std::deque<Extra>& made)
      : info_(info), extras_(extras), placed_(placed), made_(made) {}

  void field(Node& field_data) {
    std::vector<Entry> arrays;
    for (Node& each : field_data.children)
      if (each.is_array()) add_extra(each, arrays);
    add_field(std::move(arrays));
  }
  // Of the first piece, whose arrays are those of all.
  void data(Node* node, Location location) {
    const bool of_cells = location == Location::cell;
    std::vector<Entry> named, others;
    for (std::size_t i = 0; node != nullptr && i < node->children.size(); ++i)
      if (node->children[i].is_array())
        add_array(*node, node->children[i], location, named, others);
    for (std::size_t i = 0; i < info_.schema.arrays.size(); ++i)
      if (info_.schema.arrays[i].location == location && is_written(i) && placed_.insert(i).second)
        others.push_back(entry_of(i));
    if (named.empty() && others.empty()) return;
    entries_.push_back({.kind = of_cells ? EntryKind::cell_data : EntryKind::point_data});
    entries_.insert(entries_.end(), named.begin(), named.end());
    add_field(std::move(others));
  }
  std::vector<Entry> take() { return std::move(entries_); }

 private:
  bool is_written(std::size_t array) const {
    const ArrayInfo& info = info_.schema.arrays[array];
    return info.role.empty() && (!info.per_step || !info_.step_times.empty());
  }
  Entry entry_of(std::size_t array) const {
    const ArrayInfo& info = info_.schema.arrays[array];
    return {.kind = EntryKind::array,
            .origin = Origin::array,
            .index = array,
            .name = vtk::encode_name(info.name),
            .type = std::string(vtk::word_of_scalar(info.type)),
            .components = info.components,
            .tuples = info.location == Location::cell ? info_.cells() : info_.vertices};
  }
  void add_field(std::vector<Entry> arrays) {
    if (arrays.empty()) return;
    entries_.push_back({.kind = EntryKind::field, .name = "FieldData", .tuples = arrays.size()});
    entries_.insert(entries_.end(), arrays.begin(), arrays.end());
  }
  void add_array(const Node& data, Node& array, Location location, std::vector<Entry>& named,
                 std::vector<Entry>& others) {
    const Node* values = array.values();
    const auto word = values == nullptr ? std::nullopt : parse_values_word(values->text);
    if (!word) return;
    if (word->kind == ValuesWord::Kind::extra) return add_extra(array, others);
    if (word->kind != ValuesWord::Kind::array || word->index >= info_.schema.arrays.size() ||
        info_.schema.arrays[word->index].location != location || !is_written(word->index) ||
        !placed_.insert(word->index).second)
      return;
    Entry entry = entry_of(word->index);
    entry.metadata = metadata_of(array, entry.components);
    for (const Attribute& attribute : kAttributes) {
      if (data.attribute_or(attribute.name, "") != info_.schema.arrays[word->index].name ||
          entry.components < attribute.least || entry.components > attribute.most)
        continue;
      entry.kind = attribute.kind;
      if (entry.kind == EntryKind::scalars) entry.second = "default";
      named.push_back(std::move(entry));
      return;
    }
    others.push_back(std::move(entry));
  }
  void add_extra(Node& array, std::vector<Entry>& out) {
    const Node* values = array.values();
    const auto word = values == nullptr ? std::nullopt : parse_values_word(values->text);
    const auto type = type_of_word(array.attribute_or("type", ""));
    if (!word || word->kind != ValuesWord::Kind::extra || !type) return;
    const auto found = extras_.find(data_key(word->index));
    const std::uint64_t components = std::max<std::uint64_t>(
        parse_count(array.attribute_or("NumberOfComponents", "1")).value_or(1), 1);
    if (found == extras_.end()) return;
    Entry entry{.kind = EntryKind::array,
                .origin = Origin::extra,
                .index = made_.size(),
                .name = vtk::encode_name(array.attribute_or("Name", "")),
                .type = std::string(vtk::word_of_scalar(type->stored)),
                .components = components};
    const std::string_view text = text_of(*found->second);
    std::uint64_t count = text.size() / scalar_bytes(type->stored);
    if (type->kind == ArrayKind::string) {
      count = static_cast<std::uint64_t>(std::count(text.begin(), text.end(), '\0'));
      entry.type = "string";
    }
    entry.tuples = count / components;
    if (entry.tuples * components != count) return;
    if (entry.name == kXmlTime && count == 1) entry.name = kLegacyTime;
    entry.metadata = metadata_of(array, components);
    made_.push_back(type->kind == ArrayKind::string ? text_extra(strings_with_lengths(text))
                                                    : *found->second);
    out.push_back(std::move(entry));
  }

  const MeshInfo& info_;
  const ExtraMap& extras_;
  std::set<std::size_t>& placed_;
  std::deque<Extra>& made_;
  std::vector<Entry> entries_;
};

}  // namespace

std::string add_legacy_parts(const MeshInfo& info, const ExtraMap& extras, LegacyParts& parts) {
  const auto found = extras.find("vtk/skeleton");
  if (found == extras.end()) return "1.0";
  const auto skeleton = vtk::parse_skeleton(text_of(*found->second));
  if (!skeleton) return "1.0";
  Node* data = &parts.field;
  for (const Entry& entry : skeleton->entries) {
    if (entry.kind == EntryKind::point_data) data = &parts.point_data;
    if (entry.kind == EntryKind::cell_data) data = &parts.cell_data;
    if (!vtk::holds_values(entry.kind)) continue;
    auto array = array_of_entry(entry, info, extras, skeleton->binary, parts);
    if (!array) continue;
    add_metadata(*array, entry);
    const std::string name = array->attribute_or("Name", "");
    if (data == &parts.field) {
      array->set_attribute("NumberOfTuples", std::to_string(entry.tuples));
      if (name == kLegacyTime && entry.tuples == 1 && entry.components == 1)
        array->set_attribute("Name", std::string(kXmlTime));
    }
    const EntryKind kind = entry.kind == EntryKind::color_scalars ? EntryKind::scalars : entry.kind;
    for (const Attribute& attribute : kAttributes)
      if (kind == attribute.kind && data != &parts.field) data->set_attribute(attribute.name, name);
    data->children.push_back(std::move(*array));
  }
  return numbers_nodes_anew(info, skeleton->version >= "5.1") ? "2.2" : "1.0";
}

Extra block_names(const MeshInfo& info) {
  const Extra names = vtk_block_names_extra(info, {});
  return text_extra(strings_with_zeros(text_of(names), true));
}

LegacyFile legacy_file(const MeshInfo& info, const ExtraMap& extras, std::set<std::size_t>& placed,
                       std::deque<Extra>& made) {
  LegacyBuilder builder(info, extras, placed, made);
  const auto found = extras.find("vtu/skeleton");
  auto document = found == extras.end() ? std::nullopt : parse_skeleton(text_of(*found->second));
  Node* grid = document ? document->root().child("UnstructuredGrid") : nullptr;
  Node* piece = grid == nullptr ? nullptr : grid->child("Piece");
  if (grid != nullptr)
    if (Node* field = grid->child("FieldData")) builder.field(*field);
  builder.data(piece == nullptr ? nullptr : piece->child("CellData"), Location::cell);
  builder.data(piece == nullptr ? nullptr : piece->child("PointData"), Location::point);
  const std::string version = document ? document->root().attribute_or("version", "") : "";
  return {numbers_nodes_anew(info, version >= "2.1") ? "5.1" : "4.2", builder.take()};
}

}  // namespace shm::converters::vtu
