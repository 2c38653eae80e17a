// StepTopology: which vertices and cells each group of a mesh has, and what surrounds them, decoded
// again from the group's bitstreams whenever step values need it.
// in:    groups as they stand in the file          out: neighbourhoods, tile by tile; numbers
// keeps: the compressed topology of all groups; their elements while these take little
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "container/format.h"
#include "groups/group_decoder.h"
#include "shm/result.h"
#include "shm/schema.h"
#include "values/value_column.h"

namespace shm {

/// Vertices and cells of a group, as the columns of its static arrays see them.
struct GroupElements {
  /// Imported vertices too. `blocks` of segments but the first: 1 where a vertex is imported.
  TiledItems vertices;
  TiledItems cells;
  std::uint32_t slots = 0;  ///< above every slot that an item names
  /// As a Reader numbers them: of the vertices without the imported ones, and of the cells.
  std::vector<std::uint64_t> vertex_numbers, cell_numbers;

  std::size_t bytes() const {
    return (vertices.items.size() + cells.items.size()) * sizeof(Neighbourhood) +
           (vertices.blocks.size() + cells.blocks.size()) * sizeof(std::uint32_t) +
           (vertex_numbers.size() + cell_numbers.size()) * sizeof(std::uint64_t);
  }
};

/// What is needed of the elements of groups. Blocks of cells come with whatever there is of cells.
struct ElementNeeds {
  bool vertices = false, cells = false;  ///< their neighbourhoods
  bool vertex_numbers = false, cell_numbers = false;

  bool any() const { return vertices || cells || vertex_numbers || cell_numbers; }
  void add(const ElementNeeds& other) {
    vertices |= other.vertices;
    cells |= other.cells;
    vertex_numbers |= other.vertex_numbers;
    cell_numbers |= other.cell_numbers;
  }
  bool include(const ElementNeeds& other) const {
    return vertices >= other.vertices && cells >= other.cells &&
           vertex_numbers >= other.vertex_numbers && cell_numbers >= other.cell_numbers;
  }
};
/// The neighbourhoods that the stepped arrays of the schema need.
ElementNeeds needs_of_steps(const Schema& schema);

class StepTopology {
 public:
  /// Elements are kept while those of all groups take less than this.
  static constexpr std::size_t kMostKept = std::size_t{64} << 20;

  /// `schema` is checked and borrowed. Elements of one group that take more than `most_bytes` are
  /// over the limit. `cell_bytes`: cell_data_bytes(schema), where several share it; null: found
  /// here.
  StepTopology(const Schema& schema, std::uint64_t most_bytes, const ElementNeeds& needs,
               std::size_t most_kept = kMostKept, CellBytes cell_bytes = nullptr);

  /// Whether this stream of a group with this header is needed.
  bool uses(const container::GroupHeader& header, const container::StreamEntry& stream) const;
  /// Takes note of the next group. `streams`: the bytes of those that the header lists, in order;
  /// of those that are not needed they do not matter.
  void add_group(std::uint32_t segment, const container::GroupHeader& header,
                 std::span<const std::span<const std::byte>> streams);
  std::size_t groups() const { return groups_.size(); }
  std::uint32_t segment_of(std::size_t group) const { return groups_[group].segment; }
  /// Whether its elements come with what surrounds them: not where cells are patterns.
  bool has_neighbourhoods(std::size_t group) const;
  /// As the headers of all groups state them; imported vertices each time.
  std::uint64_t cells_in_all() const { return cells_in_all_; }
  std::uint64_t vertices_in_all() const { return vertices_in_all_; }
  /// Vertices that are active at once, at most.
  std::uint64_t most_active() const { return most_active_; }

  /// How many elements of a stepped array the group has.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Valid until the next call. Groups in order cost least.
  Result<const GroupElements*> elements(std::size_t group);

  const ElementNeeds& needs() const { return needs_; }
  std::size_t most_kept() const { return most_kept_; }
  /// Of what is kept.
  std::size_t kept_bytes() const { return keeps_ ? kept_bytes_ : 0; }
  /// Frees what goes on from group to group; the next call makes it anew.
  void release();

 private:
  struct Group {
    std::uint32_t segment = 0;
    container::GroupHeader header;  // of its streams those that are needed
    std::vector<std::byte> streams;
    bool counted = false;
    std::map<std::uint32_t, std::uint32_t> block_cells;  // once counted
  };

  Result<void> decode_next();
  Result<void> decode(const Group& group);
  void add(const MeshBlock& block);
  std::uint64_t expected_bytes() const;
  void keep();

  const Schema* schema_;
  std::uint64_t most_bytes_;
  ElementNeeds needs_;
  std::size_t most_kept_;
  CellBytes cell_bytes_;
  std::vector<Group> groups_;
  std::uint64_t cells_in_all_ = 0, vertices_in_all_ = 0, most_active_ = 0;
  std::unique_ptr<GroupDecoder> decoder_;  // of the segment of group next_ - 1, behind that
  std::size_t next_ = 0;
  GroupElements elements_;  // of group next_ - 1
  bool has_elements_ = false;

  bool keeps_ = true;  // all groups so far
  std::vector<GroupElements> kept_;
  std::size_t kept_bytes_ = 0;
};

}  // namespace shm
