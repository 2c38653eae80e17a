// Encodes and decodes only the connectivity of hexahedra with one codec, including the original
// vertex numbers (Order::keep).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

#include "codecs/surface/cells/connectivity.h"
#include "codecs/surface/cells/vertex_numbers.h"

namespace shm::bench {

inline constexpr std::array<std::pair<const char*, ConnectivityCodec>, 4> kConnectivityCodecs = {
    {{"codec rows", ConnectivityCodec::rows},
     {"codec replay", ConnectivityCodec::replay},
     {"codec mixed", ConnectivityCodec::mixed},
     {"codec paper", ConnectivityCodec::paper}}};

/// Returns the last-use marks of each hexahedron: bit i is set if no later hexahedron uses corner
/// i.
inline std::vector<std::uint8_t> last_uses(std::span<const std::uint32_t> corners,
                                           std::uint64_t vertices) {
  std::vector<bool> used(vertices);
  std::vector<std::uint8_t> last_use(corners.size() / 8);
  for (std::size_t i = corners.size(); i-- > 0;) {
    // If a cell contains a vertex at two corners, either corner may have the last-use mark.
    if (!used[corners[i]]) last_use[i / 8] |= static_cast<std::uint8_t>(1u << i % 8);
    used[corners[i]] = true;
  }
  return last_use;
}

struct Streams {
  std::vector<std::byte> symbols, corner_order, numbers;
  std::size_t bytes() const { return symbols.size() + corner_order.size() + numbers.size(); }
};

inline Schema hexahedra_schema() {
  Schema schema;
  schema.blocks.push_back({1, "hexahedra", CellShape::hexahedron, 8});
  return schema;
}

/// Encodes hexahedra. `corners` contains eight vertex numbers for each hexahedron. All of them must
/// be less than `vertices`.
inline Streams encode(std::span<const std::uint32_t> corners,
                      std::span<const std::uint8_t> last_use, std::uint64_t vertices,
                      ConnectivityCodec codec) {
  const Schema schema = hexahedra_schema();
  Connectivity<RangeEncoder> connectivity(schema);
  connectivity.set_codec(codec);
  VertexNumbers<RangeEncoder> vertex_numbers;
  RangeEncoder symbols, corner_order, numbers;
  std::vector<std::uint32_t> slot(vertices, kNone);
  StoredCell stored;
  stored.slots.resize(8);
  stored.numbers.resize(8);
  stored.last_use.resize(8);
  CellTopology cell;
  for (std::size_t c = 0; c < last_use.size(); ++c) {
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t v = corners[8 * c + i];
      stored.slots[i] = slot[v];
      stored.numbers[i] = stored.original[i] = v;
      stored.last_use[i] = last_use[c] >> i & 1;
    }
    if (!connectivity.code_cell(symbols, corner_order, stored, cell))
      throw std::runtime_error("cannot be coded");
    const auto number = [&](std::uint32_t p) -> std::uint64_t& {
      return stored.numbers[cell.stored_position(p)];
    };
    if (!connectivity.codes_numbers()) vertex_numbers.code_cell(numbers, cell, number);
    for (std::uint32_t p : cell.new_positions) slot[number(p)] = cell.slots[p];
    connectivity.finish_cell(cell);
  }
  return {symbols.finish(), corner_order.finish(), numbers.finish()};
}

/// Decodes the corners. Returns the same list that was passed to encode().
inline std::vector<std::uint32_t> decode(const Streams& streams, std::size_t hexahedra,
                                         ConnectivityCodec codec) {
  const Schema schema = hexahedra_schema();
  Connectivity<RangeDecoder> connectivity(schema);
  connectivity.set_codec(codec);
  VertexNumbers<RangeDecoder> vertex_numbers;
  RangeDecoder symbols(streams.symbols), corner_order(streams.corner_order),
      numbers(streams.numbers);
  std::vector<std::uint64_t> number;
  std::vector<std::uint32_t> corners(8 * hexahedra);
  CellTopology cell;
  for (std::size_t c = 0; c < hexahedra; ++c) {
    if (!connectivity.decode_cell(symbols, corner_order, cell))
      throw std::runtime_error("cannot be decoded");
    number.resize(connectivity.surface().vertex_slots());
    if (connectivity.codes_numbers())
      for (std::uint32_t p : cell.new_positions) number[cell.slots[p]] = cell.original[p];
    else
      vertex_numbers.code_cell(
          numbers, cell, [&](std::uint32_t p) -> std::uint64_t& { return number[cell.slots[p]]; });
    for (std::uint32_t p = 0; p < 8; ++p)
      corners[8 * c + cell.stored_position(p)] = static_cast<std::uint32_t>(number[cell.slots[p]]);
    connectivity.finish_cell(cell);
  }
  return corners;
}

}  // namespace shm::bench
