#include "vtk/between/field_data.h"

#include <map>
#include <optional>
#include <utility>

#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/between/xml_contents.h"
#include "vtk/words.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtk {
namespace {

std::vector<FieldArray> of_legacy(const MeshInfo& info) {
  std::vector<FieldArray> arrays;
  const Extra* text = find_extra(info, "vtk/skeleton");
  const auto skeleton = text == nullptr ? std::nullopt : parse_skeleton(text_of_extra(*text));
  if (!skeleton) return arrays;
  for (const Entry& entry : skeleton->entries) {
    if (entry.kind == EntryKind::point_data || entry.kind == EntryKind::cell_data) break;
    if (entry.kind != EntryKind::array || entry.origin != Origin::extra) continue;
    const Extra* values = find_extra(info, data_key(entry.index));
    const ValueForm form = form_of_word(entry.type);
    if (values != nullptr)
      arrays.push_back(
          {decode_name(entry.name), form, string_form(form, skeleton->binary), values});
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
    const ValueForm form = type->kind == vtu::ArrayKind::string ? ValueForm::string
                           : type->kind == vtu::ArrayKind::bit  ? ValueForm::bit
                                                                : ValueForm::number;
    if (values != nullptr)
      arrays.push_back({array->attribute_or("Name", ""), form, StringForm::zeros, values});
  }
  return arrays;
}

}  // namespace

std::vector<FieldArray> field_arrays(const MeshInfo& info) {
  if (info.schema.source_format == "vtk") return of_legacy(info);
  return of_xml(info);
}

std::vector<std::string> strings_of(const FieldArray& array) {
  std::vector<std::string> strings;
  const std::string text = text_of_extra(*array.values);
  const auto pieces = split_strings(text, array.strings);
  if (array.form != ValueForm::string || !pieces) return strings;
  for (const std::string_view piece : *pieces)
    strings.push_back(plain_string(piece, array.strings));
  return strings;
}

Extra block_names_extra(const MeshInfo& info, std::string key, StringForm form) {
  std::map<std::int64_t, std::string> names;
  for (const BlockInfo& block : info.schema.blocks)
    if (!block.name.empty()) names.emplace(block.id, block.name);
  std::string raw;
  for (const auto& [id, name] : names) append_string(raw, std::to_string(id) + ' ' + name, form);
  Extra extra = text_extra(std::move(key), raw);
  extra.shape = {names.size()};
  return extra;
}

}  // namespace shm::converters::vtk
