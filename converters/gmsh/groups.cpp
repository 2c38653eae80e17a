#include "gmsh/groups.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <utility>

#include "base/failure.h"
#include "base/text_input.h"
#include "gmsh/types.h"
#include "mesh/extra_index.h"
#include "mesh/mesh_source.h"
#include "sets/transfer_sets.h"

namespace shm::converters {

void GmshNaming::add_names(std::string_view content) {
  // Parse the section as text, because $PhysicalNames is text even in binary files.
  GmshMemoryScan scan(content, {});
  const std::uint64_t count = scan.count();
  for (std::uint64_t i = 0; i < count; ++i) {
    const std::int64_t dimension = scan.integer32(), tag = scan.integer32();
    const std::string_view rest = scan.rest_of_line();
    if (!scan.good()) return;
    const std::size_t open = rest.find('"'), close = rest.rfind('"');
    if (open < close && close != std::string_view::npos)
      names[{dimension, tag}] = rest.substr(open + 1, close - open - 1);
  }
}

void GmshNaming::add_entities(std::string_view content, bool partitioned, GmshEncoding encoding,
                              int version) {
  GmshMemoryScan scan(content, encoding);
  const bool v41 = version >= 41;
  if (partitioned) {
    scan.count(v41);
    const std::uint64_t ghosts = scan.count(v41);
    for (std::uint64_t i = 0; i < 2 * ghosts && scan.good(); ++i) scan.integer32();
  }
  std::uint64_t counts[4];
  for (std::uint64_t& count : counts) count = scan.count();
  for (std::int64_t dimension = 0; dimension < 4; ++dimension) {
    for (std::uint64_t i = 0; i < counts[dimension]; ++i) {
      const std::int64_t tag = scan.integer32();
      if (partitioned) {
        scan.integer32();
        scan.integer32();
        const std::uint64_t parts = scan.count(v41);
        for (std::uint64_t k = 0; k < parts && scan.good(); ++k) scan.integer32();
      }
      const int box = version == 30 ? 0 : dimension == 0 && version >= 41 ? 3 : 6;
      for (int k = 0; k < box; ++k) scan.real();
      std::uint64_t bounds = 0;
      const auto pass_bounds = [&] {
        bounds = dimension > 0 ? scan.count() : 0;
        for (std::uint64_t k = 0; k < bounds && scan.good(); ++k) scan.integer32();
      };
      if (version == 30) pass_bounds();
      std::vector<std::int64_t> tags;
      const std::uint64_t group_count = scan.count();
      for (std::uint64_t k = 0; k < group_count && scan.good(); ++k)
        tags.push_back(scan.integer32());
      if (version != 30) pass_bounds();
      if (!scan.good()) return;
      any_bounds |= bounds > 0;
      groups[{dimension, tag}] = std::move(tags);
    }
  }
}

namespace {

// Returns the dimension and number of the entity to which the elements of a block belong. A row of
// MSH 4 contains both, and the element type.
std::pair<std::int64_t, std::int64_t> entity_of(std::span<const std::int32_t> row) {
  if (row.size() == 3) return {row[0], row[1]};
  if (row.size() == 4 && row[1] > 1) return {gmsh_type(row[0]).dimension, row[3]};
  return {-1, 0};
}

}  // namespace

std::vector<std::pair<std::int64_t, std::int64_t>> GmshNaming::groups_of(
    std::span<const std::int32_t> row) const {
  std::vector<std::pair<std::int64_t, std::int64_t>> found;
  // In MSH 1 to 3, a row contains the element type, the number of tags, the physical tag and the
  // elementary tag. In MSH 3, the physical tag is 0.
  if (row.size() == 4 && row[1] > 0 && row[2] != 0) {
    found.emplace_back(gmsh_type(row[0]).dimension, std::abs(std::int64_t{row[2]}));
    return found;
  }
  const auto entity = groups.find(entity_of(row));
  if (entity == groups.end()) return found;
  for (const std::int64_t tag : entity->second)
    found.emplace_back(entity->first.first, std::abs(tag));
  return found;
}

std::string GmshNaming::block_name(std::span<const std::int32_t> row) const {
  // Call groups_of() only if the entity has at most one group. If an entity has very many blocks
  // and groups, calling groups_of() for each block would be slow.
  const auto entity = groups.find(entity_of(row));
  if (entity != groups.end() && entity->second.size() > 1) return {};
  const auto found = groups_of(row);
  if (found.size() != 1) return {};
  const auto name = names.find(found[0]);
  return name == names.end() ? std::string() : name->second;
}

namespace {

// Returns the rows of the extra gmsh/elements/blocks. Each block has one row, and all rows have the
// same number of values. Returns an empty list if the extra does not have this form.
std::vector<std::int32_t> block_rows(const MeshInfo& info) {
  const Extra* table = find_extra(info, "gmsh/elements/blocks");
  const std::size_t blocks = info.schema.blocks.size();
  if (table == nullptr || blocks == 0) return {};
  std::vector<std::int32_t> rows;
  for (const std::int64_t value : integers_of_extra(*table))
    rows.push_back(static_cast<std::int32_t>(value));
  if (rows.size() % blocks != 0) return {};
  return rows;
}

// Returns the groups that the extras store as element sets. All elements of a group have the same
// dimension.
std::vector<GmshGroup> groups_of_sets(const MeshInfo& info) {
  const std::vector<std::int32_t> rows = block_rows(info);
  if (rows.empty()) return {};
  const std::size_t width = rows.size() / info.schema.blocks.size();
  if (width != 3 && width != 4) return {};
  std::vector<GmshGroup> groups;
  for (MeshSet& set : sets_of_extras(info)) {
    if (set.kind != MeshSet::Kind::elements || set.blocks.empty()) continue;
    const std::int32_t first = rows[set.blocks[0] * width];
    groups.push_back({width == 3 ? first : gmsh_type(first).dimension, set.id, std::move(set.name),
                      std::move(set.blocks)});
  }
  return groups;
}

GmshNaming naming_of_extras(const MeshInfo& info) {
  GmshNaming naming;
  const ExtraIndex extras(info.extras);
  const auto text = [&](const std::string& key) {
    const Extra* extra = extras.find(key);
    return extra == nullptr ? std::string() : text_of_extra(*extra);
  };
  double number = 1;
  const std::string format = text("gmsh/mesh_format");
  TextInput::parse(std::string_view(format).substr(0, format.find(' ')), number);
  const int version = gmsh_version(number);
  GmshEncoding encoding;
  const std::string byte_order = text("gmsh/byte_order");
  encoding.binary = !byte_order.empty();
  encoding.swapped = (byte_order == "big") == (std::endian::native == std::endian::little);
  const std::string list = text("gmsh/sections");
  std::size_t number_of_section = 0;
  bool names_of_sets = false;
  for (std::size_t position = 0; position < list.size(); ++number_of_section) {
    const std::string name = list.substr(position, list.find('\t', position) - position);
    const std::string content = text("gmsh/section/" + std::to_string(number_of_section));
    if (name == "PhysicalNames" && content.empty() && !std::exchange(names_of_sets, true))
      naming.add_names_of_sets(info);
    if (name == "PhysicalNames") naming.add_names(content);
    if (name == "Entities") naming.add_entities(content, false, encoding, version);
    if (name == "PartitionedEntities") naming.add_entities(content, true, encoding, version);
    const std::size_t end = list.find('\n', position);
    position = end == std::string::npos ? list.size() : end + 1;
  }
  return naming;
}

// Maximum number of pairs of a block and a group that contains the block. The number is limited
// because an entity may have many groups and many blocks.
constexpr std::size_t kMostGroupBlocks = std::size_t{1} << 22;

}  // namespace

std::map<std::pair<std::int64_t, std::int64_t>, std::string> gmsh_group_names(
    const MeshInfo& info) {
  return naming_of_extras(info).names;
}

bool gmsh_entities_have_bounds(const MeshInfo& info) { return naming_of_extras(info).any_bounds; }

std::vector<GmshGroup> gmsh_groups(const MeshInfo& info) {
  const std::size_t blocks = info.schema.blocks.size();
  const std::vector<std::int32_t> rows = block_rows(info);
  if (rows.empty()) return {};
  const std::size_t width = rows.size() / blocks;
  const GmshNaming naming = naming_of_extras(info);
  std::map<std::pair<std::int64_t, std::int64_t>, GmshGroup> groups;
  std::size_t members = 0;
  for (std::uint32_t b = 0; b < blocks; ++b) {
    const auto found = naming.groups_of(std::span(rows).subspan(b * width, width));
    members += found.size();
    if (members > kMostGroupBlocks)
      throw Failure(Error{.code = ErrorCode::over_limit,
                          .detail = "there are more than " + std::to_string(kMostGroupBlocks) +
                                    " pairs of a block and a physical group that contains it",
                          .section = "physical groups"});
    for (const auto& key : found) {
      GmshGroup& group = groups[key];
      group.dimension = key.first;
      group.tag = key.second;
      if (const auto name = naming.names.find(key); name != naming.names.end())
        group.name = name->second;
      group.blocks.push_back(b);
    }
  }
  std::vector<GmshGroup> all;
  for (auto& [key, group] : groups) all.push_back(std::move(group));
  return all;
}

void GmshNaming::add_names_of_sets(const MeshInfo& info) {
  for (GmshGroup& group : groups_of_sets(info))
    if (!group.name.empty()) names[{group.dimension, group.tag}] = std::move(group.name);
}

std::string gmsh_names_of_sets(const MeshInfo& info) {
  std::string lines;
  std::size_t count = 0;
  for (const GmshGroup& group : groups_of_sets(info)) {
    if (group.name.empty()) continue;
    lines += std::to_string(group.dimension) + ' ' + std::to_string(group.tag) + " \"" +
             group.name + "\"\n";
    ++count;
  }
  return std::to_string(count) + '\n' + lines;
}

void add_group_sets(MeshInfo& info) {
  // Maximum number of element sets. The number is limited because each set needs several extras.
  constexpr std::size_t kMostSets = 1 << 16;
  if (std::any_of(info.extras.begin(), info.extras.end(),
                  [](const Extra& extra) { return extra.key.starts_with("mesh/element_set/"); }))
    return;
  std::vector<GmshGroup> groups;
  try {
    groups = gmsh_groups(info);
  } catch (const Failure&) {
    // There are too many pairs of blocks and groups, so no sets are added. Callers that need the
    // groups call gmsh_groups() again and receive the error.
    return;
  }
  std::vector<MeshSet> sets;
  for (GmshGroup& group : groups) {
    MeshSet& set = sets.emplace_back();
    set.kind = MeshSet::Kind::elements;
    set.id = group.tag;
    set.name = std::move(group.name);
    set.blocks = std::move(group.blocks);
  }
  if (sets.empty() || sets.size() > kMostSets) return;
  for (Extra& extra : set_extras(sets)) info.extras.push_back(std::move(extra));

  constexpr std::string_view kRaw = "PhysicalNames\traw\t", kNames = "PhysicalNames\tnames\t";
  const auto list = std::find_if(info.extras.begin(), info.extras.end(),
                                 [](const Extra& extra) { return extra.key == "gmsh/sections"; });
  if (list == info.extras.end()) return;
  std::string sections = text_of_extra(*list);
  std::size_t number = 0, position = 0;
  for (; sections.compare(position, kRaw.size(), kRaw) != 0; ++number) {
    position = sections.find('\n', position);
    if (position == std::string::npos || ++position == sections.size()) return;
  }
  const std::string key = "gmsh/section/" + std::to_string(number);
  const Extra* content = find_extra(info, key);
  if (content == nullptr || text_of_extra(*content) != gmsh_names_of_sets(info)) return;
  sections.replace(position, kRaw.size(), kNames);
  *list = text_extra("gmsh/sections", sections);
  std::erase_if(info.extras, [&](const Extra& extra) { return extra.key == key; });
}

}  // namespace shm::converters
