// Defines the Format of Exodus files, and functions that interpret the extras of meshes that came
// from Exodus files.
#include <algorithm>
#include <string_view>

#include "exodus/appended_extras.h"
#include "exodus/exodus.h"
#include "exodus/foreign.h"
#include "exodus/layout.h"
#include "exodus/netcdf.h"
#include "exodus/skeleton.h"
#include "interface/format.h"
#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"
#include "sets/set_folders.h"

namespace shm::converters {
namespace exodus {
namespace {

constexpr std::string_view kVariable = "exodus/variable/";
constexpr const char* kSkeleton = "exodus/skeleton";

// Returns a description of the set to which a key such as "exodus/edge_set/0/edges" belongs. The
// description contains the kind, id and name of the set. Returns an empty string if the key does
// not belong to a set.
std::string set_of_key(const ExtraIndex& extras, const std::string& key) {
  const auto set = set_folder_of(key);
  if (!set) return {};
  const std::string folder =
      key.substr(0, set->format.size() + set->kind.size() + set->number.size() + 3);
  std::string kind(set->kind);
  std::replace(kind.begin(), kind.end(), '_', ' ');
  const Extra* id = extras.find(folder + "id");
  const Extra* name = extras.find(folder + "name");
  const auto number = id == nullptr ? std::vector<std::int64_t>() : integers_of_extra(*id);
  if (!number.empty()) kind += ' ' + std::to_string(number[0]);
  if (name != nullptr && !name->data.empty()) kind += quoted(text_of_extra(*name));
  return kind;
}

// Returns true if a variable has the same values in almost every file, so that its loss need not be
// reported. Such variables are tables of empty names, the coordinate names x, y, z, and status
// flags.
bool is_usual(const Extra& variable) {
  const std::string name = variable.key.substr(kVariable.size());
  if (name.ends_with("_status")) return true;
  std::string text = text_of_extra(variable);
  std::erase_if(text, [](char c) { return c == '\0' || c == ' '; });
  if (name.ends_with("_names") && text.empty()) return true;
  if (name != "coor_names") return false;
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return std::string_view("xyz").starts_with(text);
}

std::string label_of_key(const ExtraIndex& extras, const std::string& key) {
  if (!key.starts_with(kVariable)) return set_of_key(extras, key);
  const std::string name = key.substr(kVariable.size());
  if (name == "qa_records") return "QA records";
  if (name == "info_records") return "information records";
  if (name == "name_glo_var" || name == "vals_glo_var") return "global variables";
  if (name == "coor_names") return "names of coordinates";
  return "netCDF variable" + quoted(name);
}

class ExodusSource final : public SourceFormat {
 public:
  std::string title(const MeshInfo& info, Keys&) const override {
    const Extra* extra = find_extra(info, kSkeleton);
    if (extra == nullptr) return {};
    const std::string skeleton = text_of_extra(*extra);
    const std::size_t variables = skeleton.find("\nV\t"), title = skeleton.find("\nA\ttitle\t");
    if (title == std::string::npos || title > variables) return {};
    const std::size_t end = skeleton.find('\n', title + 1);
    const std::string line = skeleton.substr(title + 1, end - title - 1);
    return unescaped(std::string_view(line).substr(line.rfind('\t') + 1)).value_or("");
  }

  // HEX9, TETRA14 and elements with yet other numbers of nodes have an order of their own.
  std::vector<std::size_t> blocks_with_own_nodes(MeshSource& mesh) const override {
    std::vector<std::size_t> found;
    const std::vector<BlockInfo>& blocks = mesh.info().schema.blocks;
    for (std::size_t b = 0; b < blocks.size(); ++b)
      if (!has_element_type(blocks[b])) found.push_back(b);
    return found;
  }

  bool is_flat(const MeshInfo& info) const override {
    const Extra* skeleton = find_extra(info, kSkeleton);
    return skeleton != nullptr &&
           text_of_extra(*skeleton).find("\nD\tnum_dim\t2\n") != std::string::npos;
  }

  // Returns true if a side set is stored as plain variables, because some of its members are not
  // elements of the mesh.
  bool needs_corner_order(const MeshInfo& info) const override {
    return std::any_of(info.extras.begin(), info.extras.end(), [](const Extra& extra) {
      return extra.key.starts_with("exodus/variable/side_ss");
    });
  }

  LossList losses(const MeshInfo& info, const Keys& used) const override {
    LossList losses;
    LossCollector of_variables(&losses);  // reports a set only once, although it has several extras
    const ExtraIndex extras(info.extras);
    for (const Extra& extra : info.extras) {
      if (used.contains(extra.key) || extra.key == kSkeleton) continue;
      if (extra.key.starts_with(kVariable) && is_usual(extra)) continue;
      if (extra.key.starts_with("exodus/") || set_folder_of(extra.key))
        of_variables.add(label_of_key(extras, extra.key));
      else
        losses.push_back("extra" + quoted(extra.key));
    }
    return losses;
  }

  std::optional<std::vector<Extra>> extras_of_steps(const MeshInfo& info,
                                                    StepRange steps) const override {
    return exodus::extras_of_steps(info, steps);
  }
  bool counts_steps(const MeshInfo& info) const override { return exodus::counts_steps(info); }
  std::optional<AppendedExtras> joined_extras(const MeshInfo& old, const MeshInfo& more,
                                              const std::vector<Extra>& extras,
                                              std::span<const std::uint64_t> steps) const override {
    return exodus::joined_extras(old, more, extras, steps);
  }
  AppendedExtras lengthened_extras(const MeshInfo& old, std::uint64_t steps) const override {
    return exodus::lengthened_extras(old, steps);
  }
};

bool is_short_enough(const std::string& name) {
  constexpr std::size_t kSuffix = 4;  // length of the suffix of a component
  return name.size() + kSuffix <= kLongestName;
}

constexpr ExodusSource kSource;
constexpr Role kRoles[] = {
    {.name = kExodusMaps.vertices_role, .is_number_map = true},
    {.name = kExodusMaps.cells_role, .is_number_map = true},
    // Roles of arrays that contain the numbers of the edges and faces of elements.
    {.name = "exodus:edgconn", .is_numbered = true, .is_by_place = true},
    {.name = "exodus:facconn", .is_numbered = true, .is_by_place = true}};

}  // namespace
}  // namespace exodus

constinit const Format kExodusFormat = {
    .name = "exodus",
    .title = "Exodus",
    .extensions = {".e", ".exo", ".g", ".ex2", ".gen", ".exii"},
    .looks_like = looks_like_exodus,
    .open = open_exodus,
    .write = [](MeshSource& mesh, const std::string& path, Spool&) { write_exodus(mesh, path); },
    .capabilities = {.sets = Capabilities::Sets::sets,
                     .every_step = true,
                     .vectors = false,
                     .integers = false,
                     .partial_arrays = true,
                     .block_numbers = true,
                     .positive_numbers = true,
                     .unique_numbers = true,
                     .beside_mesh = Capabilities::BesideMesh::global_and_sets,
                     .most_numbers = exodus::most_numbers,
                     .title_bytes = 80,
                     .maps = &kExodusMaps,
                     .block = exodus::has_element_type,
                     .name = exodus::is_short_enough},
    .roles = exodus::kRoles,
    .source = &exodus::kSource,
    .translate_old_extras = exodus::translate_old_extras,
    // Temporary files of this format need a name. An unnamed file could be opened only through a
    // link in /proc, but HDF5 resolves the link, and the path to which it points does not exist.
    .temporary = FileSink::Temporary::named,
    .load = [] { exodus::netcdf(); }};

}  // namespace shm::converters
