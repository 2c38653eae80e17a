#include "vtk/between/xml_contents.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "base/text_input.h"
#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/xml_words.h"

namespace shm::converters::vtu {
namespace {

constexpr std::string_view kKnown[] = {
    "VTKFile", "UnstructuredGrid", "Piece", "PointData", "CellData",       "Points",
    "Cells",   "DataArray",        "Array", "Value",     "InformationKey", "AppendedData"};

// Adds to `losses` the markup of a node and its descendants that is lost when the mesh is written
// in another format.
void add_markup(const Node& node, bool of_grid, LossCollector& losses) {
  switch (node.kind) {
    case NodeKind::comment: return losses.add("comments");
    case NodeKind::instruction: return losses.add("processing instructions");
    case NodeKind::text: return losses.add("text between elements");
    case NodeKind::values: return;
    case NodeKind::element: break;
  }
  const bool known = std::find(std::begin(kKnown), std::end(kKnown), node.name) != std::end(kKnown);
  if (!known && !(of_grid && node.name == "FieldData"))
    return losses.add("element '" + node.name + "'");
  const bool says_values = node.is("InformationKey") || node.is("Value");
  for (const Node& child : node.children)
    if (!says_values || child.kind != NodeKind::text)
      add_markup(child, node.is("UnstructuredGrid"), losses);
}

void forget_all_ranges(Node& node) {
  if (node.is_array()) return forget_ranges(node);
  for (Node& each : node.children) forget_all_ranges(each);
}

}  // namespace

std::optional<Contents> Contents::of(const MeshInfo& info) {
  if (info.schema.source_format != "vtu") return std::nullopt;
  const Extra* text = find_extra(info, "vtu/skeleton");
  auto document = text == nullptr ? std::nullopt : parse_skeleton(text_of_extra(*text));
  if (!document || document->root().child("UnstructuredGrid") == nullptr) return std::nullopt;
  return Contents(std::move(*document));
}

std::vector<Node*> Contents::field_arrays() {
  std::vector<Node*> arrays;
  if (Node* field = grid().child("FieldData"))
    for (Node& each : field->children)
      if (each.is_array()) arrays.push_back(&each);
  return arrays;
}

std::vector<Node*> Contents::pieces() {
  std::vector<Node*> found;
  for (Node& each : grid().children)
    if (each.is("Piece")) found.push_back(&each);
  return found;
}

std::vector<Node*> Contents::data(Location location) {
  std::vector<Node*> found;
  for (Node* piece : pieces())
    found.push_back(piece->child(location == Location::cell ? "CellData" : "PointData"));
  return found;
}

Node* Contents::first_data(Location location) {
  const std::vector<Node*> all = pieces(), found = data(location);
  const char* count = location == Location::cell ? "NumberOfCells" : "NumberOfPoints";
  for (std::size_t p = 0; p < all.size(); ++p)
    if (parse_count(all[p]->attribute_or(count, "")).value_or(0) > 0) return found[p];
  return found.empty() ? nullptr : found.front();
}

std::vector<Node*> Contents::all_points() {
  std::vector<Node*> found;
  for (Node* piece : pieces())
    if (Node* element = piece->child("Points"))
      for (Node& each : element->children)
        if (each.is_array()) found.push_back(&each);
  return found;
}

Node* Contents::points() {
  for (Node* array : all_points())
    if (const auto word = values_word(*array); word && word->word == "points") return array;
  return nullptr;
}

std::vector<double> Contents::times() {
  std::vector<double> times;
  const std::string text = grid().attribute_or("TimeValues", "");
  constexpr std::string_view kBlank = " \t\r\n";
  for (std::size_t position = text.find_first_not_of(kBlank); position < text.size();) {
    const std::size_t end = std::min(text.find_first_of(kBlank, position), text.size());
    double time = 0;
    if (!TextInput::parse(std::string_view(text).substr(position, end - position), time)) return {};
    times.push_back(time);
    position = text.find_first_not_of(kBlank, end);
  }
  return times;
}

std::string Contents::without_ranges() {
  for (Node& node : document_.nodes) forget_all_ranges(node);
  return to_text(document_);
}

LossList Contents::markup() {
  LossList losses;
  if (const std::size_t count = pieces().size(); count > 1)
    losses.push_back("split into " + std::to_string(count) + " pieces");
  LossCollector collector(&losses);
  for (const Node& node : document_.nodes) add_markup(node, false, collector);
  return losses;
}

std::optional<std::size_t> points_of_step(const MeshInfo& info, std::uint64_t step) {
  const auto& arrays = info.schema.arrays;
  const auto move = [](const ArrayInfo& array) { return array.role == "vtu:points"; };
  auto contents =
      std::any_of(arrays.begin(), arrays.end(), move) ? Contents::of(info) : std::nullopt;
  if (!contents) return std::nullopt;
  for (Node* array : contents->all_points()) {
    const auto word = values_word(*array);
    if (word && word->kind == ValuesWord::Kind::array && word->index < arrays.size() &&
        parse_count(array->attribute_or("TimeStep", "")) == step && move(arrays[word->index]) &&
        arrays[word->index].location == Location::point && arrays[word->index].components == 3)
      return word->index;
  }
  return std::nullopt;
}

void forget_ranges(Node& array) {
  array.remove_attribute("RangeMin");
  array.remove_attribute("RangeMax");
  std::erase_if(array.children, [](const Node& each) {
    return each.is("InformationKey") && vtk::is_range_key(each.attribute_or("name", ""));
  });
}

bool has_metadata(const Node& array) {
  return std::any_of(array.attributes.begin(), array.attributes.end(),
                     [](const auto& each) { return each.first.starts_with("ComponentName"); }) ||
         std::any_of(array.children.begin(), array.children.end(), [](const Node& each) {
           return each.is("InformationKey") && !vtk::is_range_key(each.attribute_or("name", ""));
         });
}

}  // namespace shm::converters::vtu
