// Patterns: cells as places in a list of patterns, lists of what patterns leave open, all under
// zstd. For speed, on meshes of any kind; no active surface of faces, no models.
//
// in:    cells, by vertices      out: a bitstream for each group
// keeps: slots of live vertices, changed alike in both directions; to decode, the last cells; to
//        encode, where each live vertex stands in the last four cells that used it
// spec: "Patterns"
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bytes/binary.h"
#include "bytes/packing.h"
#include "patterns/pattern_cells.h"

namespace shm {

class PatternEncoder {
 public:
  /// `numbered`: whether vertices come with numbers of their own.
  PatternEncoder(const Schema& schema, bool numbered);

  /// `handles`: what the caller calls the vertices, free again behind the cell that uses one last.
  /// `numbers`: of those that the cell introduces, in order of nodes. Slots of the cell are valid
  /// until the next one.
  void add_cell(const PatternCell& cell, std::span<const std::uint32_t> handles,
                std::span<const std::uint64_t> numbers);
  std::span<const std::uint32_t> slots() const { return slots_; }
  /// As PatternCell has it.
  std::uint64_t again() const { return again_; }
  /// A vertex that no cell uses; after the cells of the group.
  void add_unused(std::uint64_t number);
  /// The group's bitstream; the next group begins.
  std::vector<std::byte> finish(ZstdCompressor& zstd);

  std::uint64_t live() const { return history_.live(); }
  /// Above every slot.
  std::uint32_t slot_count() const { return history_.slots(); }

 private:
  struct Op {
    std::uint32_t source = 0, node = 0;
  };
  /// The last four cells that used a vertex, the latest first, and the first of their nodes at
  /// which it stands; the cell that introduces it in place of those that are not there.
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
  /// By source: the cell that it names, or the cell at hand.
  using Candidates = std::array<std::uint32_t, pattern_source::kFar>;
  void find_nodes(const PatternCell& cell, std::span<const std::uint64_t> numbers);
  Op find(const Candidates& cells, std::uint32_t node, const Uses& uses);
  std::uint32_t pattern_of(std::uint32_t block, std::uint32_t nodes);

  bool numbered_;
  PatternHistory history_;
  std::vector<std::uint32_t> nodes_;    // by block
  std::vector<std::uint32_t> slot_of_;  // by handle
  std::vector<Uses> uses_;              // by slot
  std::vector<std::uint32_t> slots_;    // of the cell at hand
  std::uint64_t again_ = 0;             // likewise
  PatternHistory::References references_;
  std::uint64_t last_number_ = ~std::uint64_t{0};

  /// The patterns of a block in the group at hand.
  struct Patterns {
    std::vector<std::uint32_t> table;  // pattern + 1 by key, open addressing; 0: none
    std::vector<std::uint64_t> keys;   // by pattern
    std::vector<std::uint8_t> ops;     // source and node, by pattern and node
    std::vector<std::uint32_t> uses;   // by pattern
    std::uint32_t last = 0;

    /// Where in the table a pattern with this key stands that `is` accepts, or will stand.
    template <class Is>
    std::size_t find(std::uint64_t key, Is&& is) const {
      std::size_t at = static_cast<std::size_t>(key >> 32) & (table.size() - 1);
      while (table[at] != 0 && !is(table[at] - 1)) at = (at + 1) & (table.size() - 1);
      return at;
    }
    /// Room for one more.
    void grow();
  };
  std::vector<Patterns> patterns_;  // by block
  std::vector<std::uint8_t> ops_;   // of the cell at hand
  struct Run {
    std::uint32_t block = 0, cells = 0;
  };
  std::vector<Run> runs_;
  std::vector<std::uint32_t> ids_;       // by cell
  std::vector<std::uint32_t> last_use_;  // by cell, words of 32 nodes
  std::vector<std::uint32_t> distances_, slot_list_;
  ByteWriter numbers_;
  std::uint64_t missed_ = 0;  // nodes whose vertex is remembered by none of the last cells
};

class PatternDecoder {
 public:
  /// `first_vertex`: the number of the first own vertex, where they are numbered by their order.
  PatternDecoder(const Schema& schema, bool numbered, bool may_import, std::uint64_t first_vertex);

  /// `bytes` of a group with so many cells, which have `nodes` nodes at most; numbers may take
  /// `most_number_bytes`. False for damaged data.
  bool begin_group(std::span<const std::byte> bytes, std::uint32_t cells, std::uint64_t nodes,
                   std::uint64_t most_number_bytes, ZstdDecompressor& zstd);
  /// The next cell; null for damaged data. `numbers` takes those of its vertices, by node. Of each
  /// imported vertex, where they are numbered by their order: import(vertex), which sets its
  /// number; false for damaged data. Last uses are still to come: end_cell().
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
  /// Finalizes the vertices that the cell uses last; calls visit(number) of imported ones.
  template <class Visit>
  void end_cell(Visit&& visit) {
    for (std::uint64_t left = cell_.last_use; left != 0; left &= left - 1) {
      const std::uint32_t slot = cell_.slots[static_cast<std::size_t>(std::countr_zero(left))];
      if (!history_.is_live(slot)) continue;  // it stands at several nodes
      if (history_.state(slot) == PatternHistory::State::imported)
        visit(history_.vertex(slot).number);
      history_.finalize(slot);
    }
  }
  /// Of a vertex that no cell uses; nothing for damaged data.
  std::optional<std::uint64_t> next_unused();
  bool at_end() const;

  std::uint64_t live() const { return history_.live(); }
  /// Whether a live vertex has the slot that the segment owns, and its number.
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
  std::vector<std::uint32_t> nodes_;  // by block
  PatternCell cell_;
  std::uint32_t* slots_ = nullptr;  // of the cell at hand: its row
  std::uint32_t words_of_uses_;
  const std::uint8_t* ops_ = nullptr;  // of the cell at hand: source and node, by node
  std::uint64_t last_number_ = ~std::uint64_t{0}, next_own_;

  // the group at hand
  struct Run {
    std::uint32_t block = 0, cells = 0;
  };
  std::vector<Run> runs_;
  std::size_t run_ = 0;
  std::uint32_t in_run_ = 0;
  std::vector<std::vector<std::uint8_t>> patterns_;  // by block
  std::vector<std::uint32_t> ids_, last_use_, distances_, slot_list_;
  std::size_t next_id_ = 0, next_use_ = 0, next_distance_ = 0, next_slot_ = 0;
  std::vector<std::byte> numbers_bytes_;
  ByteReader numbers_{{}};
};

/// kNodes: how many there are, as many as in a row of the history; 0: any number.
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
  // By source: the cells whose rows they name. A cell that is to come has none.
  std::array<std::uint32_t, kFar + 1> cells;
  const PatternHistory::References& on = history_.references();
  cells[kBefore] = cell - 1;
  for (std::uint32_t i = 0; i < kOnCount; ++i)
    cells[kOn + i] = i < on.count ? on.cells[i] + 1 : cell;
  std::array<std::uint32_t, kMostPatternNodes> referred;  // in order of nodes
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
    // Whatever told it: a slot of an earlier cell may be that of a vertex which is new here.
    const bool is_again = vertex.last == cell;
    again |= static_cast<std::uint64_t>(is_again) << i;
    vertex.before = is_again ? vertex.before : vertex.last;
    vertex.last = cell;
    numbers[i] = vertex.number;
    return true;
  };
  if constexpr (kNodes > 0) {
    // Each node has branches of its own to be foretold: reading takes 3 % less time.
#if !defined(__wasm__)  // where the size of code counts for more
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
