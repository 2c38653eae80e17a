#include "vtk/between/vtu_from_vtk.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"
#include "vtk/cell_plan.h"
#include "vtk/strings.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {
namespace {

using vtk::Entry;
using vtk::EntryKind;
using vtk::Origin;
using vtk::quoted_array;
using vtk::StringForm;
using vtk::ValueForm;

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

std::string bits_as_bytes(std::string_view text, bool binary, std::uint64_t count) {
  if (!binary) return std::string(text);
  std::string out;
  for (std::uint64_t i = 0; i < count && i / 8 < text.size(); ++i)
    out += static_cast<char>(static_cast<unsigned char>(text[i / 8]) >> (7 - i % 8) & 1);
  return out;
}

// Adds an information key to an array. A legacy file has two lines for the key: "NAME <key>
// LOCATION <class>" and "DATA <value>" or "DATA <count> <values>".
void add_information(Node& array, std::string_view name_line, std::string_view data_line,
                     bool rounded) {
  take_word(name_line);
  const std::string key = vtk::decode_name(take_word(name_line));
  if (rounded && vtk::is_range_key(key)) return;
  take_word(name_line);
  const std::string location = vtk::decode_name(take_word(name_line));
  take_word(data_line);
  while (data_line.ends_with(' ')) data_line.remove_suffix(1);
  Node node =
      element("InformationKey", {{"name", valid_name(key)}, {"location", valid_name(location)}});
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

void add_metadata(Node& array, std::string_view text, std::uint64_t components, bool rounded) {
  bool named = false;  // true after the first list of component names; further lists are ignored
  while (!text.empty()) {
    const std::string_view line = take_line(text);
    if (vtk::lower_case(line.substr(0, 15)) == "component_names") {
      for (std::uint64_t c = 0; c < components && !text.empty(); ++c) {
        const std::string name = valid_name(vtk::decode_name(take_line(text)));
        if (!name.empty() && !named)
          array.attributes.emplace_back("ComponentName" + std::to_string(c), name);
      }
      named = true;
    } else if (line.starts_with("NAME ")) {
      add_information(array, line, take_line(text), rounded);
    }
  }
}

class XmlBuilder {
 public:
  XmlBuilder(const MeshInfo& info, const std::string& format, LossList* losses)
      : info_(info), format_(format), losses_(losses) {}

  XmlParts build() {
    const Extra* text = extras_.find("vtk/skeleton");
    if (text == nullptr) return std::move(parts_);
    const auto parsed = vtk::parse_skeleton(text_of_extra(*text));
    if (!parsed) vtk::fail_extra(text->key, "the stored structure of the VTK file is invalid");
    skeleton_ = &*parsed;
    for (const Entry& entry : skeleton_->entries) add(entry);
    add_dataset();
    add_title();
    for (Node* data : {&parts_.field, &parts_.point_data, &parts_.cell_data})
      make_names_unique(*data);
    if (skeleton_->version >= vtk::kNewNumberingInLegacy && vtk::has_renumbered_cells(info_))
      parts_.version = "2.2";
    return std::move(parts_);
  }

 private:
  enum class Section { field, points, cells };

  void add(const Entry& entry) {
    switch (entry.kind) {
      case EntryKind::point_data: section_ = Section::points; return;
      case EntryKind::cell_data: section_ = Section::cells; return;
      case EntryKind::points: return add_points(entry);
      case EntryKind::x_coordinates:
      case EntryKind::y_coordinates:
      case EntryKind::z_coordinates:
        if (!entry.metadata.empty()) lose("metadata of " + std::string(keyword(entry.kind)));
        return;
      case EntryKind::lookup_table:
        return lose("lookup table '" + vtk::decode_name(entry.name) + "'");
      default: break;
    }
    if (entry.origin == Origin::array) return add_array(entry);
    if (entry.origin == Origin::extra) add_extra(entry);
  }

  void lose(std::string what) { losses_.add(std::move(what)); }

  void add_points(const Entry& entry) {
    const auto type = vtk::scalar_of_word(entry.type, skeleton_->binary);
    Node array = array_element(std::string(word_of_type(type.value_or(ScalarType::float64))),
                               "Points", 3, format_, "points");
    if (!type || is_float(*type))
      array.set_attribute("type", std::string(word_of_type(info_.schema.coordinate_type)));
    add_metadata(array, entry.metadata, 3, info_.schema.coordinate_quantization.lossy());
    parts_.points.children = {std::move(array)};
  }

  // Adds an array with a value for each point or cell.
  void add_array(const Entry& entry) {
    if (entry.index >= info_.schema.arrays.size()) return;
    const ArrayInfo& info = info_.schema.arrays[entry.index];
    const ValueForm form = vtk::form_of_word(entry.type);
    if (info.per_step || info.components != entry.components) return;
    if (form == ValueForm::variant) return lose("variants of " + quoted_array(info.name));
    const bool strings = form == ValueForm::string;
    if (strings != (info.role == vtk::kStringRole) || (!strings && !info.role.empty()) ||
        (form == ValueForm::bit && info.type != ScalarType::uint8))
      return;
    Node& data = info.location == Location::cell ? parts_.cell_data : parts_.point_data;
    if (!parts_.placed.insert(entry.index).second)
      return set_role(valid_name(info.name), entry.kind, data);
    const std::string type = strings                  ? "String"
                             : form == ValueForm::bit ? "Bit"
                                                      : std::string(word_of_type(info.type));
    Node array = array_element(type, valid_name(info.name), info.components, format_,
                               'a' + std::to_string(entry.index));
    if (strings) {
      array.name = "Array";
      add_strings(entry.index, info.name);
    }
    add_metadata(array, entry.metadata, info.components, info.quantization.lossy());
    put(std::move(array), entry.kind, data);
  }

  void add_strings(std::size_t array, const std::string& name) {
    std::string list;
    for (const std::string& each : vtk::strings_of_array(info_, array))
      add_string(list, each, name);
    parts_.made.strings.push_back(text_extra(vtk::strings_key(array), list));
  }

  void add_string(std::string& list, const std::string& text, const std::string& array) {
    if (text.find('\0') != std::string::npos)
      lose("strings of " + quoted_array(array) + " beyond a zero byte");
    vtk::append_string(list, text, StringForm::zeros);
  }

  // Adds an array that is stored as an extra, because it has too many components, or the wrong
  // number of values for an array of points or cells. If the number of values is right and the mesh
  // is in file order (Order::keep), the array becomes an array of points or cells. Otherwise, it
  // becomes field data.
  void add_extra(const Entry& entry) {
    const std::string name = vtk::decode_name(entry.name);
    const Extra* found = extras_.find(vtk::data_key(entry.index));
    if (found == nullptr) return;
    const ValueForm form = vtk::form_of_word(entry.type);
    const std::string raw = text_of_extra(*found);
    std::string type(word_of_type(found->type));
    Extra values;
    if (form == ValueForm::number) {
      values = *found;
    } else if (form == ValueForm::string) {
      type = "String";
      const StringForm from = vtk::string_form(form, skeleton_->binary);
      const auto pieces = vtk::split_strings(raw, from);
      std::string list;
      for (std::size_t i = 0; pieces && i < pieces->size(); ++i)
        add_string(list, vtk::plain_string((*pieces)[i], from), name);
      values = text_extra({}, list);
    } else if (form == ValueForm::bit) {
      type = "Bit";
      values =
          text_extra({}, bits_as_bytes(raw, skeleton_->binary, entry.components * entry.tuples));
    } else {
      return lose("field data '" + name + "' (variants)");
    }
    const std::uint64_t elements = section_ == Section::points  ? info_.vertices
                                   : section_ == Section::cells ? info_.cells()
                                                                : 0;
    const bool one_each =
        section_ != Section::field && entry.tuples == elements && info_.schema.order == Order::keep;
    if (section_ != Section::field && !one_each)
      lose("place of " + quoted_array(name) + " (" + std::to_string(entry.tuples) + " values for " +
           std::to_string(elements) + (section_ == Section::points ? " points" : " cells") +
           "; field data there)");
    Node array = array_element(type, valid_name(name), entry.components, format_,
                               'x' + std::to_string(parts_.made.data.size()));
    if (form == ValueForm::string) array.name = "Array";
    values.key = data_key(parts_.made.data.size());
    parts_.made.data.push_back(std::move(values));
    const bool too_many = entry.components > vtk::kMostNamedComponents;
    if (too_many && !entry.metadata.empty()) lose("metadata of " + quoted_array(name));
    if (!too_many) add_metadata(array, entry.metadata, entry.components, false);
    if (one_each)
      return put(std::move(array), entry.kind,
                 section_ == Section::points ? parts_.point_data : parts_.cell_data);
    array.set_attribute("NumberOfTuples", std::to_string(entry.tuples));
    if (name == vtk::kLegacyTime && entry.tuples == 1 && entry.components == 1 &&
        form == ValueForm::number && !has_field(vtk::kXmlTime))
      array.set_attribute("Name", std::string(vtk::kXmlTime));
    parts_.field.children.push_back(std::move(array));
  }

  bool has_field(std::string_view name) const {
    return std::any_of(skeleton_->entries.begin(), skeleton_->entries.end(), [&](const Entry& e) {
      return e.origin == Origin::extra && e.kind == EntryKind::array &&
             vtk::decode_name(e.name) == name;
    });
  }

  void put(Node array, EntryKind kind, Node& data) {
    set_role(array.attribute_or("Name", ""), kind, data);
    data.children.push_back(std::move(array));
  }

  // Gives a role to an array unless another array already has the role. If several arrays of a
  // legacy file have the same role, VTK uses the first.
  void set_role(const std::string& array, EntryKind kind, Node& data) {
    for (const vtk::Attribute& attribute : vtk::kAttributes)
      if (kind == attribute.kind && data.attribute(attribute.name) == nullptr)
        data.set_attribute(attribute.name, array);
  }

  // Renames arrays so that no two arrays have the same name. If arrays have the same name, VTK
  // keeps only the last when it reads a legacy file, and mixes them up when it reads an XML file.
  void make_names_unique(Node& data) {
    std::set<std::string> used;
    for (const Node& array : data.children) used.insert(array.attribute_or("Name", ""));
    std::set<std::string> taken;
    std::map<std::string, int> numbers;
    for (auto array = data.children.rbegin(); array != data.children.rend(); ++array) {
      const std::string name = array->attribute_or("Name", "");
      if (taken.insert(name).second) continue;
      std::string other;
      int& number = numbers.try_emplace(name, 2).first->second;
      while (other.empty() || !used.insert(other).second)
        other = name + " (" + std::to_string(number++) + ")";
      array->set_attribute("Name", other);
      lose("name of " + quoted_array(name) + ", which another array has ('" + other + "' there)");
    }
  }

  void add_dataset() {
    if (skeleton_->dataset == vtk::Dataset::unstructured_grid) return;
    const std::string word(dataset_word(skeleton_->dataset));
    for (const Entry& entry : skeleton_->entries)
      if (entry.kind == EntryKind::dimensions || entry.kind == EntryKind::extent)
        return lose(vtk::lower_case(keyword(entry.kind)) + ' ' + entry.type + " (" + word + ")");
    lose("kind of data set (" + word + ")");
  }

  void add_title() {
    const std::string& title = skeleton_->title;
    if (title.empty() || title == vtk::Skeleton().title) return;
    if (has_field(vtk::kXmlTitle)) return lose("title '" + title + "'");
    std::string values;
    vtk::append_string(values, title, StringForm::zeros);
    parts_.field.children.push_back(
        strings_element(std::string(vtk::kXmlTitle), std::move(values), format_, parts_.made));
  }

  const MeshInfo& info_;
  const std::string& format_;
  LossCollector losses_;
  const ExtraIndex extras_{info_.extras};
  const vtk::Skeleton* skeleton_ = nullptr;
  Section section_ = Section::field;
  XmlParts parts_;
};

}  // namespace

XmlParts xml_of_legacy(const MeshInfo& info, const std::string& format, LossList* losses) {
  return XmlBuilder(info, format, losses).build();
}

Node strings_element(const std::string& name, std::string values, const std::string& format,
                     vtk::MadeExtras& made) {
  const std::size_t place = made.data.size();
  Node array = array_element("String", name, 1, format, 'x' + std::to_string(place));
  array.name = "Array";
  array.set_attribute("NumberOfTuples",
                      std::to_string(std::count(values.begin(), values.end(), '\0')));
  made.data.push_back(text_extra(data_key(place), values));
  return array;
}

LossList losses_in_vtu(const MeshInfo& info) {
  LossList losses;
  xml_of_legacy(info, "ascii", &losses);
  return losses;
}

}  // namespace shm::converters::vtu
