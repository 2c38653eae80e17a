// read_mesh() and read_file(): a whole file as a Mesh.
#include <algorithm>
#include <cstring>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "access/indexed_file.h"
#include "api/compact_numbers.h"
#include "api/mesh_parts.h"
#include "shm/mesh.h"

namespace shm {
namespace {

Error corrupt(std::string detail) {
  return Error{ErrorCode::corrupt, std::move(detail), "mesh", kNoOffset, {}};
}

/// What element from[i] was becomes element i, of `stride` bytes, for all i, without a second copy.
/// Must hold: `from` is all numbers from 0 on, each once.
void move_elements(void* elements, const CompactNumbers& from, std::size_t stride) {
  if (stride == 0) return;
  auto* const bytes = static_cast<std::byte*>(elements);
  const auto element = [&](std::size_t i) { return bytes + i * stride; };
  std::vector<std::byte> first(stride);  // of a cycle
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

/// What is told may be a lie: it is believed as far as a multiple of what has come, a small one
/// where that is much. Of `size` elements that have come and `told` in all, those for which room is
/// made.
std::uint64_t believed(std::uint64_t size, std::uint64_t told) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::size_t>::max() / 256;
  constexpr std::uint64_t kMuch = std::uint64_t{1} << 24;  // elements
  if (size >= told || told > kMost) return size;
  return std::min(told, std::max(std::min(size * 256, kMuch), size * 4));
}

/// Room for `size` elements, and for all that are told, at once: what grows step by step is there
/// twice, and leaves holes.
template <class Values>
void make_room(Values& values, std::uint64_t size, std::uint64_t told) {
  if (size <= values.capacity()) return;
  const std::uint64_t room = believed(size, told);
  if (room > size) values.reserve(static_cast<std::size_t>(room));
}

template <class T>
void add(std::vector<T>& to, const std::vector<T>& more, std::uint64_t told) {
  make_room(to, to.size() + more.size(), told);
  to.insert(to.end(), more.begin(), more.end());
}

/// The numbers of vertices or cells as they come. Nothing is kept while they come in order.
class ComingNumbers {
 public:
  /// `told`: how many will come, or 0.
  void add(const std::vector<std::uint64_t>& numbers, std::uint64_t told) {
    for (const std::uint64_t number : numbers) {
      if (in_order_ && number == count_) {
        ++count_;
        continue;
      }
      if (in_order_) {
        in_order_ = false;
        numbers_ = CompactNumbers::counted(static_cast<std::size_t>(count_));
        make_room(numbers_, count_ + numbers.size(), told);
      }
      numbers_.push_back(number);
    }
  }
  bool in_order() const { return in_order_; }
  /// As they came; they are given up. Must hold: not in_order().
  CompactNumbers take() { return std::exchange(numbers_, {}); }
  /// Where each number stands; they are given up for that. Fails unless they are 0, 1 and so on.
  /// Must hold: not in_order().
  Result<CompactNumbers> positions(const char* kind) {
    const CompactNumbers numbers = take();
    CompactNumbers positions = CompactNumbers::zeros(numbers.size());
    std::vector<bool> seen(numbers.size());
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const std::uint64_t number = numbers[i];
      if (number >= numbers.size() || seen[static_cast<std::size_t>(number)])
        return corrupt(std::string(kind) + " numbers are not 0 to " +
                       std::to_string(numbers.size()));
      seen[static_cast<std::size_t>(number)] = true;
      positions.set(static_cast<std::size_t>(number), i);
    }
    return positions;
  }

 private:
  bool in_order_ = true;
  std::uint64_t count_ = 0;  // while they are in order
  CompactNumbers numbers_;
};

/// The places of vertices that come out of order, where it is known how many there will be: each
/// value goes to its place as it comes.
class VertexPlaces {
 public:
  explicit VertexPlaces(std::uint64_t vertices) : taken_(static_cast<std::size_t>(vertices)) {}
  /// The next ones; not where one of them has no place, or one that is taken.
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
  /// Each has come, once.
  bool are_taken() const { return make_sense_ && count_ == taken_.size(); }
  /// Must hold: the numbers were taken last. `values`: `stride` bytes of each.
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

/// How large a mesh will be, as the index of its file tells; nothing where nobody does.
struct ToldSizes {
  std::uint64_t vertices = 0;
  std::vector<std::uint64_t> block_cells;
};

ToldSizes told_sizes(RandomSource& source, const ReadLimits& limits) {
  IndexedFile indexed(source, limits);
  if (!indexed.open() || !indexed.expect_totals()) return {};
  return {indexed.index().vertices, indexed.index().block_cells};
}
ToldSizes told_sizes(const FileSource& file, const ReadLimits& limits) {
  const auto source = file.anywhere();
  return source ? told_sizes(**source, limits) : ToldSizes();
}

/// Joins the items of a file, in coding order.
class MeshCollector {
 public:
  MeshCollector(const Schema& schema, const ToldSizes& told) {
    mesh_.schema = schema;
    for (std::size_t b = 0; b < schema.blocks.size() && b < told.block_cells.size(); ++b) {
      told_cells_ += told.block_cells[b];
      told_corners_ += told.block_cells[b] * schema.blocks[b].nodes_per_cell;
    }
    if (told.vertices <= kMostTold) told_vertices_ = told.vertices;
    for (std::size_t a = 0; a < schema.arrays.size(); ++a)
      told_array_bytes_.push_back(told_elements(a, told) * stride_of(schema.arrays[a]));
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
    if (auto* times = std::get_if<StepTimes>(&item)) mesh_.step_times = std::move(times->times);
    if (auto* extra = std::get_if<Extra>(&item)) mesh_.extras.push_back(std::move(*extra));
  }
  /// Back from coding order to the numbers that vertices and cells carry.
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
  /// Static values of vertices.
  struct VertexColumn {
    std::optional<std::size_t> array;  // nothing: coordinates
    std::size_t stride = 0;
  };
  /// Of a mesh or a block.
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
  /// Element i of an array becomes what element from[i] is.
  void reorder(std::size_t array, const CompactNumbers& from);

  std::uint64_t told_elements(std::size_t array, const ToldSizes& told) const;

  Mesh mesh_;
  ComingNumbers vertices_, cells_;
  std::optional<VertexPlaces> places_;  // then vertices_ knows of no more
  bool may_have_places_ = true;         // steps are put in order behind the last one
  std::vector<VertexColumn> vertex_columns_;
  std::vector<std::uint64_t> begin_;                                  // of the block at hand
  static constexpr std::uint64_t kMostTold = std::uint64_t{1} << 40;  // or products would wrap
  std::uint64_t told_vertices_ = 0, told_cells_ = 0, told_corners_ = 0;
  std::vector<std::uint64_t> told_array_bytes_;  // of all elements, by array
};

std::uint64_t MeshCollector::told_elements(std::size_t array, const ToldSizes& told) const {
  if (mesh_.schema.arrays[array].location == Location::point) return told.vertices;
  std::uint64_t cells = 0;
  for (std::uint32_t b = 0; b < told.block_cells.size(); ++b)
    if (mesh_.schema.array_covers(array, b)) cells += told.block_cells[b];
  return cells;
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

/// Where it is to be believed how many vertices will come.
void MeshCollector::give_places() {
  for (const VertexColumn& column : vertex_columns_) {
    const std::uint64_t told = told_vertices_ * column.stride;
    if (told == 0 || believed(values_of(mesh_, column).size(), told) != told) return;
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
  bool alike = true;  // as many of each cell
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
    if (!places_->are_taken()) return corrupt("vertex numbers are not those that the index tells");
  } else if (!vertices_.in_order()) {
    if (auto good = reorder_vertices(); !good) return good.error();
  }
  if (!cells_.in_order())
    if (auto good = reorder_cells(); !good) return good.error();
  return std::move(mesh_);
}

Result<Mesh> read(ByteSource& source, const ReadLimits& limits, const ReadOptions& options,
                  const ToldSizes& told) {
  std::optional<MeshCollector> collector;
  {
    auto reader = Reader::open(source, limits, options);
    if (!reader) return reader.error();
    collector.emplace(reader->schema(), told);
    while (true) {
      auto item = reader->next();
      if (!item) return item.error();
      if (*item == nullptr) break;
      collector->take(**item);
    }
  }
  return collector->finish();
}

}  // namespace

Result<Mesh> read_mesh(ByteSource& source, const ReadLimits& limits, const ReadOptions& options) {
  return read(source, limits, options, {});
}

Result<Mesh> read_mesh(MemorySource& source, const ReadLimits& limits, const ReadOptions& options) {
  MemoryRandomSource anywhere(source.left());
  return read(source, limits, options, told_sizes(anywhere, limits));
}

Result<Mesh> read_file(const std::string& path, const ReadLimits& limits,
                       const ReadOptions& options) {
  auto source = FileSource::open(path);
  if (!source) return source.error();
  return of_file(read(**source, limits, options, told_sizes(**source, limits)), path);
}

}  // namespace shm
