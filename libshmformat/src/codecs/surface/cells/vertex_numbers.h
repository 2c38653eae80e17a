// Vertex numbers: codes the number that each vertex has in the source mesh (Order::keep). Vertices
// are visited in the order in which their cell stores its corners. Most files number vertices in
// this order, so a number is often the previous number plus 1, or the largest number so far plus 1.
// On lattices, a number can also be predicted from its neighbours, by the rule that predicts
// coordinates.
// spec: "Vertex numbers"
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "base/lists.h"
#include "codecs/shared/stencil.h"
#include "codecs/surface/cells/mid_node_numbers.h"
#include "entropy/models.h"

namespace shm {

template <class Coder>
class VertexNumbers {
 public:
  /// Codes the numbers of the vertices that `cell` introduces at positions `first` and above.
  /// number(position) returns a reference; the encoder reads the number from it, and the decoder
  /// writes the number to it.
  template <class Number>
  void code_cell(Coder& coder, const CellTopology& cell, Number&& number, std::uint32_t first = 0);
  /// Records the number of a vertex. Call it if this number is coded in another stream.
  void add(std::uint32_t slot, std::uint64_t number);
  /// Codes the number of a vertex that no cell uses.
  std::uint64_t code_unused(Coder& coder, std::uint32_t slot, std::uint64_t number) {
    return code(coder, {last_ + 1, last_ + 1}, slot, number);
  }

 private:
  static constexpr std::uint32_t kKinds = 3 + MidNode::kKinds;
  /// The expected values of a number, and the contexts that are used to code it.
  struct Expectation {
    std::uint64_t near = 0, second = 0;  // second may equal near
    std::uint32_t kind = 0;
    std::uint32_t direction = kNone;
    // Slot of the neighbour from which `direction` leads to this vertex; not used if `direction` is
    // kNone
    std::uint32_t from = kNone;
  };

  Expectation expect(const CellTopology& cell, std::uint32_t position, const Stencil& stencil,
                     std::uint64_t known);
  std::uint64_t code(Coder& coder, const Expectation& expected, std::uint32_t slot,
                     std::uint64_t number);
  static std::uint32_t direction_of(const CellTopology& cell, std::uint32_t position,
                                    const Stencil& stencil);

  std::vector<std::uint64_t> numbers_;  // numbers by vertex slot
  // By vertex slot: 1 if the number of this new vertex of the current cell has not been coded yet.
  // Used only for cells whose nodes form a grid
  std::vector<std::uint8_t> is_coming_;
  std::uint64_t last_ = ~std::uint64_t{0},
                largest_ = ~std::uint64_t{0};  // largest number so far; before the first vertex it
                                               // is -1 modulo 2^64
  std::array<std::uint64_t, 6> stride_{1, 1, 1,
                                       // For each direction (index of a side): the most recent
                                       // difference between the numbers of two neighbouring
                                       // vertices
                                       1, 1, 1};
  MidNodeNumbers mid_node_numbers_;
  std::array<std::uint64_t, kKinds> miss_{};  // last error of `near`, by kind

  // Outcomes of the most recent guesses. The first entry is for vertices that are not mid nodes,
  // the second for mid nodes
  std::array<std::uint32_t, 2> history_{};
  std::array<std::array<std::array<AdaptiveBit, 4>, 64>, kKinds> guess_;
  std::array<std::array<AdaptiveBit, 4>, kKinds> missed_as_before_;
  std::array<SignedModel<NumberModel>, kKinds> residual_;
  std::vector<std::uint32_t> order_;
};

template <class Coder>
template <class Number>
void VertexNumbers<Coder>::code_cell(Coder& coder, const CellTopology& cell, Number&& number,
                                     std::uint32_t first) {
  order_ = cell.new_positions;
  std::erase_if(order_, [&](std::uint32_t position) { return position < first; });
  std::sort(order_.begin(), order_.end(), [&](std::uint32_t a, std::uint32_t b) {
    return cell.stored_position(a) < cell.stored_position(b);
  });
  if (cell.rows != nullptr) {
    for (const std::uint32_t slot : cell.slots) at_slot(is_coming_, slot) = 0;
    for (const std::uint32_t position : order_) is_coming_[cell.slots[position]] = 1;
  }
  for_each_new_vertex(
      cell, order_, [&](std::uint32_t position, const Stencil& stencil, std::uint64_t known) {
        std::uint64_t& value = number(position);
        value = code(coder, expect(cell, position, stencil, known), cell.slots[position], value);
        if (cell.rows != nullptr) is_coming_[cell.slots[position]] = 0;
      });
}

extern template class VertexNumbers<RangeEncoder>;
extern template class VertexNumbers<RangeDecoder>;

}  // namespace shm
