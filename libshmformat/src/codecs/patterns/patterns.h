// Patterns: codes each cell as an index into a list of patterns. Further lists contain the data
// that the patterns do not determine. All lists are compressed by zstd. This method is fast on
// meshes of any kind, since it needs neither an active surface nor adaptive models.
//
// The encoder accepts cells as lists of vertices, and returns a bitstream for each group. Encoder
// and decoder store the slots of live vertices, and update them in the same way. The decoder also
// stores the most recent cells. The encoder also stores the four most recent uses of each live
// vertex: for each use, the cell and the node.
// spec: "Patterns"
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"
#include "codecs/patterns/pattern_cells.h"

namespace shm {

class PatternEncoder {
 public:
  /// `numbered`: true if vertex numbers are stored; if false, vertices are numbered in coding
  /// order.
  PatternEncoder(const Schema& schema, bool numbered);

  /// Adds a cell. `handles`: the caller's handles of the vertices of the cell. A handle may be
  /// reused after the last cell that uses its vertex. `numbers`: the numbers of the vertices that
  /// the cell introduces, in the order in which they occur in the cell. The slots of the cell are
  /// valid until the next call.
  void add_cell(const PatternCell& cell, std::span<const std::uint32_t> handles,
                std::span<const std::uint64_t> numbers);
  std::span<const std::uint32_t> slots() const { return slots_; }
  /// For the most recently added cell, returns PatternCell::again: the bit mask of nodes whose
  /// vertex occurs at an earlier node of the cell.
  std::uint64_t again() const { return again_; }
  /// Adds a vertex that no cell uses. Call it after the cells of the group.
  void add_unused(std::uint64_t number);
  /// Returns the bitstream of the group, and begins the next group.
  std::vector<std::byte> finish(ZstdCompressor& zstd);

  std::uint64_t live() const { return history_.live(); }
  /// Returns the size of the slot table, which is greater than every slot.
  std::uint32_t slot_count() const { return history_.slots(); }

 private:
  struct Op {
    std::uint32_t source = 0, node = 0;
  };
  /// The four most recent uses of a vertex, from latest to earliest. A use is a cell and the first
  /// node of this cell at which the vertex occurs. If the vertex has fewer uses, the remaining
  /// entries contain the cell that introduced the vertex.
  struct Uses {
    std::array<std::uint32_t, 4> cells{};
    std::array<std::uint8_t, 4> nodes{};
    void begin(std::uint32_t cell, std::uint32_t node) {
      cells.fill(cell);
      nodes.fill(static_cast<std::uint8_t>(node));
    }
    void add(std::uint32_t cell, std::uint32_t node) {
      cells = {cell, cells[0], cells[1], cells[2]};
      nodes = {static_cast<std::uint8_t>(node), nodes[0], nodes[1], nodes[2]};
    }
  };
  /// For each source: the cell to which the source refers. If no such cell exists, the entry is the
  /// current cell.
  using Candidates = std::array<std::uint32_t, pattern_source::kFar>;
  void find_nodes(const PatternCell& cell, std::span<const std::uint64_t> numbers);
  Op find(const Candidates& cells, std::uint32_t node, const Uses& uses);
  std::uint32_t pattern_of(std::uint32_t block, std::uint32_t nodes);

  bool numbered_;
  PatternHistory history_;
  std::vector<std::uint32_t> nodes_;    // number of nodes per cell, indexed by block
  std::vector<std::uint32_t> slot_of_;  // slots of vertices, by the caller's handle
  std::vector<Uses> uses_;              // most recent uses of vertices, indexed by slot
  std::vector<std::uint32_t> slots_;    // slots of the current cell
  std::uint64_t again_ = 0;             // PatternCell::again of the current cell
  PatternHistory::References references_;
  std::uint64_t last_number_ = ~std::uint64_t{0};

  /// The patterns used by the cells of one block in the current group.
  struct Patterns {
    // Hash table with open addressing. Each entry is the index of a pattern plus 1, or 0 if the
    // entry is free. The key of the pattern determines the position of its entry.
    std::vector<std::uint32_t> table;
    std::vector<std::uint64_t> keys;  // key of each pattern
    std::vector<std::uint8_t>
        ops;  // source of each node, and the node in the source cell; one pattern after another
    std::vector<std::uint32_t> uses;  // number of uses, by pattern
    std::uint32_t last = 0;

    /// Returns the position in the hash table of the pattern with key `key` for which `matches`
    /// returns true. If the table does not contain this pattern, returns the free position at which
    /// to insert it.
    template <class Is>
    std::size_t find(std::uint64_t key, Is&& matches) const {
      std::size_t position = static_cast<std::size_t>(key >> 32) & (table.size() - 1);
      while (table[position] != 0 && !matches(table[position] - 1))
        position = (position + 1) & (table.size() - 1);
      return position;
    }
    /// Makes space in the table for another pattern.
    void grow();
  };
  std::vector<Patterns> patterns_;  // patterns of the current group, indexed by block
  std::vector<std::uint8_t> ops_;   // per node of the current cell: source, node in the source cell
  struct Run {
    std::uint32_t block = 0, cells = 0;
  };
  std::vector<Run> runs_;
  std::vector<std::uint32_t> ids_;  // pattern of each cell
  // For each cell, a bit mask of the nodes whose vertices no later cell uses. Each word contains
  // the bits of 32 nodes; a cell has one word for every 32 nodes.
  std::vector<std::uint32_t> last_use_;
  std::vector<std::uint32_t> distances_, slot_list_;
  ByteWriter numbers_;
  std::uint64_t missed_ = 0;  // number of nodes whose vertices no remembered cell contains
};

class PatternDecoder {
 public:
  /// `first_vertex`: if vertices are numbered in coding order, the number of the first vertex that
  /// the segment owns.
  PatternDecoder(const Schema& schema, bool numbered, bool may_import, std::uint64_t first_vertex);

  /// Begins a group with `cells` cells, which together have at most `nodes` nodes.
  /// `most_number_bytes`: limit of the unpacked size of the vertex numbers. Returns false if the
  /// data is damaged.
  bool begin_group(std::span<const std::byte> bytes, std::uint32_t cells, std::uint64_t nodes,
                   std::uint64_t most_number_bytes, ZstdDecompressor& zstd);
  /// Decodes the next cell and stores its vertex numbers in `numbers`, indexed by node. The caller
  /// must call end_cell() after each cell. If vertices are numbered in coding order, next_cell()
  /// calls import(vertex) for each imported vertex; import() sets the number of the vertex, or
  /// returns false if the data is damaged. Returns null if the data is damaged.
  template <class Import>
  const PatternCell* next_cell(std::uint64_t* numbers, Import&& import) {
    if (!begin_cell()) return nullptr;
    const auto nodes = static_cast<std::uint32_t>(cell_.slots.size());
    return (nodes == 8 && stride() == 8 ? decode_nodes<8>(8, numbers, import)
                                        : decode_nodes<0>(nodes, numbers, import))
               ? &cell_
               : nullptr;
  }
  std::size_t stride() const { return history_.stride(); }
  /// Finalizes the vertices that no later cell uses. Calls visit(number) for each imported vertex
  /// among them.
  template <class Visit>
  void end_cell(Visit&& visit) {
    for (std::uint64_t left = cell_.last_use; left != 0; left &= left - 1) {
      const std::uint32_t slot = cell_.slots[static_cast<std::size_t>(std::countr_zero(left))];
      if (!history_.is_live(slot)) continue;  // already finalized at an earlier node of this cell
      if (history_.state(slot) == PatternHistory::State::imported)
        visit(history_.vertex(slot).number);
      history_.finalize(slot);
    }
  }
  /// Returns the number of the next unused vertex, or nothing if the data is damaged.
  std::optional<std::uint64_t> next_unused();
  bool at_end() const;

  std::uint64_t live() const { return history_.live(); }
  /// Returns true if the segment owns the live vertex with this slot.
  bool is_own(std::uint32_t slot) const {
    return history_.state(slot) == PatternHistory::State::own;
  }
  std::uint64_t number(std::uint32_t slot) const { return history_.vertex(slot).number; }
  std::uint32_t slot_count() const { return history_.slots(); }

 private:
  bool may_be(std::uint32_t source, std::uint32_t place, std::uint32_t node) const;
  bool begin_cell();
  template <std::uint32_t kNodes, class Import>
  bool decode_nodes(std::uint32_t nodes, std::uint64_t* numbers, Import& import);
  void give_number(std::uint32_t kind, PatternHistory::Vertex& vertex) {
    if (numbered_) {
      if ((kind & new_vertex::kNumbered) != 0)
        take_number();
      else
        ++last_number_;
      vertex.number = last_number_;
    } else if ((kind & new_vertex::kImported) == 0) {
      vertex.number = next_own_++;
    }
  }
  void take_number();

  bool numbered_, may_import_;
  PatternHistory history_;
  std::vector<std::uint32_t> nodes_;  // number of nodes per cell, indexed by block
  PatternCell cell_;
  std::uint32_t* slots_ = nullptr;  // row of the current cell
  std::uint32_t words_of_uses_;
  const std::uint8_t* ops_ =
      nullptr;  // per node of the current cell: source, node in the source cell
  std::uint64_t last_number_ = ~std::uint64_t{0}, next_own_;

  // Data of the current group
  struct Run {
    std::uint32_t block = 0, cells = 0;
  };
  std::vector<Run> runs_;
  std::size_t run_ = 0;
  std::uint32_t in_run_ = 0;
  // patterns of the current group, indexed by block
  std::vector<std::vector<std::uint8_t>> patterns_;
  std::vector<std::uint32_t> ids_, last_use_, distances_, slot_list_;
  std::size_t next_id_ = 0, next_use_ = 0, next_distance_ = 0, next_slot_ = 0;
  std::vector<std::byte> numbers_bytes_;
  ByteReader numbers_{{}};
};

/// Decodes the nodes of the current cell. kNodes: the number of nodes, if it is known at compile
/// time and equals the row length; otherwise 0, and `nodes` is the number of nodes.
template <std::uint32_t kNodes, class Import>
bool PatternDecoder::decode_nodes(std::uint32_t nodes, std::uint64_t* numbers, Import& import) {
  using namespace pattern_source;
  const std::uint32_t count = kNodes > 0 ? kNodes : nodes;
  const PatternHistory::Rows<kNodes> rows(history_);
  std::span<PatternHistory::Vertex> vertices = history_.vertices();
  std::span<const PatternHistory::State> states = history_.states();
  const std::uint8_t* const ops = ops_;
  std::uint32_t* const slots = slots_;
  const std::uint32_t cell = history_.next();
  std::uint64_t introduced = 0, again = 0;
  // For each source: the cell whose row is read. If no such cell exists, the entry is the current
  // cell, which has no row yet.
  std::array<std::uint32_t, kFar + 1> cells;
  const PatternHistory::References& on = history_.references();
  cells[kBefore] = cell - 1;
  for (std::uint32_t i = 0; i < kOnCount; ++i)
    cells[kOn + i] = i < on.count ? on.cells[i] + 1 : cell;
  // Earlier cells that the current cell refers to, in the order of its nodes
  std::array<std::uint32_t, kMostPatternNodes> referred;
  std::uint32_t referred_count = 0;
  const auto decode_node = [&](std::uint32_t i) -> bool {
    const std::uint32_t source = ops[2 * i], node = ops[2 * i + 1];
    std::uint32_t slot = 0;
    if (source == kNew) {
      const bool imported = (node & new_vertex::kImported) != 0;
      slots[i] = slot = history_.introduce(imported ? PatternHistory::State::imported
                                                    : PatternHistory::State::own);
      vertices = history_.vertices();
      states = history_.states();
      PatternHistory::Vertex& vertex = vertices[slot];
      introduced |= std::uint64_t{1} << i;
      give_number(node, vertex);
      if (imported) {
        cell_.imports |= std::uint64_t{1} << i;
        if (!numbered_ && !import(vertex)) return false;
      }
      if (i < kUsersOf) cells[kUsers + 2 * i] = cells[kUsers + 2 * i + 1] = cell;
      numbers[i] = vertex.number;
      return true;
    }
    if (source <= kFar) {
      if (source == kFar) {
        if (next_distance_ == distances_.size()) return false;
        cells[kFar] = cell - distances_[next_distance_++];
      }
      const std::uint32_t from = cells[source];
      slot = rows.row(from)[node];
      referred[referred_count] = from;
      referred_count += source == kBefore ? 0 : 1;
    } else if (source == kHere) {
      slot = slots[node];
    } else {
      if (next_slot_ == slot_list_.size()) return false;
      slot = slot_list_[next_slot_++];
    }
    if (slot >= states.size() || states[slot] == PatternHistory::State::finalized) return false;
    slots[i] = slot;
    PatternHistory::Vertex& vertex = vertices[slot];
    if (i < kUsersOf) {
      cells[kUsers + 2 * i] = vertex.last;
      cells[kUsers + 2 * i + 1] = vertex.before;
    }
    // Test for a repeated vertex even if the source is an earlier cell. The earlier cell may list a
    // slot that has since been reused for a vertex that the current cell introduces.
    const bool is_again = vertex.last == cell;
    again |= static_cast<std::uint64_t>(is_again) << i;
    vertex.before = is_again ? vertex.before : vertex.last;
    vertex.last = cell;
    numbers[i] = vertex.number;
    return true;
  };
  if constexpr (kNodes > 0) {
    // The compiler unrolls this loop, so that each node has branches of its own, which are easier
    // to predict. This saves 3 % of the reading time.
#if !defined(__wasm__)  // code size matters more there
#pragma GCC unroll 8
#endif
    for (std::uint32_t i = 0; i < kNodes; ++i)
      if (!decode_node(i)) return false;
  } else {
    for (std::uint32_t i = 0; i < count; ++i)
      if (!decode_node(i)) return false;
  }
  cell_.introduced = introduced;
  cell_.again = again;
  PatternHistory::References references;
  for (std::uint32_t i = 0; i < referred_count && references.count < kOnCount; ++i)
    references.add(referred[i]);
  history_.add_cell(count, references);
  return numbers_.ok();
}

}  // namespace shm
