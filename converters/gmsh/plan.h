// What an MSH file is going to be like, decided before its first byte is written: as the extras
// of a mesh from Gmsh describe, or, for any other mesh, MSH 4.1 in binary.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gmsh/scan.h"
#include "mesh/mesh_source.h"

namespace shm::converters {

// One kind of element in the file.
struct GmshElementGroup {
  std::int32_t dimension = 0, entity = 0;  // MSH 4
  std::int32_t type = 0;
  std::int32_t tag_count = 0, physical = 0, elementary = 0;  // MSH 1 and 2
};

struct GmshPlannedSection {
  enum class Kind { format, raw, between, nodes, elements, array, list, links, ghosts };
  Kind kind = Kind::raw;
  std::string name;
  std::string key;        // folder of its extras
  std::string header;     // of a view
  std::string content;    // of a raw section
  std::size_t array = 0;  // of a view
  std::uint64_t step = 0;
  std::uint32_t first_component = 0;  // the components of the array that the view shows,
  std::uint32_t components = 0;       // 0: all
  std::uint32_t padding = 0;          // zeros behind them
};

struct GmshPlan {
  int version = 41;  // 10, 20, 40 or 41
  std::string format_line = "4.1 1 8";
  GmshEncoding encoding;
  std::vector<GmshPlannedSection> sections;
  std::vector<std::array<std::int32_t, 3>> node_entities;  // dimension, tag, parametric
  std::vector<GmshElementGroup> groups;                    // the first: one for each block
  // Groups of cells of blocks without a fixed number of nodes, by block and nodes.
  std::map<std::pair<std::uint32_t, std::uint64_t>, std::uint32_t> sized_groups;
  std::optional<std::size_t> node_tags, node_entity, node_parameters, element_tags;  // arrays
  std::int64_t first_node_tag = 1, first_element_tag = 1;
  std::array<std::optional<std::size_t>, 64> tag_arrays;  // MSH 1 and 2

  std::uint32_t group_of(std::uint32_t block, std::uint64_t nodes) const {
    const auto sized = sized_groups.find({block, nodes});
    return sized == sized_groups.end() ? block : sized->second;
  }
};

// Reads a mesh's extras by key. All of them throw corrupt when an extra is not of the form that
// the format has.
class GmshExtras {
 public:
  GmshExtras(const MeshInfo& info, std::string path);
  const Extra* find(const std::string& key) const;
  std::string text(const std::string& key) const;
  // Values of an extra that must be there: rows of `width` numbers.
  std::vector<std::int64_t> integers(const std::string& key, std::uint64_t width = 1) const;
  std::vector<double> reals(const std::string& key) const;
  [[noreturn]] void fail(const std::string& key, const char* what) const;

 private:
  const Extra& need(const std::string& key) const;
  std::map<std::string, const Extra*> by_key_;
  std::string path_;
};

// `path` is for errors. May read all cells once.
GmshPlan plan_gmsh(MeshSource& mesh, const std::string& path);
GmshPlan plan_gmsh_from_extras(const MeshInfo& info, const GmshExtras& extras);
GmshPlan plan_gmsh_anew(MeshSource& mesh, const std::string& path);
// A name as it can stand between quotes.
std::string quotable(const std::string& name);

}  // namespace shm::converters
