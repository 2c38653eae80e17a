// Digests of decoded content. Checksums cover coded bytes, so they cannot show that a decoder
// computes values other than those that the writer coded. The digest of a chunk covers the
// vertices, cells and values to which the chunk decodes. The digest of a mesh is the sum of the
// digests of its chunks. Each value counts together with the number of its element, so the digest
// does not depend on the order in which elements are coded.
// spec: "Digests"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/blocks.h"
#include "shm/schema.h"

namespace shm {

/// End of an error message about content that differs from its digest.
inline constexpr const char* kNotTheDigest =
    " do not match their digest. The checksums match, so this decoder computes other values than "
    "the "
    "program that wrote the file";

/// Number of an element that digests leave out. Vertices that an earlier segment owns have it.
inline constexpr std::uint64_t kNoNumber = ~std::uint64_t{0};

/// Returns the digest of a word with this key. Different words have different digests.
constexpr std::uint64_t digest_of_word(std::uint64_t key, std::uint64_t word) {
  std::uint64_t x = (word ^ key) * 0xff51afd7ed558ccdu;
  x = (x ^ x >> 32) * 0xc4ceb9fe1a85ec53u;
  return x ^ x >> 32;
}

/// Keys of the words of one set of data. The words of an element have consecutive keys.
class DigestKeys {
 public:
  static DigestKeys of_cells() { return {0, 0}; }
  static DigestKeys of_coordinates() { return {1, 0}; }
  static DigestKeys of_step_times() { return {2, 0}; }
  /// `step`: 0 for a static array.
  static DigestKeys of_array(std::uint32_t array, std::uint64_t step = 0) {
    return {3 + std::uint64_t{array}, step};
  }

  /// Returns the key of the first word of an element.
  std::uint64_t first(std::uint64_t number) const { return seed_ + (number << 20) * kNext; }
  /// Difference between the keys of consecutive words.
  static constexpr std::uint64_t kNext = 0x9e3779b97f4a7c15;

 private:
  DigestKeys(std::uint64_t topic, std::uint64_t step)
      : seed_(digest_of_word(digest_of_word(0, topic), step)) {}

  std::uint64_t seed_;
};

/// Returns the digest of values: each scalar is a word. Element i has number numbers[i] and
/// `components` scalars, which begin at byte i * stride of `values`, in host byte order.
std::uint64_t digest_of_values(const DigestKeys& keys, std::span<const std::uint64_t> numbers,
                               const std::byte* values, std::size_t stride, ScalarType type,
                               std::size_t components);
/// Returns the digest of the times of step `first` and the steps after it. Each time is a word.
std::uint64_t digest_of_step_times(std::span<const double> times, std::uint64_t first);

/// Computes digests of cells. The first word of a cell is its block, with the number of its nodes
/// in the upper half. The other words are the vertex numbers of its nodes. If the file does not
/// keep the order of corners, the words of all corners of a hexahedron have the same key.
class CellDigests {
 public:
  explicit CellDigests(const Schema& schema);

  /// Returns the sum of the digests of the words of a cell. digest_of_node(i, key) returns that of
  /// the word of node i, which has this key.
  template <class DigestOfNode>
  std::uint64_t of(std::uint64_t cell, std::uint32_t block, std::size_t nodes,
                   DigestOfNode&& digest_of_node) const {
    std::uint64_t key = keys_.first(cell);
    std::uint64_t sum = digest_of_word(key, block | std::uint64_t{nodes} << 32);
    key += DigestKeys::kNext;
    for (std::size_t i = 0; i < nodes; ++i, key += steps_[block]) sum += digest_of_node(i, key);
    return sum;
  }

 private:
  DigestKeys keys_ = DigestKeys::of_cells();
  /// By block: difference between the keys of consecutive nodes; 0 if the corners of its cells may
  /// be rotated.
  std::vector<std::uint64_t> steps_;
};

/// Computes the digest of a group from its decoded blocks.
class BlockDigests {
 public:
  /// `schema` must outlive this object.
  explicit BlockDigests(const Schema& schema) : schema_(&schema), cells_(schema) {}

  /// Returns the digest of a block that has all values and numbers.
  std::uint64_t of(const MeshBlock& block);

 private:
  const Schema* schema_;
  CellDigests cells_;
  std::vector<std::uint64_t> numbers_;
};

/// Appends to `numbers` the numbers of those cells that the array covers. `cells` and `blocks`: the
/// number and the block of each cell.
void add_covered(const Schema& schema, std::uint32_t array, std::span<const std::uint64_t> cells,
                 std::span<const std::uint32_t> blocks, std::vector<std::uint64_t>& numbers);

}  // namespace shm
