#include "codecs/shared/digest.h"

#include <bit>
#include <cstring>

#include "format/schema.h"

namespace shm {
namespace {

template <class Word>
std::uint64_t sum_of(const DigestKeys& keys, std::span<const std::uint64_t> numbers,
                     const std::byte* values, std::size_t stride, std::size_t components) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] == kNoNumber) continue;
    std::uint64_t key = keys.first(numbers[i]);
    const std::byte* const element = values + i * stride;
    for (std::size_t c = 0; c < components; ++c, key += DigestKeys::kNext) {
      Word word;
      std::memcpy(&word, element + c * sizeof(Word), sizeof(Word));
      sum += digest_of_word(key, word);
    }
  }
  return sum;
}

}  // namespace

[[gnu::noinline]] std::uint64_t digest_of_values(const DigestKeys& keys,
                                                 std::span<const std::uint64_t> numbers,
                                                 const std::byte* values, std::size_t stride,
                                                 ScalarType type, std::size_t components) {
  switch (scalar_bytes(type)) {
    case 1: return sum_of<std::uint8_t>(keys, numbers, values, stride, components);
    case 2: return sum_of<std::uint16_t>(keys, numbers, values, stride, components);
    case 4: return sum_of<std::uint32_t>(keys, numbers, values, stride, components);
    default: return sum_of<std::uint64_t>(keys, numbers, values, stride, components);
  }
}

std::uint64_t digest_of_step_times(std::span<const double> times, std::uint64_t first) {
  const DigestKeys keys = DigestKeys::of_step_times();
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < times.size(); ++i)
    sum += digest_of_word(keys.first(first + i), std::bit_cast<std::uint64_t>(times[i]));
  return sum;
}

CellDigests::CellDigests(const Schema& schema) {
  constexpr std::uint32_t kCorners = 8;
  for (const BlockInfo& block : schema.blocks)
    steps_.push_back(!schema.corner_order && block.shape == CellShape::hexahedron &&
                             block.nodes_per_cell == kCorners
                         ? 0
                         : DigestKeys::kNext);
}

void add_covered(const Schema& schema, std::uint32_t array, std::span<const std::uint64_t> cells,
                 std::span<const std::uint32_t> blocks, std::vector<std::uint64_t>& numbers) {
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (schema.array_covers(array, blocks[c])) numbers.push_back(cells[c]);
}

std::uint64_t BlockDigests::of(const MeshBlock& block) {
  std::uint64_t sum = 0;
  for (std::size_t c = 0; c < block.cell_count(); ++c) {
    const auto begin = static_cast<std::size_t>(block.corner_begin[c]);
    const auto nodes = static_cast<std::size_t>(block.corner_begin[c + 1]) - begin;
    const std::uint64_t* const corners = block.corners.data() + begin;
    sum += cells_.of(
        block.cell_numbers[c], block.cell_blocks[c], nodes,
        [&](std::size_t i, std::uint64_t key) { return digest_of_word(key, corners[i]); });
  }
  std::span<const std::uint64_t> vertices = block.vertex_numbers;
  if (!block.imported.empty()) {
    numbers_.assign(vertices.begin(), vertices.end());
    for (std::size_t v = 0; v < numbers_.size(); ++v)
      if (block.imported[v] != 0) numbers_[v] = kNoNumber;
    vertices = numbers_;
  }
  const auto add = [&](const DigestKeys& keys, std::span<const std::uint64_t> numbers,
                       const std::vector<std::byte>& values, ScalarType type, std::size_t n) {
    sum += digest_of_values(keys, numbers, values.data(), n * scalar_bytes(type), type, n);
  };
  add(DigestKeys::of_coordinates(), vertices, block.xyz, schema_->coordinate_type, 3);
  std::vector<std::uint64_t> covered;
  for (std::uint32_t a = 0; a < schema_->arrays.size(); ++a) {
    const ArrayInfo& info = schema_->arrays[a];
    if (info.per_step) continue;
    std::span<const std::uint64_t> numbers = vertices;
    if (info.location == Location::cell) {
      covered.clear();
      add_covered(*schema_, a, block.cell_numbers, block.cell_blocks, covered);
      numbers = covered;
    }
    add(DigestKeys::of_array(a), numbers, block.arrays[a], info.type, info.components);
  }
  return sum;
}

}  // namespace shm
