// Mesh: a whole mesh in memory, and convenience functions that write and read it.
//   auto mesh = shm::read_file("run.shm");
//   if (!mesh) return complain(mesh.error().message());
//   const auto t = mesh->find_array(shm::Location::point, "temperature");
//   if (t) plot(mesh->points_as<float>(), mesh->values_as<float>(*t));
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "shm/io.h"
#include "shm/reader.h"
#include "shm/schema.h"
#include "shm/writer.h"

namespace shm {

/// A mesh whose vertices and cells are numbered from 0. Values are raw bytes of the declared scalar
/// types in host byte order. Several threads may call const members of the same object at the same
/// time.
struct Mesh {
  Schema schema;
  std::vector<std::byte> xyz;              ///< 3 coordinates for each vertex
  std::vector<std::uint32_t> cell_blocks;  ///< block index of each cell
  std::vector<std::uint64_t> corner_begin = {
      0};  ///< corners of cell c: corners[corner_begin[c]] to corners[corner_begin[c + 1] - 1]
  std::vector<std::uint64_t> corners;  ///< vertex numbers of the corners
  /// arrays[a] contains the values of the static array with index a in Schema::arrays. It is empty
  /// if that array is stepped. A point array has one element per vertex. A cell array has one
  /// element per cell of the blocks that it covers, in cell order.
  std::vector<std::vector<std::byte>> arrays;
  /// steps[a][s] contains the values of the stepped array with index a at step s. A stepped point
  /// or cell array has values for the same elements as a static array. Other arrays have
  /// ArrayInfo::elements elements. steps[a][s] is empty if the array is static or has no values at
  /// that step.
  std::vector<std::vector<std::vector<std::byte>>> steps;
  std::vector<double> step_times;
  std::vector<Extra> extras;
  bool operator==(const Mesh&) const = default;

  std::uint64_t vertex_count() const {
    return xyz.size() / (3 * scalar_bytes(schema.coordinate_type));
  }
  std::uint64_t cell_count() const { return cell_blocks.size(); }

  /// Returns the bounding box: the minimum x, y, z, then the maximum x, y, z. Non-finite
  /// coordinates are ignored. If no coordinate is finite, the minimum is +inf and the maximum is
  /// -inf.
  SHM_API std::array<double, 6> bounds() const;
  /// Returns the coordinates x y z of all vertices, vertex after vertex.
  template <class T>
  std::vector<T> points_as() const {
    return numbers_as<T>(schema.coordinate_type, xyz);
  }
  /// Returns the corners of the cells of a block with eight nodes per cell, e.g. hexahedra. Empty
  /// for other blocks.
  SHM_API std::vector<std::array<std::uint64_t, 8>> hexahedra(std::uint32_t block = 0) const;
  /// Returns the index of the first array with the given name and location, or std::nullopt if no
  /// such array exists.
  SHM_API std::optional<std::size_t> find_array(Location location, std::string_view name) const;
  /// Returns the values of an array. If the array is stepped, returns its values at step `step`.
  /// The components of an element are stored together. Empty if no such values exist.
  template <class T>
  std::vector<T> values_as(std::size_t array, std::size_t step = 0) const {
    if (array >= schema.arrays.size()) return {};
    return numbers_as<T>(schema.arrays[array].type, values(array, step));
  }
  /// Returns the same values as values_as(), but as raw bytes of the array's type.
  SHM_API std::span<const std::byte> values(std::size_t array, std::size_t step = 0) const;

  /// Makes a mesh with one block of hexahedra from the coordinates of each vertex and the eight
  /// vertex numbers of each cell.
  SHM_API static Mesh of_hexahedra(std::span<const std::array<double, 3>> points,
                                   std::span<const std::array<std::uint64_t, 8>> hexahedra);
  /// Adds an array with values for all vertices or all cells, and returns the index of the array.
  /// write_mesh() checks the number of values.
  template <class T>
  std::size_t add_array(std::string name, Location location, std::span<const T> values,
                        std::uint32_t components = 1) {
    const auto bytes = std::as_bytes(values);
    return add(std::move(name), location, scalar_type_of<T>(), components, bytes);
  }
  /// Adds the values of one time step to the stepped array with the given name and location.
  /// Creates the array if it does not exist. The first values that are added determine the number
  /// of elements of an array that is neither on points nor on cells.
  template <class T>
  void add_step(const std::string& name, Location location, std::size_t step,
                std::span<const T> values, std::uint32_t components = 1) {
    add_at(name, location, scalar_type_of<T>(), components, step, std::as_bytes(values));
  }

 private:
  SHM_API std::size_t add(std::string name, Location location, ScalarType type,
                          std::uint32_t components, std::span<const std::byte> values);
  SHM_API void add_at(const std::string& name, Location location, ScalarType type,
                      std::uint32_t components, std::size_t step,
                      std::span<const std::byte> values);
};

/// View of 32-bit or 64-bit numbers that the caller owns.
class NumberSpan {
 public:
  NumberSpan() = default;
  NumberSpan(std::span<const std::uint32_t> numbers)
      : narrow_(numbers.data()), size_(numbers.size()) {}
  NumberSpan(std::span<const std::uint64_t> numbers)
      : wide_(numbers.data()), size_(numbers.size()) {}

  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  /// Precondition: i < size().
  std::uint64_t operator[](std::size_t i) const {
    return narrow_ != nullptr ? narrow_[i] : wide_[i];
  }
  /// Returns `count` numbers, starting at index `first`. If the view contains 32-bit numbers, they
  /// are converted to 64 bits and stored in `room`, and the result refers to `room`. Precondition:
  /// first + count <= size().
  std::span<const std::uint64_t> part(std::size_t first, std::size_t count,
                                      std::vector<std::uint64_t>& room) const {
    if (narrow_ == nullptr) return {wide_ + first, count};
    room.assign(narrow_ + first, narrow_ + first + count);
    return room;
  }

 private:
  const std::uint32_t* narrow_ = nullptr;
  const std::uint64_t* wide_ = nullptr;
  std::size_t size_ = 0;
};

/// Mesh whose arrays the caller owns, in the layout of Mesh. Used by Writer::add_mesh().
struct MeshArrays {
  std::span<const std::byte> xyz;  ///< 3 coordinates for each vertex
  std::uint64_t cells = 0;
  /// Block index of each cell. If empty, all cells are in block 0.
  std::span<const std::uint32_t> cell_blocks;
  NumberSpan corner_begin;  ///< As Mesh::corner_begin. If empty, each cell has the fixed number of
                            ///< corners (nodes_per_cell) that its block declares.
  NumberSpan corners;
  std::vector<std::span<const std::byte>> arrays;  ///< values of static arrays, as in Mesh::arrays
};

/// Writes a whole mesh. The vertices are interleaved with the cells and finalized as early as
/// possible (vertex compaction). Cells keep their order unless there is a delay buffer. Unless the
/// order is Order::keep, vertex and cell numbers in extras are changed to the numbers that a Reader
/// will return. Fails with ErrorCode::misuse if the sizes of the arrays are inconsistent. Needs 16
/// bytes per vertex and cell in addition to the memory of a Writer.
SHM_API Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh,
                                      const WriteOptions& options = {});

/// Reads a whole file. With Order::keep all vertices and cells have their original numbers,
/// otherwise their stream numbers. Needs one and a half times the memory of the mesh, plus a second
/// copy of all corners if a delay buffer reordered cells of several shapes. `limits` protect
/// against hostile files. If the source is a MemorySource, the function reads the size of the mesh
/// from the index in advance, as read_file() does.
SHM_API Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits = {},
                               const ReadOptions& options = {});
SHM_API Result<Mesh> read_mesh(MemorySource& source, const ReadLimits& limits = {},
                               const ReadOptions& options = {});

/// Write and read a file, as write_mesh() and read_mesh() do. write_file() creates the complete
/// file or no file. It replaces an existing file only if `existing` allows it. Errors contain the
/// file name. If the file is seekable, read_file() reads the size of the mesh from the index in
/// advance. Reading then needs the memory of the mesh and of a Reader. Each vertex and cell that
/// arrives out of order needs 4 more bytes while the file is read, and 12 more bytes at the end,
/// when the mesh is sorted. For a million hexahedra with two fields, the total is 1.3 times the
/// size of the mesh.
SHM_API Result<SizeReport> write_file(const std::string& path, const Mesh& mesh,
                                      const WriteOptions& options = {},
                                      FileSink::Existing existing = FileSink::Existing::refuse);
SHM_API Result<Mesh> read_file(const std::string& path, const ReadLimits& limits = {},
                               const ReadOptions& options = {});

}  // namespace shm
