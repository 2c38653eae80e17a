// Copied vertices: the vertices of a group that have the same values, in all components, as an
// earlier vertex of the group (the source). If the cells of a mesh share no vertices, most vertices
// are copies, because the same coordinates occurred at a corner of an earlier cell. The distance
// from the source to the copy, in vertices, is stored, but no residuals of the copy.
// spec: "Values by terms"
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/binary.h"
#include "base/packing.h"

namespace shm {

/// The head that announces a list of copied vertices. The head of a component never has this value.
/// Frozen: part of the format.
inline constexpr std::uint8_t kCopiedVertices = 15;

class CopiedVertices {
 public:
  /// Largest distance between a copy and its source. Frozen: part of the format.
  static constexpr std::uint32_t kFarthest = std::uint32_t{1} << 16;

  bool empty() const { return back_.empty(); }
  void clear() { back_.clear(); }
  /// Returns the distance from the source to vertex `i` of the group; 0 if the vertex is not a
  /// copy. Precondition: the list is not empty.
  std::uint32_t back(std::size_t i) const { return back_[i]; }
  /// Returns how many of the `count` vertices from `first` on are not copies. Precondition: the
  /// list is not empty.
  std::size_t count_own(std::size_t first, std::size_t count) const;

  /// Encoding: finds the copies among `count` vertices. The values of a vertex are `bytes` bytes.
  /// `stride`: number of bytes from a vertex to the next. If few vertices are copies, the list
  /// becomes empty.
  void find(const std::byte* values, std::size_t stride, std::size_t bytes, std::size_t count);
  /// Encoding: writes the list. Precondition: the list is not empty.
  void put(ByteWriter& out, std::vector<std::byte>& scratch, ZstdCompressor& zstd) const;
  /// Encoding: sets the residuals of copies to 0, so that they do not count in estimates of sizes.
  /// Does nothing if the list is empty.
  void clear_copies(std::span<std::uint64_t> residuals) const;
  /// Encoding: removes the residuals of copies. Does nothing if the list is empty.
  void remove_copies(std::vector<std::uint64_t>& residuals) const;

  /// Decoding: reads the list of `count` vertices, after kCopiedVertices has been read. Returns
  /// false if the data is damaged.
  bool get(ByteReader& in, std::uint64_t count, std::vector<std::byte>& scratch,
           ZstdDecompressor& zstd);
  /// Decoding: `residuals` begins with the residuals of the vertices that are not copies. Moves
  /// each residual to the position of its vertex. The residual of a copy becomes 0. `first`: number
  /// of vertices of the group before the first one.
  void insert_copies(std::size_t first, std::span<std::uint64_t> residuals) const;

 private:
  std::vector<std::uint32_t> back_;  // distances, see back(); empty if the group has no copies
};

}  // namespace shm
