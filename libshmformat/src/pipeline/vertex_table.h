// VertexTable: the vertices that the caller may still use, and those that cells in the delay buffer
// still use. Each vertex has an entry: its number, its values, and its uses. The entry is reused
// after the last use of its vertex.
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

  /// Adds a vertex and returns its entry. find() does not find the vertex. `xyz` and `data` have
  /// the sizes that the schema requires.
  std::uint32_t add(std::uint64_t number, const std::byte* xyz, const std::byte* data);
  /// Adds a vertex and returns its entry, which find() returns until the vertex ends. Returns kNone
  /// if there is a vertex with this number.
  std::uint32_t add_named(std::uint64_t number, const std::byte* xyz, const std::byte* data);
  /// Returns the entry of a vertex added by add_named(), or kNone if there is none with this
  /// number.
  std::uint32_t find(std::uint64_t number) const { return by_number_.find(number); }

  std::uint64_t number(std::uint32_t entry) const { return entries_[entry].number; }
  /// Returns the coordinates, followed by the point data. Valid until the next vertex is added.
  const std::byte* values(std::uint32_t entry) const {
    return values_.data() + entry * value_bytes_;
  }

  // --- uses by the cells that are added

  struct Uses {
    std::uint64_t introduced = 0;   ///< number of vertices that no earlier cell has used
    bool first_in_segment = false;  ///< true: a vertex has not been passed to the segment yet
  };
  /// Marks the vertices of a cell as used. The cell is added while `segment` is the current one.
  Uses use(std::span<const std::uint32_t> entries, std::uint32_t segment);
  /// Marks the vertices at the nodes in `last_use`, a bit mask, as ended: only waiting cells still
  /// use them. The caller may use their numbers again. Returns the number of vertices that had not
  /// ended before.
  std::uint64_t end(std::span<const std::uint32_t> entries, std::uint64_t last_use);
  /// Marks a vertex as used by a segment before the part that is encoded.
  void mark_imported(std::uint32_t entry) {
    in_segment_[entry] = 0;  // passed to an earlier segment; it does not matter to which
    entries_[entry].used = true;
  }

  // --- uses by the cells in the delay buffer

  void begin_waiting(std::span<const std::uint32_t> entries) {
    for (const std::uint32_t e : entries) ++entries_[e].waiting;
  }
  void end_waiting(std::span<const std::uint32_t> entries) {
    for (const std::uint32_t e : entries) --entries_[e].waiting;
  }

  // --- into the current segment, in coding order

  bool is_in_segment(std::uint32_t entry, std::uint32_t segment) const {
    return in_segment_[entry] == segment;
  }
  /// Returns the vertex as an element of a piece of `segment`. The vertex must not be in the
  /// segment yet. Until set_ticket(), an own vertex has no ticket.
  SegmentPiece::Vertex put_into_segment(std::uint32_t entry, std::uint32_t segment);
  void set_ticket(std::uint32_t entry, std::uint32_t ticket) { entries_[entry].ticket = ticket; }

  /// Frees the entries of the vertices at the nodes in `may_end`, a bit mask, that later cells do
  /// not use. Calls `freed` with the ticket of each of these vertices. Returns all nodes of the
  /// cell at which these vertices occur, as a bit mask.
  template <class Freed>
  std::uint64_t free_ended(std::span<const std::uint32_t> entries, std::uint64_t may_end,
                           Freed&& freed);
  /// Frees the entry of a vertex that was added by add_named() and that no cell uses.
  void free_unused(std::uint32_t entry);
  /// Returns the vertices added by add_named() that no cell has used, in ascending order of their
  /// numbers.
  std::vector<std::uint32_t> unused() const;

 private:
  struct Entry {
    std::uint64_t number = 0;
    std::uint32_t ticket = kNone;
    std::uint32_t waiting : 30 = 0;  // number of uses by cells in the delay buffer
    bool used : 1 = false;           // true: a cell has used the vertex
    bool ends : 1 = false;           // true: only waiting cells will still use the vertex
    bool named = false;              // true: by_number_ contains the vertex
  };

  std::uint32_t next_entry() const {
    return static_cast<std::uint32_t>(free_.empty() ? entries_.size() : free_.back());
  }

  std::size_t xyz_bytes_, value_bytes_;
  std::vector<Entry> entries_;
  /// The last segment to which each entry was passed. A separate list, because each cell reads it.
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
    push_tightly(free_, e);
  }
  return last_use;
}

}  // namespace shm
