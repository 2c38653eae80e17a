// Mesh: a whole mesh in memory, for callers who have the room. Convenience over Writer and Reader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"
#include "shm/writer.h"

namespace shm {

/// Vertices and cells in their own numbering, from 0. Values are raw bytes of the declared scalar
/// types in host order.
struct Mesh {
  Schema schema;
  std::vector<std::byte> xyz;                     ///< 3 coordinates for each vertex
  std::vector<std::uint32_t> cell_blocks;         ///< block index of each cell
  std::vector<std::uint64_t> corner_begin = {0};  ///< cells + 1 offsets into corners
  std::vector<std::uint64_t> corners;             ///< vertex numbers
  /// Values of static arrays, by array: one element for each vertex, or for each cell of a
  /// covered block in cell order. Stepped arrays: empty.
  std::vector<std::vector<std::byte>> arrays;
  /// Values of stepped arrays: [array][step], elements as in `arrays`; static arrays and steps
  /// without values: empty.
  std::vector<std::vector<std::vector<std::byte>>> steps;
  std::vector<double> step_times;
  std::vector<Extra> extras;
  bool operator==(const Mesh&) const = default;

  std::uint64_t vertex_count() const {
    return xyz.size() / (3 * scalar_bytes(schema.coordinate_type));
  }
  std::uint64_t cell_count() const { return cell_blocks.size(); }
};

/// Numbers of 32 or 64 bits that belong to somebody else.
class NumberSpan {
 public:
  NumberSpan() = default;
  NumberSpan(std::span<const std::uint32_t> numbers)
      : narrow_(numbers.data()), size_(numbers.size()) {}
  NumberSpan(std::span<const std::uint64_t> numbers)
      : wide_(numbers.data()), size_(numbers.size()) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  /// Must hold: i < size().
  std::uint64_t operator[](std::size_t i) const {
    return narrow_ != nullptr ? narrow_[i] : wide_[i];
  }

 private:
  const std::uint32_t* narrow_ = nullptr;
  const std::uint64_t* wide_ = nullptr;
  std::size_t size_ = 0;
};

/// Vertices and cells in arrays of somebody else, as in a Mesh. All is borrowed.
struct MeshArrays {
  std::span<const std::byte> xyz;  ///< 3 coordinates for each vertex
  std::uint64_t cells = 0;
  std::span<const std::uint32_t> cell_blocks;  ///< empty: all are of block 0
  NumberSpan corner_begin;  ///< empty: each cell has as many corners as its block says
  NumberSpan corners;
  std::vector<std::span<const std::byte>> arrays;  ///< as Mesh::arrays
};

/// Gives a Writer of `schema` a whole mesh: vertices are interleaved with cells and finalized as
/// early as possible (vertex compaction). Neither end_mesh() nor what comes behind it is called.
/// ErrorCode::misuse where sizes contradict each other, or numbers name what there is not. Takes 9
/// bytes for each vertex meanwhile.
SHM_API Result<void> add_mesh(Writer& writer, const Schema& schema, const MeshArrays& mesh);

/// Writes a whole mesh: vertices are interleaved with cells and finalized as early as possible
/// (vertex compaction). Except in Order::keep, references in extras are renumbered as a Reader
/// will see vertices and cells; cells are never moved but by the delay buffer. Sizes that
/// contradict each other are ErrorCode::misuse. Takes 16 bytes for each vertex and cell beside what
/// a Writer takes.
SHM_API Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh,
                                      const WriteOptions& options = {});

/// Reads a whole file. Order::keep: everything in the original numbering; else in the order of
/// the stream. Memory is that of the mesh; `limits` bound a hostile file.
SHM_API Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits = {},
                               const ReadOptions& options = {});

}  // namespace shm
