#include "transfer/losses.h"

#include <algorithm>
#include <sstream>
#include <string_view>

#include "gmsh/groups.h"
#include "mesh/extra_index.h"
#include "sets/transfer_sets.h"
#include "vtk/between/vtk_family.h"
#include "vtk/between/vtu_contents.h"
#include "vtk/words.h"
#include "vtk/xml/loader.h"

namespace shm::converters {
namespace {

constexpr std::string_view kExodusVariable = "exodus/variable/";

// What has been told, so that it is told once.
using Told = std::set<std::string>;

void add_once(LossList& losses, Told& already, std::string what) {
  if (already.insert(what).second) losses.push_back(std::move(what));
}

std::string quoted(std::string_view text) { return " '" + std::string(text) + "'"; }

// "exodus/edge_set/0/edges": the kind, id and name of its set.
std::string exodus_set(const ExtraIndex& extras, const std::string& key) {
  const std::size_t second = key.find('/', 7), third = key.find('/', second + 1);
  if (second == std::string::npos || third == std::string::npos) return {};
  const std::string folder = key.substr(0, third + 1);
  std::string kind = key.substr(7, second - 7);
  std::replace(kind.begin(), kind.end(), '_', ' ');
  const Extra* id = extras.find(folder + "id");
  const Extra* name = extras.find(folder + "name");
  const auto number = id == nullptr ? std::vector<std::int64_t>() : integers_of_extra(*id);
  if (!number.empty()) kind += ' ' + std::to_string(number[0]);
  if (name != nullptr && !name->data.empty()) kind += quoted(text_of_extra(*name));
  return kind;
}

// Whether a variable only says what any file of the kind has: unnamed things, axes x y z, things
// that exist.
bool says_nothing(const Extra& extra) {
  const std::string name = extra.key.substr(kExodusVariable.size());
  if (name.ends_with("_status")) return true;
  std::string text = text_of_extra(extra);
  std::erase_if(text, [](char c) { return c == '\0' || c == ' '; });
  if (name.ends_with("_names") && text.empty()) return true;
  if (name != "coor_names") return false;
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return std::string_view("xyz").starts_with(text);
}

std::string exodus_words(const ExtraIndex& extras, const std::string& key) {
  if (!key.starts_with(kExodusVariable)) return exodus_set(extras, key);
  const std::string name = key.substr(kExodusVariable.size());
  if (name == "qa_records") return "QA records";
  if (name == "info_records") return "information records";
  if (name == "name_glo_var" || name == "vals_glo_var") return "global variables";
  if (name == "coor_names") return "names of coordinates";
  return "netCDF variable" + quoted(name);
}

std::string view_name(const ExtraIndex& extras, const std::string& section) {
  const Extra* header = extras.find(section + "/header");
  std::istringstream lines(header == nullptr ? std::string() : text_of_extra(*header));
  std::string count, name;
  std::getline(lines, count);
  std::getline(lines, name);
  std::erase(name, '"');
  return quoted(name);
}

void add_gmsh_sections(const MeshInfo& info, const ExtraIndex& extras,
                       const std::set<std::string>& told, LossList& losses) {
  Told already;
  const Extra* sections = extras.find("gmsh/sections");
  std::istringstream lines(sections == nullptr ? std::string() : text_of_extra(*sections));
  std::string line;
  for (std::size_t k = 0; std::getline(lines, line); ++k) {
    std::istringstream words(line);
    std::string name, kind;
    std::getline(words, name, '\t');
    std::getline(words, kind, '\t');
    const std::string key = "gmsh/section/" + std::to_string(k);
    if (told.contains(key)) continue;
    if (kind == "list") {
      add_once(losses, already, "view" + view_name(extras, key) + " ($" + name + " of some)");
    } else if (name == "Entities") {
      if (gmsh_entities_have_bounds(info)) losses.push_back("boundaries of entities ($Entities)");
    } else if (name == "PhysicalNames") {
      continue;  // carried by blocks and sets
    } else if (kind == "raw" || kind == "links" || kind == "ghosts") {
      losses.push_back("section $" + name);
    } else if (kind == "between") {
      add_once(losses, already, "text between sections");
    }
  }
}

void add_gmsh_tags(const MeshInfo& info, LossList& losses) {
  for (const auto& [key, what] : {std::pair("gmsh/nodes/first_tag", "node tags"),
                                  {"gmsh/elements/first_tag", "element tags"}}) {
    const Extra* first = find_extra(info, key);
    if (first == nullptr) continue;
    const auto value = integers_of_extra(*first);
    if (!value.empty() && value[0] != 1)
      losses.push_back(std::string(what) + ", from " + std::to_string(value[0]));
  }
  const Extra* entities = find_extra(info, "gmsh/nodes/entities");
  if (entities != nullptr && !entities->shape.empty() && entities->shape[0] > 1)
    losses.push_back("entities of nodes");
}

// Whether the lines of a METADATA say more than ranges.
bool says_more_than_ranges(const std::string& metadata) {
  std::istringstream lines(metadata);
  std::string line;
  while (std::getline(lines, line)) {
    if (vtk::lower_case(line).starts_with("component_names")) return true;
    if (line.starts_with("NAME ") && !vtk::is_range_key(line)) return true;
  }
  return false;
}

void add_vtk_data(const MeshInfo& info, const std::set<std::string>& told, LossList& losses) {
  const Extra* text = find_extra(info, "vtk/skeleton");
  if (text == nullptr) return;
  const auto skeleton = vtk::parse_skeleton(text_of_extra(*text));
  if (!skeleton) return;
  const std::string dataset(vtk::dataset_word(skeleton->dataset));
  if (skeleton->dataset == vtk::Dataset::polydata)
    losses.push_back("kind of data set (" + dataset + ")");
  std::set<vtk::EntryKind> roles;  // of points or cells, whose arrays are under way
  for (const vtk::Entry& entry : skeleton->entries) {
    const std::string name = vtk::decode_name(entry.name);
    if (entry.kind == vtk::EntryKind::point_data || entry.kind == vtk::EntryKind::cell_data)
      roles.clear();
    if (entry.kind == vtk::EntryKind::dimensions || entry.kind == vtk::EntryKind::extent)
      losses.push_back(vtk::lower_case(vtk::keyword(entry.kind)) + ' ' + entry.type + " (" +
                       dataset + ")");
    if (says_more_than_ranges(entry.metadata))
      losses.push_back(entry.name.empty() ? std::string("metadata of points")
                                          : "metadata of array" + quoted(name));
    if (entry.origin == vtk::Origin::array) {
      if (vtk::is_attribute(entry.kind) && roles.insert(entry.kind).second)  // VTK takes the first
        losses.push_back("attribute " + std::string(vtk::keyword(entry.kind)) + " of array" +
                         quoted(name));
      if (vtk::form_of_word(entry.type) == vtk::ValueForm::bit)
        losses.push_back("bits of array" + quoted(name) + " (numbers 0 and 1 there)");
    }
    if (entry.origin != vtk::Origin::extra || told.contains(vtk::data_key(entry.index))) continue;
    if (entry.kind >= vtk::EntryKind::x_coordinates && entry.kind <= vtk::EntryKind::z_coordinates)
      continue;  // of the points
    const bool table = entry.kind == vtk::EntryKind::lookup_table;
    losses.push_back((table ? "lookup table" : "field data") + quoted(name));
  }
}

void add_vtu_attributes(const vtu::Node& data, const MeshInfo& info, Location location,
                        LossList& losses) {
  for (const auto& [key, name] : data.attributes) {
    const std::string_view value = name;
    const auto is_named = [&](const ArrayInfo& array) {
      return array.location == location && array.name == value;
    };
    if (std::any_of(info.schema.arrays.begin(), info.schema.arrays.end(), is_named))
      losses.push_back("attribute " + key + " of array" + quoted(name));
  }
}

void add_vtu_data(const MeshInfo& info, const std::set<std::string>& told, LossList& losses) {
  auto contents = vtu::Contents::of(info);
  if (!contents) return;
  Told already;
  if (vtu::Node* points = contents->points(); points != nullptr && vtu::has_metadata(*points))
    losses.push_back("metadata of points");
  for (vtu::Node* array : contents->field_arrays()) {
    const auto word = vtu::values_word(*array);
    if (word && word->kind == vtu::ValuesWord::Kind::extra &&
        told.contains(vtu::data_key(word->index)))
      continue;
    add_once(losses, already, "field data" + quoted(array->attribute_or("Name", "")));
  }
  for (const Location location : {Location::point, Location::cell}) {
    if (const vtu::Node* first = contents->first_data(location))
      add_vtu_attributes(*first, info, location, losses);
    for (vtu::Node* data : contents->data(location))
      for (std::size_t i = 0; data != nullptr && i < data->children.size(); ++i) {
        vtu::Node& array = data->children[i];
        if (!array.is_array()) continue;
        const std::string label = "array" + quoted(array.attribute_or("Name", ""));
        const auto word = vtu::values_word(array);
        if (!word || word->kind != vtu::ValuesWord::Kind::array) {
          add_once(losses, already, label);
          continue;
        }
        if (vtu::has_metadata(array)) add_once(losses, already, "metadata of " + label);
        if (array.attribute_or("type", "") == "Bit")
          add_once(losses, already, "bits of " + label + " (numbers 0 and 1 there)");
      }
  }
  for (std::string& loss : contents->markup()) losses.push_back(std::move(loss));
  if (find_extra(info, "vtu/polyhedron/points") != nullptr)
    losses.push_back("order of points of polyhedra");
}

// Extras that sections, tags or the skeleton speak for; any other one is told by its key.
bool is_spoken_for(const std::string& format, const std::string& key) {
  std::vector<std::string_view> starts;
  if (format == "gmsh")
    starts = {"gmsh/mesh_format", "gmsh/byte_order", "gmsh/sections",
              "gmsh/section/",    "gmsh/nodes/",     "gmsh/elements/"};
  if (format == "vtk")
    starts = {"vtk/skeleton",    "vtk/cell_types", "vtk/data/",
              "vtk/polyhedron/", "vtk/strings/",   vtk::kNewNumbering};
  if (format == "vtu")
    starts = {"vtu/skeleton", "vtk/cell_types",  "vtk/polyhedron/", "vtk/strings/",
              "vtu/data/",    "vtu/polyhedron/", vtk::kNewNumbering};
  return std::any_of(starts.begin(), starts.end(),
                     [&](std::string_view start) { return key.starts_with(start); });
}

}  // namespace

LossList losses_of_extras(const MeshInfo& info, const std::set<std::string>& told) {
  LossList losses;
  const std::string& format = info.schema.source_format;
  const ExtraIndex extras(info.extras);
  Told already;
  for (const Extra& extra : info.extras) {
    if (told.contains(extra.key) || extra.key == "exodus/skeleton") continue;
    if (format == "exodus" && extra.key.starts_with(kExodusVariable) && says_nothing(extra))
      continue;
    if (format == "exodus" && extra.key.starts_with("exodus/"))
      add_once(losses, already, exodus_words(extras, extra.key));
    else if (!is_spoken_for(format, extra.key))
      losses.push_back("extra" + quoted(extra.key));
  }
  if (format == "gmsh") {
    add_gmsh_sections(info, extras, told, losses);
    add_gmsh_tags(info, losses);
  }
  if (format == "vtk") add_vtk_data(info, told, losses);
  if (format == "vtu") add_vtu_data(info, told, losses);
  return losses;
}

}  // namespace shm::converters
