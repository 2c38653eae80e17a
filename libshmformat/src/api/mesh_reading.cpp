// read_mesh() and read_file(): read a whole file as a Mesh.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "api/compact_numbers.h"
#include "api/mesh_parts.h"
#include "base/errors.h"
#include "random/indexed_file.h"
#include "shm/mesh.h"
#include "shm/summary.h"

namespace shm {
namespace {

/// Permutes elements of `stride` bytes in place: the old element from[i] becomes element i.
/// Precondition: `from` contains each number from 0 to its size - 1 exactly once.
void move_elements(void* elements, const CompactNumbers& from, std::size_t stride) {
  if (stride == 0) return;
  auto* const bytes = static_cast<std::byte*>(elements);
  const auto element = [&](std::size_t i) { return bytes + i * stride; };
  std::vector<std::byte> first(stride);  // first element of a cycle of the permutation
  std::vector<bool> moved(from.size());
  for (std::size_t begin = 0; begin < from.size(); ++begin) {
    if (moved[begin] || from[begin] == begin) continue;
    std::memcpy(first.data(), element(begin), stride);
    std::size_t to = begin;
    for (auto next = static_cast<std::size_t>(from[to]); next != begin;
         next = static_cast<std::size_t>(from[to])) {
      std::memcpy(element(to), element(next), stride);
      moved[to] = true;
      to = next;
    }
    std::memcpy(element(to), first.data(), stride);
    moved[to] = true;
  }
}

/// Returns the number of elements to allocate memory for now. `size` elements are needed now, and
/// `expected` elements are needed in total according to the index. Because the index may be wrong,
/// the result is at most max(min(256 * size, 2^24), 4 * size).
std::uint64_t believed(std::uint64_t size, std::uint64_t expected) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::size_t>::max() / 256;
  // Above this number of elements, the index is trusted only up to 4 * size.
  constexpr std::uint64_t kMuch = std::uint64_t{1} << 24;
  if (size >= expected || expected > kMost) return size;
  return std::min(expected, std::max(std::min(size * 256, kMuch), size * 4));
}

/// Reserves memory for `size` elements. If the expected number of elements can be trusted, reserves
/// memory for all of them in one allocation, since repeated growth would need twice the memory and
/// fragment the heap.
template <class Values>
void make_room(Values& values, std::uint64_t size, std::uint64_t expected) {
  if (size <= values.capacity()) return;
  const std::uint64_t room = believed(size, expected);
  if (room > size) values.reserve(static_cast<std::size_t>(room));
}

template <class T>
void add(std::vector<T>& to, const std::vector<T>& more, std::uint64_t expected) {
  make_room(to, to.size() + more.size(), expected);
  to.insert(to.end(), more.begin(), more.end());
}

/// Numbers of vertices or cells, in the order in which they are read. While this sequence is 0, 1,
/// 2, ..., only its length is stored.
class ComingNumbers {
 public:
  /// Adds numbers. `expected` is the expected total count of numbers, or 0 if unknown.
  void add(const std::vector<std::uint64_t>& numbers, std::uint64_t expected) {
    for (const std::uint64_t number : numbers) {
      if (in_order_ && number == count_) {
        ++count_;
        continue;
      }
      if (in_order_) {
        in_order_ = false;
        numbers_ = CompactNumbers::counted(static_cast<std::size_t>(count_));
        make_room(numbers_, count_ + numbers.size(), expected);
      }
      numbers_.push_back(number);
    }
  }
  bool in_order() const { return in_order_; }
  /// Moves the list of numbers, in the order in which they were read, to the caller. Precondition:
  /// in_order() is false.
  CompactNumbers take() { return std::exchange(numbers_, {}); }
  /// Returns the inverse permutation of the list (element i of the result is the index of the
  /// number i in the list), and empties the list. Fails unless the list contains each number from 0
  /// to its length - 1 exactly once. Precondition: in_order() is false.
  Result<CompactNumbers> positions(const char* kind) {
    const CompactNumbers numbers = take();
    CompactNumbers positions = CompactNumbers::zeros(numbers.size());
    std::vector<bool> seen(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const std::uint64_t number = numbers[i];
      if (number >= numbers.size() || seen[static_cast<std::size_t>(number)])
        return corrupt(std::string(kind) + " numbers are not all the numbers below " +
                           std::to_string(numbers.size()),
                       "mesh");
      seen[static_cast<std::size_t>(number)] = true;
      positions.set(static_cast<std::size_t>(number), i);
    }
    return positions;
  }

 private:
  bool in_order_ = true;
  std::uint64_t count_ = 0;  // length of the list as long as it consists of 0, 1, 2, ...
  CompactNumbers numbers_;
};

/// Stores the values of vertices that are read in any order. Each value is stored in its final
/// position immediately. The number of vertices must be known in advance.
class VertexPlaces {
 public:
  explicit VertexPlaces(std::uint64_t vertices) : taken_(static_cast<std::size_t>(vertices)) {}
  /// Records the next vertex numbers. If a number is too large or occurs twice, are_taken() returns
  /// false from then on.
  template <class Numbers>
  void take(const Numbers& numbers) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto number = static_cast<std::size_t>(numbers[i]);
      if (numbers[i] >= taken_.size() || taken_[number]) {
        make_sense_ = false;
        return;
      }
      taken_[number] = true;
      ++count_;
    }
  }
  /// Returns true if each vertex number has been recorded exactly once.
  bool are_taken() const { return make_sense_ && count_ == taken_.size(); }
  /// Scatters `values`: copies the values of vertex i to index numbers[i] of `all`. Each vertex has
  /// `stride` bytes. Precondition: `numbers` were passed to the most recent call to take().
  template <class Numbers>
  void put(const Numbers& numbers, const std::vector<std::byte>& values, std::size_t stride,
           std::vector<std::byte>& all) const {
    if (!make_sense_ || values.empty()) return;
    switch (stride) {
      case 12: return put_as<12>(numbers, values.data(), stride, all.data());
      case 24: return put_as<24>(numbers, values.data(), stride, all.data());
      default: return put_as<0>(numbers, values.data(), stride, all.data());
    }
  }

 private:
  template <std::size_t kStride, class Numbers>
  static void put_as(const Numbers& numbers, const std::byte* values, std::size_t any,
                     std::byte* all) {
    const std::size_t stride = kStride > 0 ? kStride : any;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      std::memcpy(all + static_cast<std::size_t>(numbers[i]) * stride, values + i * stride, stride);
  }

  std::vector<bool> taken_;
  std::size_t count_ = 0;
  bool make_sense_ = true;
};

/// Size of a mesh according to the index of its file; empty if unknown.
struct ToldSizes {
  std::uint64_t vertices = 0;
  std::vector<std::uint64_t> block_cells;
};

ToldSizes told_sizes(RandomSource& source, const ReadLimits& limits) {
  IndexedFile indexed(source, limits);
  if (!indexed.open() || !indexed.expect_totals()) return {};
  return {indexed.index().vertices, indexed.index().block_cells};
}

/// Builds a Mesh from the items of a file, which are added in coding order.
class MeshCollector {
 public:
  MeshCollector(const Schema& schema, const ToldSizes& expected) {
    mesh_.schema = schema;
    for (std::size_t b = 0; b < schema.blocks.size() && b < expected.block_cells.size(); ++b) {
      told_cells_ += expected.block_cells[b];
      told_corners_ += expected.block_cells[b] * schema.blocks[b].nodes_per_cell;
    }
    if (expected.vertices <= kMostTold) told_vertices_ = expected.vertices;
    for (std::size_t a = 0; a < schema.arrays.size(); ++a)
      told_array_bytes_.push_back(told_elements(a, expected) * stride_of(schema.arrays[a]));
    vertex_columns_.push_back({std::nullopt, 3 * scalar_bytes(schema.coordinate_type)});
    for (std::size_t a = 0; a < schema.arrays.size(); ++a) {
      if (schema.arrays[a].location != Location::point) continue;
      if (schema.arrays[a].per_step)
        may_have_places_ = false;
      else
        vertex_columns_.push_back({a, stride_of(schema.arrays[a])});
    }
    mesh_.arrays.resize(schema.arrays.size());
    mesh_.steps.resize(schema.arrays.size());
  }

  void take(Item& item) {
    if (auto* block = std::get_if<MeshBlock>(&item)) take(*block);
    if (auto* piece = std::get_if<StepPiece>(&item)) take(*piece);
    if (const auto* times = std::get_if<StepTimes>(&item))
      mesh_.step_times.insert(mesh_.step_times.end(), times->times.begin(), times->times.end());
    if (auto* extra = std::get_if<Extra>(&item)) mesh_.extras.push_back(std::move(*extra));
  }
  /// Sorts vertices and cells by their numbers and returns the mesh.
  Result<Mesh> finish();

 private:
  void take(const MeshBlock& block) {
    const std::uint64_t base = mesh_.corners.size();
    take_vertices(block);
    cells_.add(block.cell_numbers, told_cells_);
    add(mesh_.cell_blocks, block.cell_blocks, told_cells_);
    add(mesh_.corners, block.corners, told_corners_);
    if (!block.corner_begin.empty()) {
      begin_.assign(block.corner_begin.begin() + 1, block.corner_begin.end());
      for (std::uint64_t& begin : begin_) begin += base;
      add(mesh_.corner_begin, begin_, told_cells_ + 1);
    }
    for (std::size_t a = 0; a < block.arrays.size(); ++a)
      if (mesh_.schema.arrays[a].location == Location::cell)
        add(mesh_.arrays[a], block.arrays[a], told_array_bytes_[a]);
  }
  void take_vertices(const MeshBlock& block);
  /// Values of vertices: the coordinates, or a static point array.
  struct VertexColumn {
    std::optional<std::size_t> array;  // index of the point array; nullopt for the coordinates
    std::size_t stride = 0;
  };
  /// Returns the values of a column (the coordinates or a point array) in a mesh or a block.
  template <class Values>
  static auto& values_of(Values& from, const VertexColumn& column) {
    return column.array ? from.arrays[*column.array] : from.xyz;
  }
  void give_places();
  void take(const StepPiece& piece) {
    auto& steps = mesh_.steps[piece.array];
    if (steps.size() <= piece.step) steps.resize(static_cast<std::size_t>(piece.step) + 1);
    add(steps[static_cast<std::size_t>(piece.step)], piece.values, told_array_bytes_[piece.array]);
  }
  Result<void> reorder_vertices();
  Result<void> reorder_cells();
  void reorder_corners(const CompactNumbers& from);
  /// Sorts the values of an array: the old element from[i] becomes element i.
  void reorder(std::size_t array, const CompactNumbers& from);

  std::uint64_t told_elements(std::size_t array, const ToldSizes& expected) const;

  Mesh mesh_;
  ComingNumbers vertices_, cells_;
  // Final position of each vertex. Once this is set, vertices_ is not used any more.
  std::optional<VertexPlaces> places_;
  // False if a point array has steps. Point data is then sorted at the end, not while it is read.
  bool may_have_places_ = true;
  std::vector<VertexColumn> vertex_columns_;
  std::vector<std::uint64_t> begin_;  // corner_begin of the cells of the current block
  // Counts in the index that exceed this value are ignored, since products of such counts could
  // overflow.
  static constexpr std::uint64_t kMostTold = std::uint64_t{1} << 40;
  std::uint64_t told_vertices_ = 0, told_cells_ = 0, told_corners_ = 0;
  // Size in bytes of all elements of each array, according to the index.
  std::vector<std::uint64_t> told_array_bytes_;
};

std::uint64_t MeshCollector::told_elements(std::size_t array, const ToldSizes& expected) const {
  return elements_of(mesh_.schema, array, expected.vertices, expected.block_cells);
}

void MeshCollector::take_vertices(const MeshBlock& block) {
  if (places_) {
    places_->take(block.vertex_numbers);
    for (const VertexColumn& column : vertex_columns_)
      places_->put(block.vertex_numbers, values_of(block, column), column.stride,
                   values_of(mesh_, column));
    return;
  }
  vertices_.add(block.vertex_numbers, told_vertices_);
  for (const VertexColumn& column : vertex_columns_)
    add(values_of(mesh_, column), values_of(block, column), told_vertices_ * column.stride);
  if (may_have_places_ && !vertices_.in_order()) give_places();
}

/// Creates places_ if the vertex count in the index can be trusted.
void MeshCollector::give_places() {
  for (const VertexColumn& column : vertex_columns_) {
    const std::uint64_t expected = told_vertices_ * column.stride;
    if (expected == 0 || believed(values_of(mesh_, column).size(), expected) != expected) return;
  }
  const CompactNumbers numbers = vertices_.take();
  places_.emplace(told_vertices_);
  places_->take(numbers);
  for (const VertexColumn& column : vertex_columns_) {
    auto& all = values_of(mesh_, column);
    const auto values = std::exchange(all, {});
    all.resize(static_cast<std::size_t>(told_vertices_ * column.stride));
    places_->put(numbers, values, column.stride, all);
  }
}

void MeshCollector::reorder(std::size_t array, const CompactNumbers& from) {
  const std::size_t stride = stride_of(mesh_.schema.arrays[array]);
  if (!mesh_.arrays[array].empty()) move_elements(mesh_.arrays[array].data(), from, stride);
  for (auto& values : mesh_.steps[array])
    if (!values.empty()) move_elements(values.data(), from, stride);
}

Result<void> MeshCollector::reorder_vertices() {
  const auto from = vertices_.positions("vertex");
  if (!from) return from.error();
  move_elements(mesh_.xyz.data(), *from, 3 * scalar_bytes(mesh_.schema.coordinate_type));
  for (std::size_t a = 0; a < mesh_.arrays.size(); ++a)
    if (mesh_.schema.arrays[a].location == Location::point) reorder(a, *from);
  return {};
}

void MeshCollector::reorder_corners(const CompactNumbers& from) {
  const std::size_t cells = from.size();
  const std::size_t nodes = cells == 0 ? 0 : mesh_.corners.size() / cells;
  bool alike = true;  // true if all cells have the same number of corners
  for (std::size_t c = 0; c <= cells; ++c) alike = alike && mesh_.corner_begin[c] == c * nodes;
  if (alike) {
    move_elements(mesh_.corners.data(), from, nodes * sizeof(std::uint64_t));
    return;
  }
  const auto coded_begin = std::exchange(mesh_.corner_begin, {0});
  const auto coded_corners = std::exchange(mesh_.corners, {});
  mesh_.corner_begin.reserve(coded_begin.size());
  mesh_.corners.reserve(coded_corners.size());
  for (std::size_t c = 0; c < cells; ++c) {
    const auto coded = static_cast<std::size_t>(from[c]);
    const auto begin = coded_corners.begin() + static_cast<std::ptrdiff_t>(coded_begin[coded]);
    const auto end = coded_corners.begin() + static_cast<std::ptrdiff_t>(coded_begin[coded + 1]);
    mesh_.corners.insert(mesh_.corners.end(), begin, end);
    mesh_.corner_begin.push_back(mesh_.corners.size());
  }
}

Result<void> MeshCollector::reorder_cells() {
  const auto from = cells_.positions("cell");
  if (!from) return from.error();
  const std::vector<std::uint32_t> coded_blocks = mesh_.cell_blocks;
  reorder_corners(*from);
  move_elements(mesh_.cell_blocks.data(), *from, sizeof(std::uint32_t));
  for (std::size_t a = 0; a < mesh_.arrays.size(); ++a) {
    if (mesh_.schema.arrays[a].location != Location::cell) continue;
    if (mesh_.schema.arrays[a].blocks.empty()) {
      reorder(a, *from);
      continue;
    }
    CompactNumbers element = CompactNumbers::zeros(coded_blocks.size()), from_element;
    std::uint64_t count = 0;
    for (std::size_t c = 0; c < coded_blocks.size(); ++c)
      if (mesh_.schema.array_covers(a, coded_blocks[c])) element.set(c, count++);
    for (std::size_t c = 0; c < from->size(); ++c)
      if (mesh_.schema.array_covers(a, mesh_.cell_blocks[c]))
        from_element.push_back(element[static_cast<std::size_t>((*from)[c])]);
    reorder(a, from_element);
  }
  return {};
}

Result<Mesh> MeshCollector::finish() {
  if (places_) {
    if (!places_->are_taken()) return corrupt("vertex numbers do not match the index", "mesh");
  } else if (!vertices_.in_order()) {
    if (auto status = reorder_vertices(); !status) return status.error();
  }
  if (!cells_.in_order())
    if (auto status = reorder_cells(); !status) return status.error();
  return std::move(mesh_);
}

Result<Mesh> read(ByteSource& source, const ReadLimits& limits, const ReadOptions& options,
                  const ToldSizes& expected) {
  std::optional<MeshCollector> collector;
  {
    auto reader = Reader::open(source, limits, options);
    if (!reader) return reader.error();
    collector.emplace(reader->schema(), expected);
    while (true) {
      auto item = reader->next();
      if (!item) return item.error();
      if (*item == nullptr) break;
      collector->take(**item);
    }
  }
  return collector->finish();
}

/// Reads a file of which `anywhere` allows random access, unless it is null.
Result<Mesh> read_whole(ByteSource& source, RandomSource* anywhere, const ReadLimits& limits,
                        ReadOptions options) {
  if (anywhere == nullptr) return read(source, limits, options, {});
  if (const auto bytes = bytes_of_file(*anywhere)) options.file_bytes = *bytes;
  return read(source, limits, options, told_sizes(*anywhere, limits));
}

}  // namespace

Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits, const ReadOptions& options) {
  return read(source, limits, options, {});
}

Result<Mesh> read_mesh(MemorySource& source, const ReadLimits& limits, const ReadOptions& options) {
  MemoryRandomSource anywhere(source.left());
  return read_whole(source, &anywhere, limits, options);
}

Result<Mesh> read_file(const std::string& path, const ReadLimits& limits,
                       const ReadOptions& options) {
  auto source = FileSource::open(path);
  if (!source) return source.error();
  const auto anywhere = (*source)->anywhere();
  return of_file(read_whole(**source, anywhere ? anywhere->get() : nullptr, limits, options), path);
}

}  // namespace shm
