// VertexTable: the vertices that the caller may still use, and the vertices that cells in the delay
// buffer still use. Each vertex has an entry, which contains its number, its values and its uses.
// After the last use of the vertex, the entry is reused.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/lists.h"
#include "base/number_map.h"
#include "codecs/shared/segment_encoder.h"
#include "mesh/cell_topology.h"
#include "shm/schema.h"

namespace shm {

class VertexTable {
 public:
  explicit VertexTable(const Schema& schema);

  std::size_t xyz_bytes() const { return xyz_bytes_; }
  /// Returns the size in bytes of the coordinates and point data of a vertex.
  std::size_t value_bytes() const { return value_bytes_; }
  bool empty() const { return entries_.empty(); }

  /// Adds a vertex and returns its entry. From then on, find() also returns this entry, until end()
  /// is called for the vertex. Returns kNone if the table already contains a vertex with this
  /// number. `xyz` and `data` must have the sizes that the schema requires.
  std::uint32_t add(std::uint64_t number, const std::byte* xyz, const std::byte* data);
  /// Returns the entry of a vertex that was added by add(). Returns kNone if the table does
  /// not contain a vertex with this number.
  std::uint32_t find(std::uint64_t number) const { return by_number_.find(number); }

  std::uint64_t number(std::uint32_t entry) const { return entries_[entry].number; }
  /// Returns the coordinates of a vertex, followed by its point data. The result is valid until the
  /// next vertex is added.
  const std::byte* values(std::uint32_t entry) const {
    return values_.data() + entry * value_bytes_;
  }

  // --- uses of vertices by the cells that are added

  struct Uses {
    std::uint64_t introduced = 0;   ///< number of vertices that no earlier cell of the mesh has
                                    ///< used
    bool first_in_segment = false;  ///< true if at least one vertex has not been passed to the
                                    ///< segment yet
  };
  /// Marks the vertices of a cell as used. `segment`: the segment to which the cell is added.
  Uses use(std::span<const std::uint32_t> entries, std::uint32_t segment);
  /// Marks vertices as ended: only waiting cells still use them, and the caller may reuse their
  /// numbers for other vertices. `last_use`: bit mask of the nodes with these vertices. Returns the
  /// number of vertices that had not ended before.
  std::uint64_t end(std::span<const std::uint32_t> entries, std::uint64_t last_use);
  /// Marks one vertex as ended. Returns false if it had ended before.
  bool end(std::uint32_t entry);
  /// Marks a vertex as used by a segment before the encoded part of the mesh.
  void mark_imported(std::uint32_t entry) {
    in_segment_[entry] = 0;  // any earlier segment; it does not matter which
    entries_[entry].used = true;
  }

  // --- uses of vertices by the cells in the delay buffer

  void begin_waiting(std::span<const std::uint32_t> entries) {
    for (const std::uint32_t e : entries) ++entries_[e].waiting;
  }
  void end_waiting(std::span<const std::uint32_t> entries) {
    for (const std::uint32_t e : entries) --entries_[e].waiting;
  }

  // --- passing vertices to the current segment, in coding order

  bool is_in_segment(std::uint32_t entry, std::uint32_t segment) const {
    return in_segment_[entry] == segment;
  }
  /// Marks the vertex as passed to `segment`, and returns it as a SegmentPiece stores it.
  /// Precondition: the vertex has not been passed to the segment yet. If the segment owns the
  /// vertex, it has no ticket until set_ticket() is called.
  SegmentPiece::Vertex put_into_segment(std::uint32_t entry, std::uint32_t segment);
  void set_ticket(std::uint32_t entry, std::uint32_t ticket) { entries_[entry].ticket = ticket; }

  /// Frees the entries of those vertices of a cell that no later cell uses. `may_end`: bit mask of
  /// the nodes that are examined. Calls `freed` with the ticket of each freed vertex. Returns a bit
  /// mask of all nodes of the cell that have a freed vertex.
  template <class Freed>
  std::uint64_t free_ended(std::span<const std::uint32_t> entries, std::uint64_t may_end,
                           Freed&& freed);
  /// Does the same for the nodes from position kMaxLastUse on. Call it after free_ended(). Appends
  /// the first node of each freed vertex to `nodes`.
  template <class Freed>
  void free_other_ended(std::span<const std::uint32_t> entries, std::vector<std::uint32_t>& nodes,
                        Freed&& freed);
  /// Frees the entry of a vertex that was added by add() and that no cell has used.
  void free_unused(std::uint32_t entry);
  /// Returns the vertices that were added by add() and that no cell has used, in ascending
  /// order of their numbers.
  std::vector<std::uint32_t> unused() const;

 private:
  struct Entry {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
    std::uint32_t waiting : 30 = 0;  // number of uses by the cells in the delay buffer
    bool used : 1 = false;           // true: a cell has used the vertex
    bool ends : 1 = false;           // true if only waiting cells will still use the vertex
  };

  std::uint32_t next_entry() const {
    return static_cast<std::uint32_t>(free_.empty() ? entries_.size() : free_.back());
  }

  std::size_t xyz_bytes_, value_bytes_;
  std::vector<Entry> entries_;
  /// For each entry: the most recent segment to which the vertex was passed. This list is separate
  /// from entries_, because it is read for each cell.
  std::vector<std::uint32_t> in_segment_;
  std::vector<std::byte> values_;  // coordinates and point data of each entry
  std::vector<std::uint32_t> free_;
  NumberMap by_number_;
};

// --- implementation

inline VertexTable::Uses VertexTable::use(std::span<const std::uint32_t> entries,
                                          std::uint32_t segment) {
  Uses uses;
  for (const std::uint32_t e : entries) {
    if (in_segment_[e] == segment) continue;
    uses.first_in_segment = true;
    uses.introduced += entries_[e].used ? 0 : 1;
    entries_[e].used = true;
  }
  return uses;
}

inline SegmentPiece::Vertex VertexTable::put_into_segment(std::uint32_t e, std::uint32_t segment) {
  SegmentPiece::Vertex vertex;
  vertex.number = entries_[e].number;
  vertex.handle = e;
  vertex.ticket = entries_[e].ticket;
  vertex.imported = in_segment_[e] != kNone;
  in_segment_[e] = segment;
  return vertex;
}

template <class Freed>
std::uint64_t VertexTable::free_ended(std::span<const std::uint32_t> entries, std::uint64_t may_end,
                                      Freed&& freed) {
  const auto markable = entries.first(std::min<std::size_t>(entries.size(), kMaxLastUse));
  std::uint64_t last_use = 0;
  for (; may_end != 0; may_end &= may_end - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(may_end));
    if (i >= markable.size()) break;
    const std::uint32_t e = markable[i];
    const Entry& entry = entries_[e];
    if ((last_use >> i & 1) != 0 || !entry.ends || entry.waiting != 0) continue;
    for (std::size_t j = 0; j < markable.size(); ++j)
      if (markable[j] == e) last_use |= std::uint64_t{1} << j;
    freed(entry.ticket);
    entries_[e].ends = false;
    push_tightly(free_, e);
  }
  return last_use;
}

template <class Freed>
void VertexTable::free_other_ended(std::span<const std::uint32_t> entries,
                                   std::vector<std::uint32_t>& nodes, Freed&& freed) {
  for (std::size_t i = kMaxLastUse; i < entries.size(); ++i) {
    Entry& entry = entries_[entries[i]];
    if (!entry.ends || entry.waiting != 0) continue;
    freed(entry.ticket);
    entry.ends = false;
    push_tightly(free_, entries[i]);
    nodes.push_back(static_cast<std::uint32_t>(i));
  }
}

}  // namespace shm
