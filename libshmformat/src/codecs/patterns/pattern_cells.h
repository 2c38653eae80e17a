// Pattern cells: the cells of a segment that is coded as patterns. A cell refers to earlier cells
// by their distance in coding order. For each node of a cell, the pattern specifies an earlier cell
// that has the same vertex, and the node of that vertex in the earlier cell. The same patterns
// occur again and again, whatever the vertex numbers are, so a cell is stored as the index of its
// pattern in a list.
//
//   PatternCell     a cell, as passed from the cell coder to the value coders
//   PatternHistory  assigns slots to the live vertices, and counts the earlier cells to which a
//                   cell can refer (the remembered cells). A decoder also stores the vertex slots
//                   of these cells, and for each vertex the two most recent cells that
//                   used it
// spec: "Patterns"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "base/lists.h"
#include "shm/schema.h"

namespace shm {

// Largest number of nodes per cell. Frozen: part of the format.
inline constexpr std::uint32_t kMostPatternNodes = 64;
/// Largest size of the history: cells can refer only to the 2^kMostHistoryBits most recent cells,
/// and the history may contain at most kMostHistoryNodes nodes. In this count, every cell has the
/// same number of nodes: the largest number in any block. Frozen: part of the format.
inline constexpr std::uint32_t kMostHistoryBits = 20;
inline constexpr std::uint64_t kMostHistoryNodes = std::uint64_t{1} << 23;

/// Sources of a node. A source specifies the earlier cell that contains the vertex of the node.
/// Frozen: part of the format.
namespace pattern_source {
inline constexpr std::uint32_t kBefore = 0;  ///< source: the previous cell

/// Sources: the successors (in coding order) of cells that the previous cell referred to. If the
/// previous cell referred to cell n by a source other than kBefore, one of these sources refers to
/// cell n + 1. Only the first kOnCount such cells n are used.
inline constexpr std::uint32_t kOn = 1, kOnCount = 3;
/// Sources: for each of the first kUsersOf nodes of this cell, the two most recent cells that used
/// the vertex of that node. A node can refer only to the sources of earlier nodes.
inline constexpr std::uint32_t kUsers = kOn + kOnCount, kUsersOf = 7;
/// Source: an earlier cell, coded by its distance
inline constexpr std::uint32_t kFar = kUsers + 2 * kUsersOf;
/// Source: none, because the vertex is new in the segment; the flags of the vertex (namespace
/// new_vertex) are stored instead of a node
inline constexpr std::uint32_t kNew = kFar + 1;
/// Source: none, because no remembered cell contains the vertex; the slot of the vertex is coded
inline constexpr std::uint32_t kSlot = kNew + 1;
inline constexpr std::uint32_t kHere = kSlot + 1;  ///< source: an earlier node of this cell
inline constexpr std::uint32_t kCount = kHere + 1;
}  // namespace pattern_source
/// Flags of a new vertex. They are stored instead of the index of a node in an earlier cell.
namespace new_vertex {
/// Flag: the vertex number is stored, because it is not the previous vertex number plus one
inline constexpr std::uint32_t kNumbered = 1;
inline constexpr std::uint32_t kImported = 2;
inline constexpr std::uint32_t kMost = 3;
}  // namespace new_vertex

/// Returns true if cells of the schema can be coded as patterns: the schema has no delay buffer,
/// and each cell has 1 to 64 nodes.
bool takes_patterns(const Schema& schema);
/// Returns the largest number of nodes that a cell of any block has.
std::uint32_t most_nodes(const Schema& schema);

/// A cell as coded by a pattern. Each bit mask is a set of node positions; bit 0 represents the
/// first node.
struct PatternCell {
  std::uint32_t block = 0;
  std::uint64_t introduced = 0;  ///< nodes whose vertices are new in the segment
  std::uint64_t again = 0;       ///< nodes with the same vertex as an earlier node of the cell
  std::uint64_t imports = 0;     ///< subset of `introduced`: nodes whose vertices belong to an
                                 ///< earlier segment
  std::uint64_t last_use = 0;    ///< nodes whose vertices no later cell uses
  std::span<const std::uint32_t> slots{};  ///< slot of the vertex at each node; the span is valid
                                           ///< until the next cell
};

class PatternHistory {
 public:
  /// Creates an empty history. `stride`: the largest number of nodes per cell, which is the length
  /// of a row.
  explicit PatternHistory(std::uint32_t stride) : stride_(stride), nobody_(stride, kNone) {}

  std::uint32_t stride() const { return stride_; }
  bool may_reach(std::uint32_t bits) const {
    return bits <= kMostHistoryBits && std::uint64_t{stride_} << bits <= kMostHistoryNodes;
  }
  /// Increases the number of remembered cells to 2^bits. Does nothing if the number is already that
  /// large. Precondition: may_reach(bits).
  void reach(std::uint32_t bits);
  /// Reserves memory for `cells` further cells.
  void expect(std::uint64_t cells);
  std::uint32_t bits() const { return bits_; }

  // --- vertices

  struct Vertex {
    /// `last` is the most recent cell that used the vertex, `before` the second most recent.
    /// Initially, both are the cell that introduced the vertex.
    std::uint32_t last = 0, before = 0;
    std::uint64_t number = 0;  ///< used for decoding: number of the vertex in the source mesh
  };
  enum class State : std::uint8_t { finalized, own, imported };
  /// Adds a vertex that the current cell introduces, and returns its slot.
  std::uint32_t introduce(State state = State::own) {
    std::uint32_t slot;
    if (free_.empty()) {
      slot = add_slot();
    } else {
      slot = free_.back();
      free_.pop_back();
    }
    vertices_[slot] = {next_, next_, 0};
    states_[slot] = state;
    ++live_;
    return slot;
  }
  void finalize(std::uint32_t slot) {
    states_[slot] = State::finalized;
    --live_;
    free_.push_back(slot);
  }
  bool is_live(std::uint32_t slot) const {
    return slot < states_.size() && states_[slot] != State::finalized;
  }
  State state(std::uint32_t slot) const { return states_[slot]; }
  Vertex& vertex(std::uint32_t slot) { return vertices_[slot]; }
  // Each of the next two functions returns data of all vertices, indexed by slot. The spans are
  // valid until the next vertex is introduced.
  std::span<Vertex> vertices() { return vertices_; }
  std::span<const State> states() const { return states_; }
  const Vertex& vertex(std::uint32_t slot) const { return vertices_[slot]; }
  std::uint64_t live() const { return live_; }
  /// Returns the size of the slot table, which is greater than every slot.
  std::uint32_t slots() const { return static_cast<std::uint32_t>(vertices_.size()); }

  // --- cells, given by their number in the segment modulo 2^32

  std::uint32_t next() const { return next_; }
  bool remembers(std::uint32_t cell) const { return next_ - cell - 1 < remembered_; }
  /// Access to the rows of the remembered cells; valid until the next cell is added. The row of a
  /// cell lists the slots of its nodes, followed by kNone. If a cell is not remembered, its row
  /// contains only kNone. kStride: the stride of the history if it is known at compile time,
  /// otherwise 0.
  template <std::uint32_t kStride>
  class Rows {
   public:
    explicit Rows(const PatternHistory& of)
        : rows_(of.rows_.data()),
          nobody_(of.nobody_.data()),
          ring_(of.ring_),
          at_(of.at_),
          stride_(of.stride_),
          next_(of.next_),
          remembered_(of.remembered_) {}
    const std::uint32_t* row(std::uint32_t cell) const {
      const std::uint32_t back = next_ - cell;
      const std::uint32_t index = at_ - back + (back > at_ ? ring_ : 0);
      return back - 1 < remembered_ ? rows_ + std::size_t{index} * (kStride > 0 ? kStride : stride_)
                                    : nobody_;
    }

   private:
    const std::uint32_t *rows_, *nobody_;
    std::uint32_t ring_, at_, stride_, next_, remembered_;
  };
  /// Returns the row of the current cell. The caller fills in the row. The pointer is valid until
  /// the next call.
  std::uint32_t* begin_row() {
    if (std::size_t{at_ + 1} * stride_ > rows_.size()) add_rows();
    return rows_.data() + std::size_t{at_} * stride_;
  }
  /// The earlier cells that one cell referred to. The first `count` entries are valid.
  struct References {
    std::array<std::uint32_t, pattern_source::kOnCount> cells{};
    std::uint32_t count = 0;
    void add(std::uint32_t cell) {
      for (std::uint32_t i = 0; i < count; ++i)
        if (cells[i] == cell) return;
      if (count < cells.size()) cells[count++] = cell;
    }
  };
  const References& references() const { return references_; }

  /// Ends the current cell. Call it after all vertices of the cell have been marked as used.
  /// `nodes`: number of slots in the row of the cell.
  void add_cell(std::uint32_t nodes, const References& references) {
    for (std::uint32_t i = nodes; i < stride_; ++i) rows_[std::size_t{at_} * stride_ + i] = kNone;
    at_ = at_ + 1 == ring_ ? 0 : at_ + 1;
    pass_cell(references);
  }
  /// Ends the current cell in an encoder. An encoder does not store rows.
  void pass_cell(const References& references) {
    references_ = references;
    ++next_;
    if (remembered_ + 1 < ring_) ++remembered_;
  }

 private:
  void add_rows();
  std::uint32_t add_slot();

  std::uint32_t stride_;
  std::uint32_t bits_ = 0;
  // Number of rows in the ring: one for each remembered cell, and one for the current cell
  std::uint32_t ring_ = 2;
  // Ring buffer with the rows of the remembered cells and of the current cell. Until it is full,
  // the rows are in coding order.
  std::vector<std::uint32_t> rows_;
  std::uint32_t at_ = 0;  // index of the current cell's row
  std::uint32_t next_ = 0, remembered_ = 0;
  std::vector<std::uint32_t> nobody_;
  References references_;
  std::vector<Vertex> vertices_;
  // For each slot: whether its vertex is finalized, owned by the segment or imported. These states
  // are separate from vertices_ because they are read far more often than they change.
  std::vector<State> states_;
  std::vector<std::uint32_t> free_;
  std::uint64_t live_ = 0;
};

}  // namespace shm
