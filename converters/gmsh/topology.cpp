// Reads the sections $Nodes and $Elements of a Gmsh file.
#include <array>

#include "gmsh/mesh.h"
#include "gmsh/types.h"

namespace shm::converters {
namespace {

// Maximum number of blocks when each combination of element type and tags becomes a block. gmsh.h
// describes the blocks of a mesh that has more combinations.
constexpr std::size_t kMaxTagBlocks = 1024;

// Maximum number of entity blocks. Real models have far fewer.
constexpr std::uint64_t kMaxEntityBlocks = 1u << 20;
constexpr std::uint64_t kMaxElementTags = 64;  // maximum number of tags of an MSH 2 element

template <class T>
const std::byte* bytes_of(const T& value) {
  return reinterpret_cast<const std::byte*>(&value);
}

class NodeReader {
 public:
  explicit NodeReader(GmshReading& reading)
      : r_(reading),
        entity_of_(reading.spool, sizeof(std::int32_t)),
        parameters_(reading.spool, sizeof(double)) {}

  void read_flat(bool parametric) {
    const std::uint64_t count = r_.scan.text_count();
    r_.input.skip_line();
    r_.input.expect_room(count, r_.scan.encoding.binary ? 28 : 7, "nodes");
    for (std::uint64_t i = 0; i < count; ++i) {
      r_.nodes.append(r_.scan.integer32());
      add_point();
      if (!parametric && r_.version != 30) continue;
      std::int32_t dimension = 0, tag = 0;
      if (r_.version == 30) {  // a 0, or the entity of the node
        tag = static_cast<std::int32_t>(r_.scan.integer32());
        if (tag != 0) dimension = static_cast<std::int32_t>(r_.scan.integer32());
      } else {
        dimension = static_cast<std::int32_t>(r_.scan.integer32());
        tag = static_cast<std::int32_t>(r_.scan.integer32());
      }
      const std::int32_t entity = entity_number(dimension, tag);
      entity_of_.append(1, bytes_of(entity));
      add_parameters(gmsh_parameters(dimension, true, false));
    }
    finish();
  }

  void read_blocks() {
    const bool v41 = r_.version >= 41;
    const std::uint64_t blocks = r_.scan.count();
    const std::uint64_t total = r_.scan.count();
    if (v41) {  // skips the lowest and highest tag, which the reader computes from the tags
      r_.scan.integer64();
      r_.scan.integer64();
    }
    if (blocks > kMaxEntityBlocks)
      r_.input.fail(ErrorCode::unsupported, "there are more than 2^20 entity blocks");
    const bool binary = r_.scan.encoding.binary;
    r_.input.expect_room(blocks, binary ? 20 : 8, "entity blocks");
    r_.input.expect_room(total, binary ? 28 : 7, "nodes");
    std::uint64_t done = 0;
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::int64_t first = r_.scan.integer32(), second = r_.scan.integer32();
      const auto parametric = static_cast<std::int32_t>(r_.scan.integer32());
      const auto dimension = static_cast<std::int32_t>(v41 ? first : second);
      const auto tag = static_cast<std::int32_t>(v41 ? second : first);
      const std::uint64_t count = r_.scan.count();
      if (dimension < 0 || dimension > 3 || parametric < 0 || parametric > 1)
        r_.input.fail(ErrorCode::corrupt,
                      "an entity block states a dimension outside 0..3, or a "
                      "parametric flag other than 0 and 1");
      if (count > total - done)
        r_.input.fail(ErrorCode::corrupt, "entity blocks hold more nodes than the section states");
      done += count;
      entities_.insert(entities_.end(), {dimension, tag, parametric});
      const std::size_t parameters = gmsh_parameters(dimension, parametric != 0, v41);
      for (std::uint64_t i = 0; v41 && i < count; ++i) r_.nodes.append(r_.scan.integer64());
      for (std::uint64_t i = 0; i < count; ++i) {
        if (!v41) r_.nodes.append(r_.scan.integer32());
        add_point();
        const auto entity = static_cast<std::int32_t>(b);
        entity_of_.append(1, bytes_of(entity));
        add_parameters(parameters);
      }
    }
    if (done != total)
      r_.input.fail(ErrorCode::corrupt, "entity blocks hold fewer nodes than the section states");
    finish();
  }

 private:
  void add_point() {
    double xyz[3];
    r_.scan.reals(xyz);
    r_.mesh->points_.append(1, reinterpret_cast<const std::byte*>(xyz));
  }
  void add_parameters(std::size_t count) {
    std::array<double, 3> uvw{};
    r_.scan.reals(std::span(uvw).first(count));
    any_parameters_ |= count > 0;
    parameters_.append(3, reinterpret_cast<const std::byte*>(uvw.data()));
  }
  std::int32_t entity_number(std::int32_t dimension, std::int32_t tag) {
    const auto next = static_cast<std::int32_t>(numbers_.size());
    const auto [entry, fresh] = numbers_.try_emplace({dimension, tag}, next);
    if (fresh) entities_.insert(entities_.end(), {dimension, tag, 1});
    return entry->second;
  }
  void finish() {
    r_.mesh->info_.vertices = r_.nodes.size();
    r_.nodes.finish();
    if (entity_of_.size() == 0 && entities_.empty()) return;
    r_.add_extra("gmsh/nodes/entities", ScalarType::int32, {entities_.size() / 3, 3},
                 entities_.data());
    if (entities_.size() > 3)
      r_.add_role_array("gmsh:node_entity", Location::point, ScalarType::int32, 1,
                        std::move(entity_of_));
    if (any_parameters_)
      r_.add_role_array("gmsh:node_parameters", Location::point, ScalarType::float64, 3,
                        std::move(parameters_));
  }

  GmshReading& r_;
  std::vector<std::int32_t> entities_;  // dimension, tag and parametric flag of each entity
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> numbers_;
  PagedArray entity_of_, parameters_;
  bool any_parameters_ = false;
};

class ElementReader {
 public:
  explicit ElementReader(GmshReading& reading)
      : r_(reading), info_(reading.mesh->info_), binary_(reading.scan.encoding.binary) {}

  // Reads the elements of MSH 1 to 3, which are one list of elements of mixed types.
  void read_flat() {
    const std::uint64_t count = r_.scan.text_count();
    r_.input.skip_line();
    r_.input.expect_room(count, binary_ ? 8 : 6, "elements");
    while (r_.elements.size() < count) {
      if (r_.version >= 20 && binary_)
        read_binary_run(count - r_.elements.size());
      else
        read_text_element();
    }
    finish_tags();
    finish();
  }

  // Reads the elements of MSH 4, which are a list of entity blocks.
  void read_blocks() {
    const bool v41 = r_.version >= 41;
    const std::uint64_t blocks = r_.scan.count();
    const std::uint64_t total = r_.scan.count();
    if (v41) {  // lowest and highest tag
      r_.scan.integer64();
      r_.scan.integer64();
    }
    if (blocks > kMaxEntityBlocks)
      r_.input.fail(ErrorCode::unsupported, "there are more than 2^20 entity blocks");
    r_.input.expect_room(blocks, binary_ ? 20 : 8, "entity blocks");
    for (std::uint64_t b = 0; b < blocks; ++b) {
      const std::int64_t first = r_.scan.integer32(), second = r_.scan.integer32();
      const std::int64_t type_number = r_.scan.integer32();
      const std::uint64_t count = r_.scan.count();
      const GmshType type = known_type(type_number);
      if (type.nodes == 0)
        r_.input.fail(ErrorCode::unsupported, "element type " + std::to_string(type_number) +
                                                  " has no fixed number of nodes");
      if (count > total - r_.elements.size())
        r_.input.fail(ErrorCode::corrupt,
                      "entity blocks hold more elements than the section states");
      const std::uint64_t numbers = 1 + std::uint64_t{type.nodes};
      r_.input.expect_room(count, binary_ ? numbers * (v41 ? 8 : 4) : 2 * numbers - 1, "elements");
      const std::uint32_t block = add_block(type, v41 ? second : first);
      for (const std::int64_t number : {v41 ? first : second, v41 ? second : first, type_number})
        r_.block_table.push_back(static_cast<std::int32_t>(number));
      for (std::uint64_t i = 0; i < count; ++i) {
        r_.elements.append(r_.scan.tag(v41));
        read_nodes(type.nodes, v41);
        add_cell(block, type);
      }
    }
    if (r_.elements.size() != total)
      r_.input.fail(ErrorCode::corrupt,
                    "entity blocks hold fewer elements than the section states");
    finish();
  }

 private:
  struct TagKey {
    std::int64_t type = 0;
    std::uint64_t tags = 0;
    std::int64_t first = 0, second = 0;
    auto operator<=>(const TagKey&) const = default;
  };

  GmshType known_type(std::int64_t number) {
    const GmshType type = gmsh_type(number);
    if (!type.known())
      r_.input.fail(ErrorCode::unsupported, "unknown element type " + std::to_string(number));
    return type;
  }

  std::uint32_t add_block(const GmshType& type, std::int64_t id) {
    info_.schema.blocks.push_back(BlockInfo{id, "", type.shape, type.nodes, type.scheme});
    info_.block_cells.push_back(0);
    return static_cast<std::uint32_t>(info_.schema.blocks.size() - 1);
  }

  // Reads the nodes of an element, in Gmsh's order, into in_file_.
  void read_nodes(std::uint64_t nodes, bool wide) {
    in_file_.resize(nodes);
    for (std::uint64_t& node : in_file_) {
      const std::int64_t tag = r_.scan.tag(wide);
      const auto place = r_.nodes.find(tag);
      if (!place)
        r_.input.fail(ErrorCode::corrupt,
                      "an element uses node " + std::to_string(tag) + ", which does not exist");
      node = *place;
    }
  }

  // Adds the element whose nodes are in in_file_.
  void add_cell(std::uint32_t block, const GmshType& type) {
    const std::size_t nodes = in_file_.size();
    const std::vector<std::uint64_t>* corners = &in_file_;
    if (!type.permutation.empty()) {
      in_order_.resize(nodes);
      for (std::size_t k = 0; k < nodes; ++k) in_order_[k] = in_file_[type.permutation[k]];
      corners = &in_order_;
    }
    r_.mesh->corners_.append(nodes, reinterpret_cast<const std::byte*>(corners->data()));
    r_.mesh->cell_blocks_.append(1, bytes_of(block));
    if (type.nodes == 0) {
      const auto size = static_cast<std::uint32_t>(nodes);
      r_.mesh->cell_sizes_.append(1, bytes_of(size));
    }
    ++info_.block_cells[block];
  }

  void check_tag_count(std::uint64_t tags) {
    if (tags > kMaxElementTags)
      r_.input.fail(ErrorCode::unsupported, "an element has " + std::to_string(tags) +
                                                " tags, more than " +
                                                std::to_string(kMaxElementTags));
  }

  void read_text_element() {
    r_.elements.append(r_.scan.integer32());
    const std::int64_t type_number = r_.scan.integer32();
    const GmshType type = known_type(type_number);
    r_.tags_are_referred_to |= gmsh_type_has_parent(type_number);
    if (r_.version == 30) return read_element_of_version_3(type_number, type);
    const std::uint64_t tags = r_.version >= 20 ? r_.scan.text_count() : 2;
    check_tag_count(tags);
    read_tags(tags);
    std::uint64_t nodes = type.nodes;
    if (r_.version < 20 || nodes == 0) nodes = r_.scan.text_count();
    if (type.nodes != 0 && nodes != type.nodes)
      r_.input.fail(ErrorCode::corrupt, "an element of type " + std::to_string(type_number) +
                                            " has " + std::to_string(nodes) + " nodes");
    r_.input.expect_room(nodes, 1, "nodes of an element");
    read_nodes(nodes, false);
    add_cell(tag_block(type_number, type), type);
  }

  // Reads the rest of an element: its entity, the number of the numbers that follow, its nodes and
  // the partitions of the element. They become the tags of an element without a physical group.
  void read_element_of_version_3(std::int64_t type_number, const GmshType& type) {
    std::vector<std::int32_t> tags{0, static_cast<std::int32_t>(r_.scan.integer32())};
    const std::uint64_t numbers = r_.scan.text_count();
    const std::uint64_t nodes = type.nodes == 0 ? numbers : type.nodes;
    if (numbers < nodes)
      r_.input.fail(ErrorCode::corrupt, "an element of type " + std::to_string(type_number) +
                                            " has " + std::to_string(numbers) + " nodes");
    check_tag_count(numbers - nodes);
    r_.input.expect_room(numbers, 1, "nodes of an element");
    read_nodes(nodes, false);
    for (std::uint64_t i = nodes; i < numbers; ++i)
      tags.push_back(static_cast<std::int32_t>(r_.scan.integer32()));
    set_tags(std::move(tags));
    add_cell(tag_block(type_number, type), type);
  }

  void read_binary_run(std::uint64_t most) {
    const std::int64_t type_number = r_.scan.integer32();
    const std::int64_t count = r_.scan.integer32();
    const std::int64_t tags = r_.scan.integer32();
    const GmshType type = known_type(type_number);
    if (type.nodes == 0)
      r_.input.fail(ErrorCode::unsupported, "elements of type " + std::to_string(type_number) +
                                                " are not understood in binary files");
    if (count < 1 || static_cast<std::uint64_t>(count) > most || tags < 0)
      r_.input.fail(ErrorCode::corrupt, "a run of elements states impossible counts");
    check_tag_count(static_cast<std::uint64_t>(tags));
    r_.tags_are_referred_to |= gmsh_type_has_parent(type_number);
    for (std::int64_t i = 0; i < count; ++i) {
      r_.elements.append(r_.scan.integer32());
      read_tags(static_cast<std::uint64_t>(tags));
      read_nodes(type.nodes, false);
      add_cell(tag_block(type_number, type), type);
    }
  }

  void read_tags(std::uint64_t count) {
    std::vector<std::int32_t> tags(count);
    for (std::int32_t& tag : tags) tag = static_cast<std::int32_t>(r_.scan.integer32());
    set_tags(std::move(tags));
  }
  void set_tags(std::vector<std::int32_t> tags) {
    tags_ = std::move(tags);
    for (std::size_t i = 0; i < tags_.size(); ++i) {
      while (slots_.size() <= i) slots_.emplace_back(r_.spool, sizeof(std::int32_t));
      slots_[i].append(1, bytes_of(tags_[i]));
    }
  }

  // Returns the block of the element whose tags are in tags_.
  std::uint32_t tag_block(std::int64_t type_number, const GmshType& type) {
    TagKey key{type_number, tags_.size(), 0, 0};
    if (!merged_ && !tags_.empty()) key.first = tags_[0];
    if (!merged_ && tags_.size() > 1) key.second = tags_[1];
    if (key == last_key_ && !keys_.empty()) return last_block_;
    const auto found = keys_.find(key);
    if (found != keys_.end()) {
      last_key_ = key;
      return last_block_ = found->second;
    }
    if (!merged_ && keys_.size() >= kMaxTagBlocks) {
      merge_blocks();
      return tag_block(type_number, type);
    }
    last_key_ = key;
    last_block_ = add_block(type, merged_ ? 0 : key.second);
    keys_.emplace(key, last_block_);
    by_block_.push_back(key);
    return last_block_;
  }

  // Replaces the blocks with one block for each element type and number of tags. Called if the
  // number of combinations of type and tags exceeds the maximum number of blocks.
  void merge_blocks() {
    const std::vector<TagKey> old = std::move(by_block_);
    const std::vector<std::uint64_t> old_cells = std::move(info_.block_cells);
    merged_ = true;
    keys_.clear();
    by_block_.clear();
    info_.schema.blocks.clear();
    info_.block_cells.clear();
    std::vector<std::uint32_t> block_of(old.size());
    for (std::size_t b = 0; b < old.size(); ++b) {
      const TagKey key{old[b].type, old[b].tags, 0, 0};
      auto found = keys_.find(key);
      if (found == keys_.end()) {
        found = keys_.emplace(key, add_block(gmsh_type(key.type), 0)).first;
        by_block_.push_back(key);
      }
      block_of[b] = found->second;
      info_.block_cells[found->second] += old_cells[b];
    }
    PagedArray& blocks = r_.mesh->cell_blocks_;
    for (std::uint64_t cell = 0; cell < blocks.size(); ++cell)
      blocks.set(cell, block_of[blocks.get<std::uint32_t>(cell)]);
    last_key_ = {};
  }

  void finish_tags() {
    for (const TagKey& key : by_block_)
      for (const std::int64_t number :
           {key.type, static_cast<std::int64_t>(key.tags), key.first, key.second})
        r_.block_table.push_back(static_cast<std::int32_t>(number));
    for (std::size_t slot = merged_ ? 0 : 2; slot < slots_.size(); ++slot) {
      std::vector<std::uint32_t> covered;
      for (std::uint32_t b = 0; b < by_block_.size(); ++b)
        if (by_block_[b].tags > slot) covered.push_back(b);
      if (covered.size() == by_block_.size()) covered.clear();
      r_.add_role_array("gmsh:tag_" + std::to_string(slot), Location::cell, ScalarType::int32, 1,
                        std::move(slots_[slot]), std::move(covered));
    }
  }

  void finish() {
    r_.elements.finish();
    r_.add_extra("gmsh/elements/blocks", ScalarType::int32,
                 {info_.schema.blocks.size(), r_.block_table_width()}, r_.block_table.data());
  }

  GmshReading& r_;
  MeshInfo& info_;
  const bool binary_;
  std::vector<std::uint64_t> in_file_, in_order_;
  // The following members are used only for MSH 1 to 3.
  std::vector<std::int32_t> tags_;  // tags of the current element
  // Tags by position: slots_[i] contains the i-th tag of each element that has more than i tags.
  std::vector<PagedArray> slots_;
  std::map<TagKey, std::uint32_t> keys_;
  std::vector<TagKey> by_block_;
  TagKey last_key_;
  std::uint32_t last_block_ = 0;
  bool merged_ = false;
};

}  // namespace

void read_gmsh_nodes(GmshReading& reading, bool parametric_section) {
  if (reading.have_nodes) reading.input.fail(ErrorCode::unsupported, "the nodes are given twice");
  NodeReader reader(reading);
  if (reading.version >= 40)
    reader.read_blocks();
  else
    reader.read_flat(parametric_section);
  reading.have_nodes = true;
}

namespace {

// Stores the tags of nodes or elements. If the tags are consecutive, stores only the first tag;
// otherwise, stores an array of all tags.
void keep_tags(GmshReading& reading, GmshTags& tags, const char* what, Location location) {
  const std::string folder = location == Location::point ? "gmsh/nodes" : "gmsh/elements";
  const auto first = tags.first_of_run();
  if (first && (!reading.tags_are_referred_to || tags.size() == 0))
    reading.add_extra(folder + "/first_tag", ScalarType::int64, {1}, &*first);
  else
    reading.add_role_array(std::string("gmsh:") + what + "_tag", location, ScalarType::int64, 1,
                           tags.take_listed());
}

}  // namespace

void keep_gmsh_tags(GmshReading& reading) {
  if (reading.have_nodes) keep_tags(reading, reading.nodes, "node", Location::point);
  if (reading.have_elements) keep_tags(reading, reading.elements, "element", Location::cell);
}

void read_gmsh_elements(GmshReading& reading) {
  if (reading.have_elements)
    reading.input.fail(ErrorCode::unsupported, "the elements are given twice");
  ElementReader reader(reading);
  if (reading.version >= 40)
    reader.read_blocks();
  else
    reader.read_flat();
  reading.have_elements = true;
}

}  // namespace shm::converters
