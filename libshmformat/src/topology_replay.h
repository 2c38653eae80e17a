// TopologyReplay: which vertices and cells each group of a mesh has, and what surrounds them, told
// again from the group's bitstreams whenever step values need it.
// in:    groups as they stand in the file          out: neighbourhoods, tile by tile
// keeps: the compressed topology of all groups; neighbourhoods of the whole mesh while they are few
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "container/format.h"
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

  std::size_t bytes() const {
    return (vertices.items.size() + cells.items.size()) * sizeof(Neighbourhood) +
           (vertices.blocks.size() + cells.blocks.size()) * sizeof(std::uint32_t);
  }
};

class TopologyReplay {
 public:
  /// `schema` is checked and borrowed. Neighbourhoods of one group that take more than `most_bytes`
  /// are over the limit.
  TopologyReplay(const Schema& schema, std::uint64_t most_bytes);
  ~TopologyReplay();

  /// Takes note of the next group. `streams`: the bytes of those that the header lists, in order.
  void add_group(std::uint32_t segment, const container::GroupHeader& header,
                 std::span<const std::span<const std::byte>> streams);
  std::size_t groups() const { return groups_.size(); }
  std::uint32_t segment_of(std::size_t group) const { return groups_[group].segment; }

  /// How many elements of a stepped array the group has.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Valid until the next call. Groups in order cost least.
  Result<const GroupElements*> elements(std::size_t group);

 private:
  /// What says the topology of a group.
  struct Group {
    std::uint32_t segment = 0, cells = 0;
    std::uint64_t vertices = 0;
    std::optional<container::Codec> codec;  // of the hexahedra
    std::vector<std::byte> connectivity, corner_order, vertex_numbers, imports;
    bool counted = false;
    std::map<std::uint32_t, std::uint32_t> block_cells;  // once counted
  };
  struct Segment;
  class Replayed;

  Result<void> replay_next();
  void keep();

  const Schema* schema_;
  std::uint64_t most_bytes_;
  bool of_vertices_ = false, of_cells_ = false;  // what stepped arrays there are of
  std::size_t vertex_bytes_ = 0;                 // static ones, which say where a tile ends
  std::vector<std::size_t> cell_bytes_;          // by block
  std::vector<Group> groups_;
  std::unique_ptr<Segment> segment_;  // its coders, behind group next_ - 1
  std::size_t next_ = 0;
  GroupElements elements_;  // of group next_ - 1
  bool has_elements_ = false;

  bool keeps_ = true;  // all neighbourhoods so far
  std::vector<GroupElements> kept_;
  std::size_t kept_bytes_ = 0;
};

}  // namespace shm
