// Tests the coder of vertex numbers, separately from other coders: the encoded sizes for common
// numberings, and round trips.
#include "codecs/surface/cells/vertex_numbers.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <random>
#include <vector>

namespace shm {
namespace {

/// Returns a cell with eight new vertices, whose corners are stored in the given order.
CellTopology fresh_cell(const std::array<std::uint8_t, 8>& stored, std::uint32_t first_slot) {
  CellTopology cell;
  cell.hexahedral = true;
  for (std::uint32_t i = 0; i < 8; ++i) {
    cell.slots.push_back(first_slot + i);
    cell.new_positions.push_back(i);
  }
  cell.stored_corner = stored;
  return cell;
}

/// Encodes these vertex numbers, eight for each cell, and checks that they decode correctly.
/// Returns the encoded size in bytes.
std::size_t cost(const std::vector<std::uint64_t>& numbers,
                 const std::array<std::uint8_t, 8>& stored) {
  RangeEncoder out;
  VertexNumbers<RangeEncoder> encoder;
  for (std::size_t c = 0; c < numbers.size() / 8; ++c) {
    auto copy = numbers;
    const CellTopology cell = fresh_cell(stored, static_cast<std::uint32_t>(8 * (c % 4)));
    encoder.code_cell(out, cell, [&](std::uint32_t position) -> std::uint64_t& {
      return copy[8 * c + cell.stored_position(position)];
    });
  }
  const auto bytes = out.finish();
  RangeDecoder in(bytes);
  VertexNumbers<RangeDecoder> decoder;
  for (std::size_t c = 0; c < numbers.size() / 8; ++c) {
    const CellTopology cell = fresh_cell(stored, static_cast<std::uint32_t>(8 * (c % 4)));
    std::array<std::uint64_t, 8> back{};
    decoder.code_cell(in, cell, [&](std::uint32_t position) -> std::uint64_t& {
      return back[cell.stored_position(position)];
    });
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(back[i], numbers[8 * c + i]);
  }
  return bytes.size();
}

constexpr std::array<std::uint8_t, 8> kAsIs = {0, 1, 2, 3, 4, 5, 6, 7};
constexpr std::array<std::uint8_t, 8> kTurned = {6, 5, 1, 2, 7, 4, 0, 3};

TEST(VertexNumbers, ThoseInStoredOrderCostNothing) {
  std::vector<std::uint64_t> numbers(8000);
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = i;
  EXPECT_LE(cost(numbers, kAsIs), 40u);
  EXPECT_LE(cost(numbers, kTurned), 40u);
}

TEST(VertexNumbers, AnyNumbersComeBack) {
  std::mt19937_64 random(3);
  std::vector<std::uint64_t> numbers(800);
  for (std::size_t i = 0; i < numbers.size(); ++i)
    numbers[i] = i % 5 == 0 ? random() : i % 7 == 0 ? ~std::uint64_t{0} : random() % 100;
  cost(numbers, kAsIs);
  cost(numbers, kTurned);
}

TEST(VertexNumbers, UnusedOnesGoOnWhereTheLastLeft) {
  RangeEncoder out;
  VertexNumbers<RangeEncoder> encoder;
  for (std::uint64_t n = 0; n < 5000; ++n) EXPECT_EQ(encoder.code_unused(out, 0, 7 + n), 7 + n);
  EXPECT_LE(out.finish().size(), 20u);
}

}  // namespace
}  // namespace shm
