// What cells in patterns are told by: the cells before, by how long ago they came. A pattern says
// of each node of a cell where its vertex stands: at which node of which earlier cell. Patterns
// repeat, whatever the numbers are; a cell is its place in a list of patterns.
//
//   PatternCell     a cell, on its way between coder and values
//   PatternHistory  what is kept: slots of vertices, and which cells are remembered, in both
//                   directions; rows of cells, and who used a vertex last, for decoding
// spec: "Patterns"
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "bytes/lists.h"
#include "shm/schema.h"

namespace shm {

// Frozen: part of the format.
inline constexpr std::uint32_t kMostPatternNodes = 64;
/// The last 2^bits cells can be referred to, and so many nodes of cells, as if all had most.
inline constexpr std::uint32_t kMostHistoryBits = 20;
inline constexpr std::uint64_t kMostHistoryNodes = std::uint64_t{1} << 23;

/// Where the vertex of a node stands: at a node of one of these cells. Frozen: part of the format.
namespace pattern_source {
inline constexpr std::uint32_t kBefore = 0;  ///< the cell before
/// The cells after those that the cell before referred to: on as it went on.
inline constexpr std::uint32_t kOn = 1, kOnCount = 3;
/// The last two cells that used the vertex of an earlier node of this cell, one of its first seven.
inline constexpr std::uint32_t kUsers = kOn + kOnCount, kUsersOf = 7;
inline constexpr std::uint32_t kFar = kUsers + 2 * kUsersOf;  ///< the distance is coded
inline constexpr std::uint32_t kNew = kFar + 1;               ///< at none: see NewVertex
inline constexpr std::uint32_t kSlot = kNew + 1;              ///< the slot is coded
inline constexpr std::uint32_t kHere = kSlot + 1;             ///< at an earlier node of this cell
inline constexpr std::uint32_t kCount = kHere + 1;
}  // namespace pattern_source
/// What stands in place of the other cell's node where a vertex is new: bits.
namespace new_vertex {
inline constexpr std::uint32_t kNumbered = 1;  ///< its number is not one more than the last one
inline constexpr std::uint32_t kImported = 2;
inline constexpr std::uint32_t kMost = 3;
}  // namespace new_vertex

/// Whether the cells of a schema can be in patterns: no delay, 1 to 64 nodes in each.
bool takes_patterns(const Schema& schema);
/// The most nodes that a cell of any block has.
std::uint32_t most_nodes(const Schema& schema);

/// Positions are bits, from the first node on.
struct PatternCell {
  std::uint32_t block = 0;
  std::uint64_t introduced = 0;  ///< nodes whose vertices no cell of the segment used before
  std::uint64_t again = 0;       ///< nodes with the vertex of an earlier node
  std::uint64_t imports = 0;     ///< of those introduced, those that an earlier segment owns
  std::uint64_t last_use = 0;    ///< nodes whose vertices no later cell uses
  std::span<const std::uint32_t> slots{};  ///< by node; until the next cell
};

class PatternHistory {
 public:
  /// `stride`: the most nodes of a cell.
  explicit PatternHistory(std::uint32_t stride) : stride_(stride), nobody_(stride, kNone) {}

  std::uint32_t stride() const { return stride_; }
  bool may_reach(std::uint32_t bits) const {
    return bits <= kMostHistoryBits && std::uint64_t{stride_} << bits <= kMostHistoryNodes;
  }
  /// Cells are remembered over 2^bits of them. Never fewer than before. Must hold: may_reach().
  void reach(std::uint32_t bits);
  /// Makes room for so many cells to come.
  void expect(std::uint64_t cells);
  std::uint32_t bits() const { return bits_; }

  // --- vertices

  struct Vertex {
    std::uint32_t last = 0,
                  before = 0;  ///< cells that used it; the one that introduces it at first
    std::uint64_t number = 0;  ///< decoding: what the source calls it
  };
  enum class State : std::uint8_t { finalized, own, imported };
  /// Of a vertex that the cell at hand introduces; its slot.
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
  // By slot, until one is introduced.
  std::span<Vertex> vertices() { return vertices_; }
  std::span<const State> states() const { return states_; }
  const Vertex& vertex(std::uint32_t slot) const { return vertices_[slot]; }
  std::uint64_t live() const { return live_; }
  /// Above every slot.
  std::uint32_t slots() const { return static_cast<std::uint32_t>(vertices_.size()); }

  // --- cells, by their number in the segment, modulo 2^32

  std::uint32_t next() const { return next_; }
  bool remembers(std::uint32_t cell) const { return next_ - cell - 1 < remembered_; }
  /// The rows of cells, until one is added: slots by node, kNone where the cell has no more; of a
  /// cell that is not remembered kNone throughout. kStride: that of the history; 0: any.
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
      const std::uint32_t at = at_ - back + (back > at_ ? ring_ : 0);
      return back - 1 < remembered_ ? rows_ + std::size_t{at} * (kStride > 0 ? kStride : stride_)
                                    : nobody_;
    }

   private:
    const std::uint32_t *rows_, *nobody_;
    std::uint32_t ring_, at_, stride_, next_, remembered_;
  };
  /// That of the cell at hand, to be written; until the cell behind the next one is begun.
  std::uint32_t* begin_row() {
    if (std::size_t{at_ + 1} * stride_ > rows_.size()) add_rows();
    return rows_.data() + std::size_t{at_} * stride_;
  }
  /// What the cell before referred to, `count` of them.
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

  /// The cell at hand is whole, each of its nodes used, and so many in its row.
  void add_cell(std::uint32_t nodes, const References& references) {
    for (std::uint32_t i = nodes; i < stride_; ++i) rows_[std::size_t{at_} * stride_ + i] = kNone;
    at_ = at_ + 1 == ring_ ? 0 : at_ + 1;
    pass_cell(references);
  }
  /// The same of who never asks for rows.
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
  std::uint32_t ring_ = 2;           // rows of the cells remembered and of the one at hand
  std::vector<std::uint32_t> rows_;  // as far as cells have come, in order until the ring is full
  std::uint32_t at_ = 0;             // the row of the cell at hand
  std::uint32_t next_ = 0, remembered_ = 0;
  std::vector<std::uint32_t> nobody_;
  References references_;
  std::vector<Vertex> vertices_;
  std::vector<State> states_;  // by slot, too: looked at much more often than changed
  std::vector<std::uint32_t> free_;
  std::uint64_t live_ = 0;
};

}  // namespace shm
