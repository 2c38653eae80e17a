// Mesh: a whole mesh in memory, for callers who have the room. Convenience over Writer and Reader.
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

/// Numbers of `type`, as they stand in memory, as numbers of type T: converted as static_cast does.
template <class T>
std::vector<T> numbers_as(ScalarType type, std::span<const std::byte> from) {
  std::vector<T> to;
  const auto convert = [&]<class From>(From) {
    to.resize(from.size() / sizeof(From));
    for (std::size_t i = 0; i < to.size(); ++i) {
      From value;
      std::memcpy(&value, from.data() + i * sizeof value, sizeof value);
      to[i] = static_cast<T>(value);
    }
  };
  switch (type) {
    case ScalarType::int8: convert(std::int8_t{}); break;
    case ScalarType::uint8: convert(std::uint8_t{}); break;
    case ScalarType::int16: convert(std::int16_t{}); break;
    case ScalarType::uint16: convert(std::uint16_t{}); break;
    case ScalarType::int32: convert(std::int32_t{}); break;
    case ScalarType::uint32: convert(std::uint32_t{}); break;
    case ScalarType::int64: convert(std::int64_t{}); break;
    case ScalarType::uint64: convert(std::uint64_t{}); break;
    case ScalarType::float32: convert(float{}); break;
    case ScalarType::float64: convert(double{}); break;
  }
  return to;
}

/// Vertices and cells in their own numbering, from 0. Values are raw bytes of the declared scalar
/// types in host order. A plain value: calls that change nothing may be made in several threads.
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

  /// Smallest x y z, largest x y z of finite coordinates; +inf and -inf where there are none.
  SHM_API std::array<double, 6> bounds() const;
  /// Three coordinates of each vertex, one vertex behind the other.
  template <class T>
  std::vector<T> points_as() const {
    return numbers_as<T>(schema.coordinate_type, xyz);
  }
  /// Corners of the cells of a block that have eight, as hexahedra do; none for other blocks.
  SHM_API std::vector<std::array<std::uint64_t, 8>> hexahedra(std::uint32_t block = 0) const;
  /// Index of the first array of that name there; nothing where there is none.
  SHM_API std::optional<std::size_t> find_array(Location location, std::string_view name) const;
  /// Values of an array, at a step where it has steps: components of one element together. None
  /// where there are none.
  template <class T>
  std::vector<T> values_as(std::size_t array, std::size_t step = 0) const {
    if (array >= schema.arrays.size()) return {};
    return numbers_as<T>(schema.arrays[array].type, values(array, step));
  }
  /// The same as they stand here.
  SHM_API std::span<const std::byte> values(std::size_t array, std::size_t step = 0) const;

  /// One block of hexahedra: coordinates of each vertex, and eight vertex numbers of each cell.
  SHM_API static Mesh of_hexahedra(std::span<const std::array<double, 3>> points,
                                   std::span<const std::array<std::uint64_t, 8>> hexahedra);
  /// Adds an array of all vertices or all cells, and returns its index. Whether there are as many
  /// values as there should be, write_mesh() looks at.
  template <class T>
  std::size_t add_array(std::string name, Location location, std::span<const T> values,
                        std::uint32_t components = 1) {
    const auto bytes = std::as_bytes(values);
    return add(std::move(name), location, scalar_type_of<T>(), components, bytes);
  }
  /// Adds values at a time step: of the array of that name and location, which is made where there
  /// is none.
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
  /// `count` numbers from `first` on, in `room` where they have 32 bits. Must hold: they are there.
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

/// Vertices and cells in arrays of somebody else, as in a Mesh: for Writer::add_mesh().
struct MeshArrays {
  std::span<const std::byte> xyz;  ///< 3 coordinates for each vertex
  std::uint64_t cells = 0;
  std::span<const std::uint32_t> cell_blocks;  ///< empty: all are of block 0
  NumberSpan corner_begin;  ///< empty: each cell has as many corners as its block says
  NumberSpan corners;
  std::vector<std::span<const std::byte>> arrays;  ///< as Mesh::arrays
};

/// Writes a whole mesh: vertices are interleaved with cells and finalized as early as possible
/// (vertex compaction). Except in Order::keep, references in extras are renumbered as a Reader
/// will see vertices and cells; cells are never moved but by the delay buffer. Sizes that
/// contradict each other are ErrorCode::misuse. Takes 16 bytes for each vertex and cell beside what
/// a Writer takes.
SHM_API Result<SizeReport> write_mesh(ByteSink& sink, const Mesh& mesh,
                                      const WriteOptions& options = {});

/// Reads a whole file. Order::keep: everything in the original numbering; else in the order of
/// the stream. Memory is that of the mesh and half as much, and of all corners twice where cells of
/// several shapes were moved by a delay; `limits` bound a hostile file. Of bytes in memory the
/// index tells how large the mesh will be, as for read_file().
SHM_API Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits = {},
                               const ReadOptions& options = {});
SHM_API Result<Mesh> read_mesh(MemorySource& source, const ReadLimits& limits = {},
                               const ReadOptions& options = {});

/// The same of files. A file appears whole or not at all; one that is there already stays, unless
/// it may be replaced. Errors name the file. Where the file can be sought in, its index tells how
/// large the mesh will be: reading takes the mesh, what a Reader takes, and 4 bytes for each vertex
/// and cell that comes out of order, in the end 12 (a million hexahedra with two fields: 1.3 times
/// the mesh).
SHM_API Result<SizeReport> write_file(const std::string& path, const Mesh& mesh,
                                      const WriteOptions& options = {},
                                      FileSink::Existing existing = FileSink::Existing::refuse);
SHM_API Result<Mesh> read_file(const std::string& path, const ReadLimits& limits = {},
                               const ReadOptions& options = {});

}  // namespace shm
