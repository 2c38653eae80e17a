// Plans the sections of an MSH file for a mesh that came from Gmsh.
#include "gmsh/plan.h"

#include <cstring>
#include <utility>

#include "base/failure.h"
#include "gmsh/groups.h"
#include "gmsh/types.h"

namespace shm::converters {

GmshExtras::GmshExtras(const MeshInfo& info, std::string path) : path_(std::move(path)) {
  for (const Extra& extra : info.extras) by_key_.emplace(extra.key, &extra);
}

void GmshExtras::fail(const std::string& key, const char* what) const {
  throw Failure(ErrorCode::corrupt, "the mesh's extra \"" + key + "\" " + what, path_);
}

const Extra* GmshExtras::find(const std::string& key) const {
  const auto found = by_key_.find(key);
  return found == by_key_.end() ? nullptr : found->second;
}

const Extra& GmshExtras::need(const std::string& key) const {
  const Extra* extra = find(key);
  if (extra == nullptr) fail(key, "is missing");
  return *extra;
}

std::string GmshExtras::text(const std::string& key) const {
  const Extra& extra = need(key);
  if (extra.type != ScalarType::uint8) fail(key, "is not text");
  return {reinterpret_cast<const char*>(extra.data.data()), extra.data.size()};
}

std::vector<std::int64_t> GmshExtras::integers(const std::string& key, std::uint64_t width) const {
  const Extra& extra = need(key);
  const std::size_t bytes = scalar_bytes(extra.type);
  if ((extra.type != ScalarType::int32 && extra.type != ScalarType::int64) ||
      extra.data.size() % (bytes * width) != 0)
    fail(key, "does not have the expected integers");
  std::vector<std::int64_t> values(extra.data.size() / bytes);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (bytes == 8) {
      std::memcpy(&values[i], extra.data.data() + i * 8, 8);
    } else {
      std::int32_t value;
      std::memcpy(&value, extra.data.data() + i * 4, 4);
      values[i] = value;
    }
  }
  return values;
}

std::vector<double> GmshExtras::reals(const std::string& key) const {
  const Extra& extra = need(key);
  if (extra.type != ScalarType::float64 || extra.data.size() % 8 != 0)
    fail(key, "does not have the expected numbers");
  std::vector<double> values(extra.data.size() / 8);
  if (!values.empty()) std::memcpy(values.data(), extra.data.data(), extra.data.size());
  return values;
}

namespace {

using Kind = GmshPlannedSection::Kind;

class PlanFromExtras {
 public:
  PlanFromExtras(const MeshInfo& info, const GmshExtras& extras) : info_(info), extras_(extras) {}

  GmshPlan make() {
    plan_format();
    find_arrays();
    plan_tags("gmsh/nodes/first_tag", plan_.node_tags, plan_.first_node_tag);
    plan_tags("gmsh/elements/first_tag", plan_.element_tags, plan_.first_element_tag);
    plan_node_entities();
    plan_groups();
    plan_sections();
    return std::move(plan_);
  }

 private:
  void plan_format() {
    const std::string key = "gmsh/mesh_format";
    plan_.format_line = extras_.text(key);
    GmshMemoryScan words(plan_.format_line, {});
    const double version = words.real();
    if (!words.good() || version < 1 || version >= 4.15) extras_.fail(key, "is not a known format");
    plan_.version = gmsh_version(version);
    if (extras_.find("gmsh/byte_order") == nullptr) return;
    plan_.encoding.binary = plan_.version >= 20;
    const bool little = extras_.text("gmsh/byte_order") == "little";
    plan_.encoding.swapped = little != (std::endian::native == std::endian::little);
  }

  void find_arrays() {
    for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a) {
      const ArrayInfo& array = info_.schema.arrays[a];
      const bool point = array.location == Location::point;
      names_.try_emplace({point, array.name}, a);
      if (array.per_step ||
          (!point && !array.blocks.empty() && !array.role.starts_with("gmsh:tag_")))
        continue;
      const bool one = array.components == 1;
      if (array.role == "gmsh:node_tag" && point && one && array.type == ScalarType::int64)
        plan_.node_tags = a;
      if (array.role == "gmsh:element_tag" && !point && one && array.type == ScalarType::int64)
        plan_.element_tags = a;
      if (array.role == "gmsh:node_entity" && point && one && array.type == ScalarType::int32)
        plan_.node_entity = a;
      if (array.role == "gmsh:node_parameters" && point && array.components == 3 &&
          array.type == ScalarType::float64)
        plan_.node_parameters = a;
      if (array.role.starts_with("gmsh:tag_") && !point && one && array.type == ScalarType::int32) {
        std::size_t slot = plan_.tag_arrays.size();
        if (TextInput::parse(std::string_view(array.role).substr(9), slot) &&
            slot < plan_.tag_arrays.size())
          plan_.tag_arrays[slot] = a;
      }
    }
  }

  void plan_tags(const std::string& key, std::optional<std::size_t>& array, std::int64_t& first) {
    if (extras_.find(key) == nullptr) return;
    const auto value = extras_.integers(key);
    if (value.size() != 1) extras_.fail(key, "is not one number");
    first = value[0];
    array.reset();
  }

  void plan_node_entities() {
    const std::string key = "gmsh/nodes/entities";
    if (extras_.find(key) == nullptr) return;
    const auto numbers = extras_.integers(key, 3);
    for (std::size_t i = 0; i < numbers.size(); i += 3) {
      if (numbers[i] < 0 || numbers[i] > 3) extras_.fail(key, "has a dimension outside 0..3");
      plan_.node_entities.push_back({static_cast<std::int32_t>(numbers[i]),
                                     static_cast<std::int32_t>(numbers[i + 1]),
                                     static_cast<std::int32_t>(numbers[i + 2])});
    }
  }

  void plan_groups() {
    const std::string key = "gmsh/elements/blocks";
    if (extras_.find(key) == nullptr && info_.schema.blocks.empty()) return;
    const bool v4 = plan_.version >= 40;
    const std::uint64_t width = v4 ? 3 : 4;
    const auto numbers = extras_.integers(key, width);
    if (numbers.size() != info_.schema.blocks.size() * width)
      extras_.fail(key, "does not have one row for each block of the mesh");
    for (std::size_t b = 0; b < info_.schema.blocks.size(); ++b) {
      const auto column = [&](std::size_t c) {
        return static_cast<std::int32_t>(numbers[b * width + c]);
      };
      GmshElementGroup group;
      group.type = column(v4 ? 2 : 0);
      if (v4) {
        group.dimension = column(0);
        group.entity = column(1);
      } else {
        group.tag_count = column(1);
        group.physical = column(2);
        group.elementary = column(3);
      }
      const GmshType type = gmsh_type(group.type);
      const BlockInfo& block = info_.schema.blocks[b];
      if (!type.known() || type.nodes != block.nodes_per_cell || type.shape != block.shape ||
          type.scheme != block.scheme || group.tag_count < 0 ||
          group.tag_count > static_cast<std::int32_t>(plan_.tag_arrays.size()))
        extras_.fail(
            key, "contains element types or tag counts that do not match the blocks of the mesh");
      plan_.groups.push_back(group);
    }
  }

  void plan_sections() {
    const std::string list = extras_.text("gmsh/sections");
    std::size_t number = 0;
    for (std::size_t position = 0; position < list.size();) {
      const std::size_t end = std::min(list.find('\n', position), list.size());
      plan_section(list.substr(position, end - position),
                   "gmsh/section/" + std::to_string(number++));
      position = end + 1;
    }
  }

  void plan_section(const std::string& line, const std::string& key) {
    const std::size_t first = line.find('\t');
    const std::size_t second = first == line.npos ? first : line.find('\t', first + 1);
    const std::size_t third = second == line.npos ? second : line.find('\t', second + 1);
    if (third == line.npos) extras_.fail("gmsh/sections", "has a line of another form");
    GmshPlannedSection section;
    section.name = line.substr(0, first);
    section.key = key;
    const std::string kind = line.substr(first + 1, second - first - 1);
    static const std::map<std::string, Kind> kinds = {
        {"format", Kind::format},     {"raw", Kind::raw},     {"between", Kind::between},
        {"nodes", Kind::nodes},       {"array", Kind::array}, {"list", Kind::list},
        {"elements", Kind::elements}, {"links", Kind::links}, {"ghosts", Kind::ghosts},
        {"names", Kind::raw}};
    const auto found = kinds.find(kind);
    if (found == kinds.end()) extras_.fail("gmsh/sections", "contains an unknown kind of section");
    section.kind = found->second;
    if (kind == "names" && std::exchange(have_names_, true))
      extras_.fail("gmsh/sections", "contains more than one section of kind 'names'");
    if (kind == "names")
      section.content = gmsh_names_of_sets(info_);
    else if (section.kind == Kind::raw || section.kind == Kind::between)
      section.content = extras_.text(key);
    if (section.kind == Kind::array || section.kind == Kind::list)
      section.header = extras_.text(key + "/header");
    if (section.kind == Kind::array) {
      const std::string name = line.substr(third + 1);
      const auto array = names_.find({section.name == "NodeData", name});
      if (array == names_.end() ||
          !TextInput::parse(std::string_view(line).substr(second + 1, third - second - 1),
                            section.step))
        extras_.fail("gmsh/sections", "names an array that does not exist");
      section.array = array->second;
      const std::uint64_t steps =
          info_.schema.arrays[section.array].per_step ? info_.step_times.size() : 1;
      if (section.step >= steps) extras_.fail("gmsh/sections", "names a step that does not exist");
    }
    plan_.sections.push_back(std::move(section));
  }

  const MeshInfo& info_;
  const GmshExtras& extras_;
  GmshPlan plan_;
  bool have_names_ = false;
  std::map<std::pair<bool, std::string>, std::size_t> names_;  // arrays by (of points, name)
};

}  // namespace

GmshPlan plan_gmsh_from_extras(const MeshInfo& info, const GmshExtras& extras) {
  return PlanFromExtras(info, extras).make();
}

GmshPlan plan_gmsh(MeshSource& mesh, const std::string& path) {
  const GmshExtras extras(mesh.info(), path);
  if (mesh.info().schema.source_format == "gmsh" && extras.find("gmsh/sections") != nullptr)
    return plan_gmsh_from_extras(mesh.info(), extras);
  return plan_gmsh_anew(mesh, path);
}

}  // namespace shm::converters
