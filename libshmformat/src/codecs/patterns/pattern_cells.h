// Cells of segments in patterns refer to earlier cells by how long ago these came. A pattern says,
// for each node of a cell, at which node of which earlier cell its vertex occurs. Patterns repeat
// whatever the vertex numbers are, so a cell is stored as its place in a list of patterns.
//
//   PatternCell     a cell, as it passes between the coder and the values
//   PatternHistory  slots of vertices, and which cells are remembered; for decoding also the rows
//   of
//                   these cells, and the last two cells that used each vertex
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

// Frozen: part of the format.
inline constexpr std::uint32_t kMostPatternNodes = 64;
/// Only the last 2^bits cells can be referred to. The limit on nodes counts every cell as if it had
/// the most nodes of any block.
inline constexpr std::uint32_t kMostHistoryBits = 20;
inline constexpr std::uint64_t kMostHistoryNodes = std::uint64_t{1} << 23;

/// Sources of a node: the earlier cell that has its vertex. Frozen: part of the format.
namespace pattern_source {
inline constexpr std::uint32_t kBefore = 0;  ///< the previous cell
/// The cells right after those that the previous cell referred to, continuing its references.
inline constexpr std::uint32_t kOn = 1, kOnCount = 3;
/// The last two cells that used the vertex of an earlier node of this cell, one of its first seven.
inline constexpr std::uint32_t kUsers = kOn + kOnCount, kUsersOf = 7;
inline constexpr std::uint32_t kFar = kUsers + 2 * kUsersOf;  ///< a cell whose distance is coded
inline constexpr std::uint32_t kNew = kFar + 1;    ///< no cell: the vertex is new, see new_vertex
inline constexpr std::uint32_t kSlot = kNew + 1;   ///< no cell: the slot is coded
inline constexpr std::uint32_t kHere = kSlot + 1;  ///< an earlier node of this cell
inline constexpr std::uint32_t kCount = kHere + 1;
}  // namespace pattern_source
/// Flags of a new vertex, stored in place of the node number of the other cell.
namespace new_vertex {
inline constexpr std::uint32_t kNumbered = 1;  ///< its number is not the last number plus one
inline constexpr std::uint32_t kImported = 2;
inline constexpr std::uint32_t kMost = 3;
}  // namespace new_vertex

/// Returns true if cells of the schema can be coded as patterns: no delay, 1 to 64 nodes per cell.
bool takes_patterns(const Schema& schema);
/// Returns the largest number of nodes per cell of any block.
std::uint32_t most_nodes(const Schema& schema);

/// A cell. Sets of node positions are bit masks, from the first node on.
struct PatternCell {
  std::uint32_t block = 0;
  std::uint64_t introduced = 0;  ///< nodes whose vertices are new in the segment
  std::uint64_t again = 0;       ///< nodes whose vertex is also that of an earlier node
  std::uint64_t imports = 0;     ///< subset of `introduced`: vertices that an earlier segment owns
  std::uint64_t last_use = 0;    ///< nodes whose vertices no later cell uses
  std::span<const std::uint32_t> slots{};  ///< by node; valid until the next cell
};

class PatternHistory {
 public:
  /// `stride`: the largest number of nodes per cell.
  explicit PatternHistory(std::uint32_t stride) : stride_(stride), nobody_(stride, kNone) {}

  std::uint32_t stride() const { return stride_; }
  bool may_reach(std::uint32_t bits) const {
    return bits <= kMostHistoryBits && std::uint64_t{stride_} << bits <= kMostHistoryNodes;
  }
  /// Remembers the last 2^bits cells from now on. Has no effect if that is fewer than before. Must
  /// hold: may_reach().
  void reach(std::uint32_t bits);
  /// Makes room for this number of cells to come.
  void expect(std::uint64_t cells);
  std::uint32_t bits() const { return bits_; }

  // --- vertices

  struct Vertex {
    /// The last cell that used it, and the one before; at first both are the introducing cell.
    std::uint32_t last = 0, before = 0;
    std::uint64_t number = 0;  ///< decoding: its number in the source
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
  // By slot; valid until a vertex is introduced.
  std::span<Vertex> vertices() { return vertices_; }
  std::span<const State> states() const { return states_; }
  const Vertex& vertex(std::uint32_t slot) const { return vertices_[slot]; }
  std::uint64_t live() const { return live_; }
  /// Returns a number above every slot.
  std::uint32_t slots() const { return static_cast<std::uint32_t>(vertices_.size()); }

  // --- cells, by their number in the segment modulo 2^32

  std::uint32_t next() const { return next_; }
  bool remembers(std::uint32_t cell) const { return next_ - cell - 1 < remembered_; }
  /// The rows of the remembered cells, valid until a cell is added. A row holds the slots of a cell
  /// by node, then kNone; the row of a cell that is not remembered holds only kNone. kStride: the
  /// stride of the history if it is known at compile time, otherwise 0.
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
  /// Returns the row of the current cell, to be filled in. It is valid until the next call.
  std::uint32_t* begin_row() {
    if (std::size_t{at_ + 1} * stride_ > rows_.size()) add_rows();
    return rows_.data() + std::size_t{at_} * stride_;
  }
  /// The cells that a cell referred to; the first `count` entries are valid.
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

  /// Ends the current cell, after all of its vertices are marked as used. `nodes`: slots in its
  /// row.
  void add_cell(std::uint32_t nodes, const References& references) {
    for (std::uint32_t i = nodes; i < stride_; ++i) rows_[std::size_t{at_} * stride_ + i] = kNone;
    at_ = at_ + 1 == ring_ ? 0 : at_ + 1;
    pass_cell(references);
  }
  /// The same for an encoder, which needs no rows.
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
  std::uint32_t ring_ = 2;           // rows of the remembered cells and the current one
  std::vector<std::uint32_t> rows_;  // up to the current cell, in order until the ring is full
  std::uint32_t at_ = 0;             // the row of the current cell
  std::uint32_t next_ = 0, remembered_ = 0;
  std::vector<std::uint32_t> nobody_;
  References references_;
  std::vector<Vertex> vertices_;
  // by slot; separate from vertices_, as they are read far more often than changed
  std::vector<State> states_;
  std::vector<std::uint32_t> free_;
  std::uint64_t live_ = 0;
};

}  // namespace shm
