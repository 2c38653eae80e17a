// The Format of VTK XML files: functions that recognize, open and write VTU files, a list of the
// features that VTU supports, and functions that list the data that a conversion from VTU loses.
#include <algorithm>
#include <optional>
#include <string_view>

#include "mesh/mesh_source.h"
#include "vtk/between/family.h"
#include "vtk/between/family_source.h"
#include "vtk/between/field_data.h"
#include "vtk/between/vtu_from_vtk.h"
#include "vtk/between/xml_contents.h"
#include "vtk/words.h"
#include "vtk/xml/vtu.h"

namespace shm::converters {
namespace vtu {
namespace {

void add_attributes(const Node& data, const MeshInfo& info, Location location, LossList& losses) {
  for (const auto& [key, name] : data.attributes) {
    const std::string_view value = name;
    const auto is_named = [&](const ArrayInfo& array) {
      return array.location == location && array.name == value;
    };
    if (std::any_of(info.schema.arrays.begin(), info.schema.arrays.end(), is_named))
      losses.push_back("attribute " + key + " of " + vtk::quoted_array(name));
  }
}

void add_array(Node& array, LossCollector& losses) {
  const std::string label = vtk::quoted_array(array.attribute_or("Name", ""));
  const auto word = values_word(array);
  if (!word || word->kind != ValuesWord::Kind::array) return losses.add(label);
  if (has_metadata(array)) losses.add("metadata of " + label);
  if (array.attribute_or("type", "") == "Bit")
    losses.add("type bit of " + label + " (written as numbers 0 and 1)");
}

void add_losses_of_contents(Contents& contents, const MeshInfo& info, const Keys& used,
                            LossList& losses) {
  LossCollector once(&losses);
  if (Node* points = contents.points(); points != nullptr && has_metadata(*points))
    losses.push_back("metadata of points");
  for (Node* array : contents.field_arrays()) {
    const auto word = values_word(*array);
    if (word && word->kind == ValuesWord::Kind::extra && used.contains(data_key(word->index)))
      continue;
    once.add("field data" + quoted(array->attribute_or("Name", "")));
  }
  for (const Location location : {Location::point, Location::cell}) {
    if (const Node* first = contents.first_data(location))
      add_attributes(*first, info, location, losses);
    for (Node* data : contents.data(location))
      for (std::size_t i = 0; data != nullptr && i < data->children.size(); ++i)
        if (data->children[i].is_array()) add_array(data->children[i], once);
  }
  for (std::string& loss : contents.markup()) losses.push_back(std::move(loss));
}

class XmlSource final : public vtk::FamilySource {
 public:
  std::string title(const MeshInfo& info, Keys& used) const override {
    for (const vtk::FieldArray& array : vtk::field_arrays(info)) {
      if (array.name != vtk::kXmlTitle) continue;
      std::vector<std::string> strings = vtk::strings_of(array);
      if (strings.size() != 1) continue;
      used.insert(array.values->key);
      return std::move(strings.front());
    }
    return {};
  }

  bool describes_steps(const MeshInfo& info) const override {
    auto contents = Contents::of(info);
    return contents && contents->times().size() == info.step_times.size();
  }

  std::optional<std::size_t> points_of_step(const MeshInfo& info,
                                            std::uint64_t step) const override {
    return vtu::points_of_step(info, step);
  }

  std::vector<std::size_t> blocks_with_own_nodes(MeshSource& mesh) const override {
    return vtk::blocks_with_own_nodes(mesh);
  }

  LossList losses(const MeshInfo& info, const Keys& used) const override {
    constexpr std::string_view kKnown[] = {"vtu/skeleton",    "vtk/cell_types", "vtk/polyhedron/",
                                           "vtk/strings/",    "vtu/data/",      "vtu/polyhedron/",
                                           vtk::kNewNumbering};
    LossList losses = losses_by_key(info, used, kKnown);
    if (auto contents = Contents::of(info)) {
      add_losses_of_contents(*contents, info, used, losses);
      if (find_extra(info, "vtu/polyhedron/points") != nullptr)
        losses.push_back("order of points of polyhedra");
    }
    return losses;
  }

 private:
  std::string skeleton_without_ranges(const MeshInfo& info) const override {
    auto contents = Contents::of(info);
    return contents ? contents->without_ranges() : std::string();
  }
};

constexpr XmlSource kSource;

}  // namespace
}  // namespace vtu

constinit const Format kVtuFormat = {
    .name = "vtu",
    .title = "VTU",
    .extensions = {".vtu"},
    .looks_like = looks_like_vtu,
    .open = open_vtu,
    .write = write_vtu,
    .capabilities = {.sets = Capabilities::Sets::arrays,
                     .blocks_by_type = true,
                     .beside_mesh = Capabilities::BesideMesh::global,
                     .block = vtk::has_cell_type,
                     .sibling = "vtk",
                     .losses_of_sibling = vtu::losses_in_vtu},
    .source = &vtu::kSource};

}  // namespace shm::converters
