#include "vtk/between/vtk_field_data.h"

#include <cstring>
#include <utility>

#include "base/stored_value.h"
#include "base/text_input.h"
#include "sets/transfer_sets.h"
#include "vtk/between/vtk_family.h"
#include "vtk/between/vtu_contents.h"
#include "vtk/words.h"
#include "vtk/xml/loader.h"

namespace shm::converters {
namespace {

std::vector<FieldArray> of_legacy(const MeshInfo& info) {
  std::vector<FieldArray> arrays;
  const Extra* text = find_extra(info, "vtk/skeleton");
  const auto skeleton = text == nullptr ? std::nullopt : vtk::parse_skeleton(text_of_extra(*text));
  if (!skeleton) return arrays;
  for (const vtk::Entry& entry : skeleton->entries) {
    if (entry.kind == vtk::EntryKind::point_data || entry.kind == vtk::EntryKind::cell_data) break;
    if (entry.kind != vtk::EntryKind::array || entry.origin != vtk::Origin::extra) continue;
    const Extra* values = find_extra(info, vtk::data_key(entry.index));
    const vtk::ValueForm form = vtk::form_of_word(entry.type);
    if (values != nullptr)
      arrays.push_back(
          {vtk::decode_name(entry.name), form, vtk::string_form(form, skeleton->binary), values});
  }
  return arrays;
}

std::vector<FieldArray> of_xml(const MeshInfo& info) {
  std::vector<FieldArray> arrays;
  auto contents = vtu::Contents::of(info);
  if (!contents) return arrays;
  for (vtu::Node* array : contents->field_arrays()) {
    const auto word = vtu::values_word(*array);
    const auto type = vtu::type_of_word(array->attribute_or("type", ""));
    if (!word || word->kind != vtu::ValuesWord::Kind::extra || !type) continue;
    const Extra* values = find_extra(info, vtu::data_key(word->index));
    const vtk::ValueForm form = type->kind == vtu::ArrayKind::string ? vtk::ValueForm::string
                                : type->kind == vtu::ArrayKind::bit  ? vtk::ValueForm::bit
                                                                     : vtk::ValueForm::number;
    if (values != nullptr)
      arrays.push_back({array->attribute_or("Name", ""), form, vtk::StringForm::zeros, values});
  }
  return arrays;
}

std::vector<std::string> strings_of(const FieldArray& array) {
  std::vector<std::string> strings;
  const std::string text = text_of_extra(*array.values);
  const auto pieces = vtk::split_strings(text, array.strings);
  if (array.form != vtk::ValueForm::string || !pieces) return strings;
  for (const std::string_view piece : *pieces)
    strings.push_back(vtk::plain_string(piece, array.strings));
  return strings;
}

}  // namespace

std::vector<FieldArray> field_arrays(const MeshInfo& info) {
  if (info.schema.source_format == "vtk") return of_legacy(info);
  return of_xml(info);
}

std::optional<double> vtk_time(const MeshInfo& info, std::set<std::string>& told) {
  const std::vector<FieldArray> arrays = field_arrays(info);
  for (const std::string_view name : {vtk::kLegacyTime, vtk::kXmlTime})
    for (const FieldArray& array : arrays) {
      const Extra& values = *array.values;
      if (array.name != name || array.form != vtk::ValueForm::number ||
          values.data.size() != scalar_bytes(values.type))
        continue;
      told.insert(values.key);
      return as_double(values.data.data(), values.type);
    }
  return std::nullopt;
}

std::string vtk_title(const MeshInfo& info, std::set<std::string>& told) {
  if (const Extra* text = find_extra(info, "vtk/skeleton")) {
    const auto skeleton = vtk::parse_skeleton(text_of_extra(*text));
    return skeleton && skeleton->title != vtk::Skeleton().title ? skeleton->title : std::string();
  }
  for (const FieldArray& array : field_arrays(info)) {
    if (array.name != vtk::kXmlTitle) continue;
    std::vector<std::string> strings = strings_of(array);
    if (strings.size() != 1) continue;
    told.insert(array.values->key);
    return std::move(strings.front());
  }
  return {};
}

std::map<std::int64_t, std::string> vtk_block_names(const MeshInfo& info,
                                                    std::set<std::string>& told) {
  std::map<std::int64_t, std::string> names;
  for (const FieldArray& array : field_arrays(info)) {
    if (array.name != kVtkBlockNames) continue;
    for (const std::string& line : strings_of(array)) {
      const std::size_t blank = line.find(' ');
      std::int64_t id = 0;
      if (blank != std::string::npos &&
          TextInput::parse(std::string_view(line).substr(0, blank), id))
        names.emplace(id, line.substr(blank + 1));
    }
    if (!names.empty()) told.insert(array.values->key);
    break;
  }
  return names;
}

Extra vtk_block_names_extra(const MeshInfo& info, std::string key, vtk::StringForm form) {
  std::map<std::int64_t, std::string> names;
  for (const BlockInfo& block : info.schema.blocks)
    if (!block.name.empty()) names.emplace(block.id, block.name);
  std::string raw;
  for (const auto& [id, name] : names)
    vtk::append_string(raw, std::to_string(id) + ' ' + name, form);
  Extra extra = vtk::text_extra(std::move(key), raw);
  extra.shape = {names.size()};
  return extra;
}

}  // namespace shm::converters
