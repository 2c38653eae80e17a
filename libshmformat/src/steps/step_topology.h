// StepTopology: provides the vertices and cells of each group of a mesh, with their neighbourhoods.
// The caller adds groups as stored in the file. StepTopology decodes the elements of a group again
// from its bitstreams whenever step values need them. It returns neighbourhoods tile by tile, and
// vertex and cell numbers. It stores the compressed topology of all groups, and also their decoded
// elements if these need little memory.
// spec: "Step values"
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "base/binary.h"
#include "codecs/shared/group_data.h"
#include "codecs/shared/group_decoder.h"
#include "codecs/surface/values/column_coder.h"
#include "format/format.h"
#include "shm/result.h"
#include "shm/schema.h"

namespace shm {

/// Vertices and cells of a group, in the form that the coders of static arrays use.
struct GroupElements {
  /// All vertices of the group, including imported vertices. vertices.blocks is empty in the first
  /// segment. In other segments, it contains 1 for each imported vertex and 0 for each other
  /// vertex.
  TiledItems vertices;
  TiledItems cells;
  std::uint32_t slots = 0;  ///< upper bound on the slots in `vertices` and `cells`

  /// Numbers of the vertices that are not imported, and numbers of the cells, as a Reader returns
  /// them.
  std::vector<std::uint64_t> vertex_numbers, cell_numbers;

  std::size_t bytes() const {
    return (vertices.items.size() + cells.items.size()) * sizeof(Neighbourhood) +
           (vertices.blocks.size() + cells.blocks.size()) * sizeof(std::uint32_t) +
           (vertex_numbers.size() + cell_numbers.size()) * sizeof(std::uint64_t);
  }
};

/// States which data about the elements of groups is needed. If any data of cells is needed, the
/// block of each cell is provided, too.
struct ElementNeeds {
  /// True if the neighbourhoods of vertices or of cells are needed.
  bool vertices = false, cells = false;
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
/// Returns which data about elements is needed to code the stepped arrays of the schema. `digests`:
/// true if the digests of the values are needed.
ElementNeeds needs_of_steps(const Schema& schema, bool digests);

/// Vertex numbers of a group, in few bytes: most numbers follow the previous number.
class PackedNumbers {
 public:
  void add(std::span<const std::uint64_t> numbers);
  /// Replaces the contents of `numbers` by all numbers.
  void get(std::vector<std::uint64_t>& numbers) const;
  std::size_t bytes() const { return bytes_.bytes.size(); }
  std::size_t count() const { return count_; }

 private:
  ByteWriter bytes_;
  std::size_t count_ = 0;
  std::uint64_t next_ = 0;
};

class StepTopology {
 public:
  /// Memory limit in bytes for decoded elements. If the elements of all groups need more, none are
  /// stored.
  static constexpr std::size_t kMostKept = std::size_t{64} << 20;

  /// Creates an object without groups. `schema` must have passed check_schema() and must outlive
  /// this object. Decoding a group fails with over_limit if its elements need more than
  /// `most_bytes`. `cell_bytes` is the list that cell_data_bytes(schema) returns; several objects
  /// may share it. If `cell_bytes` is null, the constructor computes the list.
  StepTopology(const Schema& schema, std::uint64_t most_bytes, const ElementNeeds& needs,
               std::size_t most_kept = kMostKept, CellBytes cell_bytes = nullptr);

  /// Returns true if this stream of a group with this header is needed.
  bool uses(const container::GroupHeader& header, const container::StreamEntry& stream) const {
    return uses(header, stream, needs_.vertex_numbers);
  }
  /// Adds the next group. `streams` contains the bytes of the streams that the header lists, in
  /// order. Streams that are not needed are ignored and may be empty.
  void add_group(std::uint32_t segment, const container::GroupHeader& header,
                 std::span<const std::span<const std::byte>> streams);
  /// Adds vertex numbers of the groups, in the order of the vertices, for vertex_numbers(). If they
  /// are added, they need not be decoded again. Call it before any function that decodes.
  void add_vertex_numbers(std::span<const std::uint64_t> numbers);
  /// Returns the numbers of the vertices of a group that are not imported. The result is valid
  /// until the next call of this function or of elements(). Precondition: the needs include them.
  Result<std::span<const std::uint64_t>> vertex_numbers(std::size_t group);
  /// Returns the header of a group. It lists only some streams.
  const container::GroupHeader& header_of(std::size_t group) const { return groups_[group].header; }

  std::size_t groups() const { return groups_.size(); }
  std::uint32_t segment_of(std::size_t group) const { return groups_[group].segment; }
  /// Returns true if the elements of the group have neighbourhoods. They have none if the cells are
  /// coded with the patterns codec.
  bool has_neighbourhoods(std::size_t group) const;
  /// Return the number of vertices and of cells in all groups, according to the group headers. A
  /// vertex is counted once for its own segment, and once more for each import.
  std::uint64_t cells_in_all() const { return cells_in_all_; }
  std::uint64_t vertices_in_all() const { return vertices_in_all_; }
  /// Returns the largest number of vertices that are active at the same time (introduced but not
  /// finalized).
  std::uint64_t most_active() const { return most_active_; }

  /// Returns the number of elements of a stepped array in the group.
  Result<std::uint64_t> count(std::uint32_t array, std::size_t group);
  /// Returns the elements of the group, which are valid until the next call. Reading groups in
  /// order is fastest.
  Result<const GroupElements*> elements(std::size_t group);

  const ElementNeeds& needs() const { return needs_; }
  std::size_t most_kept() const { return most_kept_; }
  /// Returns the number of bytes of the stored elements.
  std::size_t kept_bytes() const { return keeps_ ? kept_bytes_ : 0; }
  /// Frees the state of the decoder, which is needed only to decode the next group. The state is
  /// rebuilt if that group is requested.
  void release();

 private:
  struct Group {
    std::uint32_t segment = 0;
    container::GroupHeader header;  // header of the group; lists only the streams that are needed
    std::vector<std::byte> streams;
    PackedNumbers vertex_numbers;  // those that add_vertex_numbers() has added
    bool counted = false;
    // Number of cells of each block; empty until the cells have been counted.
    std::map<std::uint32_t, std::uint32_t> block_cells;
  };

  bool uses(const container::GroupHeader& header, const container::StreamEntry& stream,
            bool vertex_numbers) const;
  bool has_added_numbers() const { return number_bytes_ > 0; }
  bool decodes_numbers() const { return needs_.vertex_numbers && !has_added_numbers(); }
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
  // The group whose vertex numbers add_vertex_numbers() adds next, and the memory of those added.
  std::size_t next_numbered_ = 0, number_bytes_ = 0;
  bool keeps_numbers_ = true;  // false if the added numbers need more memory than the limit
  std::vector<std::uint64_t> numbers_;
  std::uint64_t cells_in_all_ = 0, vertices_in_all_ = 0, most_active_ = 0;
  // Decoder of the segment of group next_ - 1, positioned after that group.
  std::unique_ptr<GroupDecoder> decoder_;
  std::size_t next_ = 0;
  GroupElements elements_;  // elements of group next_ - 1
  bool has_elements_ = false;

  bool keeps_ = true;  // true if the elements of all groups so far are stored
  std::vector<GroupElements> kept_;
  std::size_t kept_bytes_ = 0;
};

/// Adds a group that has just been encoded, with its vertex numbers.
void add_group(const EncodedGroup& group, StepTopology& topology);

}  // namespace shm
