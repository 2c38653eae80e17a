// The Format of Gmsh files: functions that recognize, open and write files, the features that the
// format supports, and the data that is lost in conversions from it.
#include <algorithm>
#include <map>
#include <set>
#include <sstream>
#include <string_view>
#include <utility>

#include "base/failure.h"
#include "base/text_input.h"
#include "gmsh/gmsh.h"
#include "gmsh/groups.h"
#include "gmsh/plan.h"
#include "interface/format.h"
#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"

namespace shm::converters {
namespace {

constexpr const char* kSections = "gmsh/sections";
constexpr const char* kBlocks = "gmsh/elements/blocks";

std::string view_name(const ExtraIndex& extras, const std::string& section) {
  const Extra* header = extras.find(section + "/header");
  std::istringstream lines(header == nullptr ? std::string() : text_of_extra(*header));
  std::string count, name;
  std::getline(lines, count);
  std::getline(lines, name);
  std::erase(name, '"');
  return quoted(name);
}

void add_sections(const MeshInfo& info, const Keys& used, LossList& losses) {
  LossCollector once(&losses);
  const ExtraIndex extras(info.extras);
  const Extra* sections = extras.find(kSections);
  std::istringstream lines(sections == nullptr ? std::string() : text_of_extra(*sections));
  std::string line;
  for (std::size_t k = 0; std::getline(lines, line); ++k) {
    std::istringstream words(line);
    std::string name, kind;
    std::getline(words, name, '\t');
    std::getline(words, kind, '\t');
    const std::string key = "gmsh/section/" + std::to_string(k);
    if (used.contains(key)) continue;
    if (kind == "list") {
      once.add("view" + view_name(extras, key) + " ($" + name + " of some)");
    } else if (name == "Entities") {
      if (gmsh_entities_have_bounds(info)) losses.push_back("boundaries of entities ($Entities)");
    } else if (name == "PhysicalNames") {
      continue;  // not a loss, because the names in this section are also the names of blocks and
                 // sets
    } else if (kind == "raw" || kind == "links" || kind == "ghosts") {
      losses.push_back("section $" + name);
    } else if (kind == "between") {
      once.add("text between sections");
    }
  }
}

void add_tags(const MeshInfo& info, LossList& losses) {
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

// Computes the extras of a mesh that is reduced to some of its time steps. The extra gmsh/sections
// has a line for every view at every step; the lines of the dropped steps are removed. The keys of
// other extras contain the line number of their section, so these keys are changed to the new line
// numbers.
class SectionsOfSteps {
 public:
  SectionsOfSteps(const MeshInfo& info, StepRange steps) : info_(info), steps_(steps) {
    for (const ArrayInfo& array : info.schema.arrays)
      if (array.per_step) stepped_.emplace(array.location == Location::point, array.name);
    const Extra* sections = find_extra(info, kSections);
    std::istringstream lines(sections == nullptr ? std::string() : text_of_extra(*sections));
    std::string line;
    for (std::size_t k = 0; std::getline(lines, line); ++k) add(k, line);
  }

  std::vector<Extra> extras() const {
    constexpr std::string_view kSection = "gmsh/section/";
    std::vector<Extra> extras;
    for (const Extra& extra : info_.extras) {
      Extra& kept =
          extras.emplace_back(extra.key == kSections ? text_extra(kSections, list_) : extra);
      if (!extra.key.starts_with(kSection)) continue;
      const std::size_t end = std::min(extra.key.find('/', kSection.size()), extra.key.size());
      const auto number = numbers_.find(extra.key.substr(kSection.size(), end - kSection.size()));
      if (number == numbers_.end())
        extras.pop_back();
      else
        kept.key = std::string(kSection) + std::to_string(number->second) + extra.key.substr(end);
    }
    return extras;
  }

 private:
  void add(std::size_t number, const std::string& line) {
    std::istringstream words(line);
    std::string name, kind, step, array;
    for (std::string* word : {&name, &kind, &step}) std::getline(words, *word, '\t');
    std::getline(words, array);
    std::string kept = line;
    std::uint64_t step_number = 0;
    if (kind == "array" && stepped_.contains({name == "NodeData", array}) &&
        TextInput::parse(step, step_number)) {
      if (step_number < steps_.first || step_number >= steps_.end) return;
      kept = name + '\t' + kind + '\t' + std::to_string(step_number - steps_.first) + '\t' + array;
    }
    numbers_.emplace(std::to_string(number), numbers_.size());
    list_ += kept + '\n';
  }

  const MeshInfo& info_;
  const StepRange steps_;
  // The arrays with time steps, as pairs: whether the array is a point array (otherwise it is a
  // cell array), and the name of the array.
  std::set<std::pair<bool, std::string>> stepped_;

  // Maps the old line number (as text) of each remaining section to its new line number.
  std::map<std::string, std::size_t> numbers_;
  std::string list_;
};

class GmshSource final : public SourceFormat {
 public:
  // Returns the physical groups as sets. Returns no sets if the extras already contain the groups
  // as element sets, which is the case unless there are too many groups. Omits each group whose
  // blocks all have the name of the group.
  std::vector<MeshSet> sets(const MeshInfo& info, Keys&) const override {
    std::vector<MeshSet> sets;
    if (std::any_of(info.extras.begin(), info.extras.end(),
                    [](const Extra& extra) { return extra.key.starts_with("mesh/element_set/"); }))
      return sets;
    for (const GmshGroup& group : gmsh_groups(info)) {
      const bool named = !group.name.empty() &&
                         std::all_of(group.blocks.begin(), group.blocks.end(), [&](auto block) {
                           return info.schema.blocks[block].name == group.name;
                         });
      if (named || group.blocks.empty()) continue;
      MeshSet set;
      set.kind = MeshSet::Kind::elements;
      set.id = group.tag;
      set.name = group.name;
      set.blocks = group.blocks;
      sets.push_back(std::move(set));
    }
    return sets;
  }

  std::vector<NamedGroup> named_groups(const MeshInfo& info) const override {
    constexpr const char* kKinds[] = {"physical point", "physical curve", "physical surface",
                                      "physical volume"};
    std::vector<NamedGroup> groups;
    for (const auto& [group, name] : gmsh_group_names(info))
      if (const auto [dimension, tag] = group; dimension >= 0 && dimension <= 3)
        groups.push_back({kKinds[dimension], std::to_string(tag), name, {}});
    return groups;
  }

  // Returns true if the mesh has a section $ElementNodeData, because this section lists values for
  // the nodes of each element in the order of these nodes in the file.
  bool needs_corner_order(const MeshInfo& info) const override {
    const Extra* sections = find_extra(info, kSections);
    return sections != nullptr &&
           text_of_extra(*sections).find("ElementNodeData") != std::string::npos;
  }

  LossList losses(const MeshInfo& info, const Keys& used) const override {
    constexpr std::string_view kKnown[] = {"gmsh/mesh_format", "gmsh/byte_order", "gmsh/sections",
                                           "gmsh/section/",    "gmsh/nodes/",     "gmsh/elements/"};
    LossList losses = losses_by_key(info, used, kKnown);
    add_sections(info, used, losses);
    add_tags(info, losses);
    return losses;
  }

  std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                    StepRange steps) const override {
    return SectionsOfSteps(info, steps).extras();
  }
  AppendedExtras lengthened_extras(const MeshInfo&, std::uint64_t) const override {
    throw Failure(Error{.code = ErrorCode::unsupported,
                        .detail =
                            "lists every view at every step; steps of SOURCE, which has another "
                            "format, cannot be added",
                        .section = "Gmsh's sections"});
  }

  bool follows_from_blocks(const Extra& extra) const override { return extra.key == kBlocks; }
};

// Returns true if a name can be written between quotes without changes.
bool can_be_quoted(const std::string& name) { return quotable(name) == name; }

constexpr GmshSource kGmshSource;
constexpr Role kGmshRoles[] = {{.name = "gmsh:node_tag", .is_number_map = true},
                               {.name = "gmsh:element_tag", .is_number_map = true},
                               {.name = "gmsh:node_entity", .is_private = true},  // rows of a table
                               {.name = "gmsh:element_node_data",
                                .is_by_place = true,
                                .is_private = true,
                                .loss = [](const std::string& array) {
                                  return "view" + quoted(array) + " ($ElementNodeData)";
                                }}};

}  // namespace

constinit const Format kGmshFormat = {
    .name = "gmsh",
    .title = "Gmsh",
    .extensions = {".msh"},
    .looks_like = looks_like_gmsh,
    .open = open_gmsh,
    .write = [](MeshSource& mesh, const std::string& path, Spool&) { write_gmsh(mesh, path); },
    .capabilities = {.sets = Capabilities::Sets::cells,
                     .every_step = true,
                     .padded_vectors = true,  // padded to 1, 3 or 9 components
                     .unique_names = true,
                     .integers = false,
                     .partial_arrays = true,
                     .block_numbers = true,
                     .positive_numbers = true,
                     .times = false,
                     .name = can_be_quoted},
    .roles = kGmshRoles,
    .source = &kGmshSource,
    .translate_old_extras = add_group_sets};

}  // namespace shm::converters
