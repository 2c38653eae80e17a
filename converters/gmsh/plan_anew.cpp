// Plans the sections of an MSH file for a mesh that did not come from Gmsh. The file is binary MSH
// 4.1. Each block becomes an entity, and also a physical group if blocks have names. Each array
// becomes a view.
#include <algorithm>
#include <charconv>
#include <limits>
#include <set>
#include <tuple>

#include "base/failure.h"
#include "gmsh/gmsh.h"
#include "gmsh/plan.h"
#include "gmsh/types.h"
#include "mesh/mesh_source.h"

namespace shm::converters {
namespace {

using Kind = GmshPlannedSection::Kind;

constexpr std::size_t kPiece = 16384;  // number of vertices or cells that are read at a time

template <class T>
void put(std::string& out, T value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

class PlanAnew {
 public:
  PlanAnew(MeshSource& mesh, const std::string& path)
      : mesh_(mesh), info_(mesh.info()), path_(path) {}

  GmshPlan make() {
    plan_.encoding.binary = true;
    plan_blocks();
    plan_nodes();
    add_section("MeshFormat", Kind::format);
    add_title();
    add_names();
    add_section("Entities", Kind::raw).content = entities();
    add_section("Nodes", Kind::nodes);
    add_section("Elements", Kind::elements);
    for (std::size_t a = 0; a < info_.schema.arrays.size(); ++a) add_views(a);
    return std::move(plan_);
  }

 private:
  GmshPlannedSection& add_section(const char* name, Kind kind) {
    GmshPlannedSection& section = plan_.sections.emplace_back();
    section.name = name;
    section.kind = kind;
    return section;
  }

  void add_title() {
    const Extra* title = find_extra(info_, "mesh/title");
    if (title == nullptr) return;
    std::string text = text_of_extra(*title);
    for (char& c : text)
      if (c == '$' || c == '\0') c = ' ';
    add_section("Comments", Kind::raw).content = text + '\n';
  }

  void plan_blocks() {
    const auto& blocks = info_.schema.blocks;
    plan_.groups.resize(blocks.size());
    bool sizes_vary = false;
    for (std::uint32_t b = 0; b < blocks.size(); ++b) {
      named_ |= !blocks[b].name.empty();
      if (info_.block_cells[b] == 0) continue;
      if (blocks[b].nodes_per_cell == 0)
        sizes_vary = true;
      else
        plan_.groups[b] = group_for(b, blocks[b].nodes_per_cell);
    }
    if (sizes_vary) plan_sized_groups();
  }

  void plan_sized_groups() {
    CellBatch batch;
    mesh_.rewind_cells();
    while (mesh_.next_cells(batch, kPiece)) {
      for (std::size_t i = 0; i < batch.size(); ++i) {
        const std::uint32_t b = batch.blocks[i];
        const auto nodes = static_cast<std::uint32_t>(batch.cell(i).size());
        if (info_.schema.blocks[b].nodes_per_cell != 0 || plan_.sized_groups.contains({b, nodes}))
          continue;
        plan_.sized_groups[{b, nodes}] = static_cast<std::uint32_t>(plan_.groups.size());
        plan_.groups.push_back(group_for(b, nodes));
      }
    }
  }

  GmshElementGroup group_for(std::uint32_t b, std::uint32_t nodes) {
    BlockInfo block = info_.schema.blocks[b];
    block.nodes_per_cell = nodes;
    GmshElementGroup group;
    group.type = gmsh_type_for(block);
    if (group.type == 0)
      throw Failure(Error{.code = ErrorCode::unsupported,
                          .detail = "Gmsh has no element for a cell of shape " +
                                    kind_of_cells(block) + " with " + std::to_string(nodes) +
                                    " nodes",
                          .section = "block " + std::to_string(block.id),
                          .file = path_});
    group.dimension = gmsh_type(group.type).dimension;
    group.entity = entity_for(group.dimension, b);
    return group;
  }

  // Returns the number of the entity of block `b`. This is the id of the block if the id is in
  // range and unused, otherwise the highest used number plus 1. Blocks with the same dimension, id
  // and name share an entity, because they differ only in their cell type.
  std::int32_t entity_for(std::int32_t dimension, std::uint32_t b) {
    auto& entities = entities_[static_cast<std::size_t>(dimension)];
    const auto& [id, name] = std::tie(info_.schema.blocks[b].id, info_.schema.blocks[b].name);
    const auto [known, fresh] = entity_of_.try_emplace({dimension, id, name}, 0);
    if (!fresh) return known->second;
    std::int32_t entity = static_cast<std::int32_t>(std::clamp<std::int64_t>(id, 0, kLastEntity));
    if (id < 1 || id > kLastEntity || entities.contains(entity))
      entity = entities.empty() ? 1 : entities.rbegin()->first + 1;
    entities.emplace(entity, b);
    return known->second = entity;
  }

  void plan_nodes() {
    std::size_t dimension = 3;
    while (dimension > 0 && entities_[dimension].empty()) --dimension;
    auto& entities = entities_[dimension];
    if (entities.empty()) entities.emplace(1, kNoBlock);
    plan_.node_entities = {{static_cast<std::int32_t>(dimension), entities.begin()->first, 0}};
  }

  void add_names() {
    if (!named_) return;
    std::string list;
    std::size_t count = 0;
    for (std::size_t dimension = 0; dimension < 4; ++dimension) {
      for (const auto& [entity, block] : entities_[dimension]) {
        if (block == kNoBlock || info_.schema.blocks[block].name.empty()) continue;
        list += std::to_string(dimension) + ' ' + std::to_string(entity) + " \"" +
                quotable(info_.schema.blocks[block].name) + "\"\n";
        ++count;
      }
    }
    if (count > 0)
      add_section("PhysicalNames", Kind::raw).content = std::to_string(count) + '\n' + list;
  }

  // Returns the content of $Entities. The bounding box of every entity is that of the whole mesh,
  // because exact boxes would need another pass over the mesh, and would have no benefit.
  std::string entities() {
    double low[3] = {0, 0, 0}, high[3] = {0, 0, 0};
    find_box(low, high);
    std::string out;
    for (const auto& of_dimension : entities_) put<std::uint64_t>(out, of_dimension.size());
    for (std::size_t dimension = 0; dimension < 4; ++dimension) {
      for (const auto& [entity, block] : entities_[dimension]) {
        put<std::int32_t>(out, entity);
        for (const double v : low) put(out, v);
        for (const double v : high)
          if (dimension > 0) put(out, v);
        const bool grouped = named_ && block != kNoBlock;
        put<std::uint64_t>(out, grouped ? 1 : 0);
        if (grouped) put<std::int32_t>(out, entity);
        if (dimension > 0) put<std::uint64_t>(out, 0);  // number of boundaries
      }
    }
    return out + '\n';
  }

  void find_box(double* low, double* high) {
    const bool wide = info_.schema.coordinate_type == ScalarType::float64;
    std::vector<double> doubles(3 * kPiece);
    std::vector<float> floats(wide ? 0 : 3 * kPiece);
    for (std::uint64_t first = 0; first < info_.vertices; first += kPiece) {
      const std::uint64_t count = std::min<std::uint64_t>(kPiece, info_.vertices - first);
      mesh_.read_points(first, count,
                        wide ? reinterpret_cast<std::byte*>(doubles.data())
                             : reinterpret_cast<std::byte*>(floats.data()));
      if (!wide) std::copy_n(floats.begin(), 3 * count, doubles.begin());
      for (std::size_t i = 0; i < 3 * count; ++i) {
        const bool start = first == 0 && i < 3;
        low[i % 3] = start ? doubles[i] : std::min(low[i % 3], doubles[i]);
        high[i % 3] = start ? doubles[i] : std::max(high[i % 3], doubles[i]);
      }
    }
  }

  void add_views(std::size_t a) {
    const ArrayInfo& array = info_.schema.arrays[a];
    if (!array.role.empty() || info_.array_elements(a) == 0) return;
    const std::uint32_t c = array.components;
    if (c <= 9) {
      const std::uint32_t shown = c == 1 ? 1 : c <= 3 ? 3 : 9;
      add_steps(a, array.name, 0, c, shown - c);
      return;
    }
    for (std::uint32_t i = 0; i < c; ++i)
      add_steps(a, array.name + " [" + std::to_string(i) + "]", i, 1, 0);
  }

  void add_steps(std::size_t a, const std::string& name, std::uint32_t first,
                 std::uint32_t components, std::uint32_t padding) {
    const ArrayInfo& array = info_.schema.arrays[a];
    const std::uint64_t steps = array.per_step ? info_.step_times.size() : 1;
    for (std::uint64_t step = 0; step < steps; ++step) {
      GmshPlannedSection& section =
          add_section(array.location == Location::point ? "NodeData" : "ElementData", Kind::array);
      section.array = a;
      section.step = step;
      section.first_component = first;
      section.components = components;
      section.padding = padding;
      char time[40] = "0";
      if (array.per_step)
        *std::to_chars(time, time + sizeof(time) - 1, info_.step_times[step]).ptr = '\0';
      section.header = "1\n\"" + quotable(name) + "\"\n1\n" + time + "\n3\n" +
                       std::to_string(step) + '\n' + std::to_string(components + padding) + '\n' +
                       std::to_string(info_.array_elements(a)) + '\n';
    }
  }

  static constexpr std::int64_t kLastEntity = std::numeric_limits<std::int32_t>::max() / 2;
  static constexpr std::uint32_t kNoBlock = ~std::uint32_t{0};

  MeshSource& mesh_;
  const MeshInfo& info_;
  const std::string path_;
  GmshPlan plan_;
  bool named_ = false;
  // Maps entities to blocks: entities_[dimension][number of the entity] is the index of the block.
  std::map<std::int32_t, std::uint32_t> entities_[4];

  // Maps (dimension, block id, block name) to the number of the entity.
  std::map<std::tuple<std::int32_t, std::int64_t, std::string>, std::int32_t> entity_of_;
};

}  // namespace

std::string quotable(const std::string& name) {
  std::string clean = name;
  for (char& c : clean) {
    if (c == '"') c = '\'';
    if (c == '\n' || c == '\r') c = ' ';
  }
  return clean;
}

GmshPlan plan_gmsh_anew(MeshSource& mesh, const std::string& path) {
  return PlanAnew(mesh, path).make();
}

}  // namespace shm::converters
