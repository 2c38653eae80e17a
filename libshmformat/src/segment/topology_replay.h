// TopologyReplay: which vertices and cells each group of a mesh has, and what surrounds them, told
// again from the group's bitstreams whenever step values need it.
// in:    groups as they stand in the file          out: neighbourhoods, tile by tile; numbers
// keeps: the compressed topology of all groups; what it tells of all of them while that is little
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
  /// As a Reader numbers them: of the vertices without the imported ones, and of the cells.
  std::vector<std::uint64_t> vertex_numbers, cell_numbers;

  std::size_t bytes() const {
    return (vertices.items.size() + cells.items.size()) * sizeof(Neighbourhood) +
           (vertices.blocks.size() + cells.blocks.size()) * sizeof(std::uint32_t) +
           (vertex_numbers.size() + cell_numbers.size()) * sizeof(std::uint64_t);
  }
};

/// What a TopologyReplay tells. Blocks of cells come with whatever there is of cells.
struct ReplayWants {
  bool vertices = false, cells = false;  ///< their neighbourhoods
  bool vertex_numbers = false, cell_numbers = false;

  bool any() const { return vertices || cells || vertex_numbers || cell_numbers; }
  void add(const ReplayWants& other) {
    vertices |= other.vertices;
    cells |= other.cells;
    vertex_numbers |= other.vertex_numbers;
    cell_numbers |= other.cell_numbers;
  }
  bool include(const ReplayWants& other) const {
    return vertices >= other.vertices && cells >= other.cells &&
           vertex_numbers >= other.vertex_numbers && cell_numbers >= other.cell_numbers;
  }
};
/// The neighbourhoods that the stepped arrays of the schema need.
ReplayWants wants_of_steps(const Schema& schema);

class TopologyReplay {
 public:
  using CellBytes = std::shared_ptr<const std::vector<std::size_t>>;  ///< by block

  /// What is told is kept while that of all groups takes less than this.
  static constexpr std::size_t kMostKept = std::size_t{64} << 20;

  /// `schema` is checked and borrowed. What is told of one group and takes more than `most_bytes`
  /// is over the limit.
  /// `cell_bytes`: cell_data_bytes(schema), where several share it; null: found here.
  TopologyReplay(const Schema& schema, std::uint64_t most_bytes, const ReplayWants& wants,
                 std::size_t most_kept = kMostKept, CellBytes cell_bytes = nullptr);
  ~TopologyReplay();

  /// Whether a group with this header is told by this stream.
  bool needs(const container::GroupHeader& header, const container::StreamEntry& stream) const;
  /// Takes note of the next group. `streams`: the bytes of those that the header lists, in order;
  /// of those that are not needed they do not matter.
  void add_group(std::uint32_t segment, const container::GroupHeader& header,
                 std::span<const std::span<const std::byte>> streams);
  std::size_t groups() const { return groups_.size(); }
  std::uint32_t segment_of(std::size_t group) const { return groups_[group].segment; }
  /// As the headers of all groups state them; imported vertices each time.
  std::uint64_t cells_in_all() const { return cells_in_all_; }
  std::uint64_t vertices_in_all() const { return vertices_in_all_; }

  /// How many elements of a stepped array the group has.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Valid until the next call. Groups in order cost least.
  Result<const GroupElements*> elements(std::size_t group);

  const ReplayWants& wants() const { return wants_; }
  std::size_t most_kept() const { return most_kept_; }
  /// Of what is kept.
  std::size_t kept_bytes() const { return keeps_ ? kept_bytes_ : 0; }
  /// Frees what goes on from group to group; the next call makes it anew.
  void rest();

 private:
  /// What says the topology of a group.
  struct Group {
    std::uint32_t segment = 0, cells = 0;
    std::uint64_t first_cell = 0, first_vertex = 0, vertices = 0;
    std::uint64_t max_active_vertices = 0, decoded_bytes = 0;
    std::optional<container::Codec> codec;  // of the hexahedra
    std::vector<std::byte> connectivity, corner_order, cell_numbers, vertex_numbers, imports;
    bool counted = false;
    std::map<std::uint32_t, std::uint32_t> block_cells;  // once counted
  };
  struct Segment;
  class Replayed;

  Result<void> replay_next();
  std::uint64_t expected_bytes() const;
  void keep();

  const Schema* schema_;
  std::uint64_t most_bytes_;
  ReplayWants wants_;
  std::size_t most_kept_;
  std::size_t vertex_bytes_ = 0;  // static ones, which say where a tile ends
  CellBytes cell_bytes_;
  std::vector<Group> groups_;
  std::uint64_t cells_in_all_ = 0, vertices_in_all_ = 0;
  std::unique_ptr<Segment> segment_;  // its coders, behind group next_ - 1
  std::size_t next_ = 0;
  GroupElements elements_;  // of group next_ - 1
  bool has_elements_ = false;

  bool keeps_ = true;  // all that was told so far
  std::vector<GroupElements> kept_;
  std::size_t kept_bytes_ = 0;
};

}  // namespace shm
