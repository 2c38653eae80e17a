#include "boundary/surface_builder.h"

#include <algorithm>
#include <compare>
#include <cstring>
#include <limits>
#include <span>
#include <utility>

namespace shm {
namespace {

template <class T>
std::uint64_t capacity_bytes(const std::vector<T>& list) {
  return std::uint64_t{list.capacity()} * sizeof(T);
}

void append_bytes(std::vector<std::byte>& to, const std::byte* from, std::size_t bytes) {
  expect_more(to, bytes);
  to.insert(to.end(), from, from + bytes);
}

/// Reorders a list: the old element from[i] becomes element i. An element consists of `width`
/// entries.
template <class T>
void gather(std::vector<T>& list, const std::vector<std::uint32_t>& from, std::size_t width = 1) {
  if (list.empty()) return;
  std::vector<T> moved;
  moved.reserve(list.size());
  for (const std::uint32_t i : from) {
    const auto begin = list.begin() + static_cast<std::ptrdiff_t>(i * width);
    moved.insert(moved.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
  }
  list = std::move(moved);
}

/// Returns the places of a list in ascending order of `keys[place]`, then of `minors[place]` (if
/// given), then of the place.
std::vector<std::uint32_t> places_by(std::span<const std::uint64_t> keys,
                                     std::span<const std::uint32_t> minors = {}) {
  struct Keyed {
    std::uint64_t key;
    std::uint32_t minor, place;
    auto operator<=>(const Keyed&) const = default;
  };
  std::vector<Keyed> list;
  list.reserve(keys.size());
  for (std::uint32_t i = 0; i < keys.size(); ++i)
    list.push_back({keys[i], minors.empty() ? 0 : minors[i], i});
  if (!std::is_sorted(list.begin(), list.end())) std::sort(list.begin(), list.end());
  std::vector<std::uint32_t> places;
  places.reserve(list.size());
  for (const Keyed& item : list) places.push_back(item.place);
  return places;
}

}  // namespace

std::vector<std::byte> no_value(const ArrayInfo& info) {
  const std::size_t size = scalar_bytes(info.type);
  std::vector<std::byte> element(size * info.components);
  const auto put = [&](const auto nan) {
    for (std::size_t c = 0; c < info.components; ++c)
      std::memcpy(element.data() + c * size, &nan, size);
  };
  if (info.type == ScalarType::float32) put(std::numeric_limits<float>::quiet_NaN());
  if (info.type == ScalarType::float64) put(std::numeric_limits<double>::quiet_NaN());
  return element;
}

SurfaceBuilder::SurfaceBuilder(const Schema& schema, std::vector<BoundaryArray> arrays)
    : schema_(&schema),
      arrays_(std::move(arrays)),
      xyz_bytes_(3 * scalar_bytes(schema.coordinate_type)) {
  surface_.coordinate_type = schema.coordinate_type;
  surface_.arrays.resize(arrays_.size());
  marks_.resize(arrays_.size());
  filled_.resize(arrays_.size());
  vertex_layout_.bytes = xyz_bytes_;
  for (std::size_t r = 0; r < arrays_.size(); ++r) {
    if (of_points(r) && info(r).per_step)
      continue;  // The values of stepped point arrays are added later, after the vertices have been
                 // sorted.
    RecordLayout& layout = of_points(r) ? vertex_layout_ : cell_layout_;
    const bool is_mark = info(r).per_step;
    const std::size_t bytes = is_mark ? sizeof(std::uint64_t) : stride(r);
    layout.columns.push_back({r, arrays_[r].array, layout.bytes, bytes, is_mark});
    layout.bytes += bytes;
  }
}

std::uint32_t SurfaceBuilder::add_vertex(std::uint64_t number, std::uint64_t ordinal,
                                         const std::byte* record) {
  push_tightly(surface_.vertex_numbers, number);
  push_tightly(ordinals_, ordinal);
  append_bytes(surface_.xyz, record, xyz_bytes_);
  for (const RecordLayout::Column& column : vertex_layout_.columns)
    append_bytes(surface_.arrays[column.request], record + column.offset, column.bytes);
  return static_cast<std::uint32_t>(surface_.vertex_numbers.size() - 1);
}

void SurfaceBuilder::add_face(const Cell& cell, std::uint32_t side) {
  push_tightly(surface_.face_begin, std::uint64_t{surface_.corners.size()});
  push_tightly(positions_, cell.position);
  push_tightly(surface_.cell_numbers, cell.number);
  push_tightly(surface_.blocks, cell.block);
  push_tightly(surface_.sides, side);
  for (const RecordLayout::Column& column : cell_layout_.columns) {
    const std::byte* from = cell.record + column.offset;
    if (!column.is_mark) {
      append_bytes(surface_.arrays[column.request], from, column.bytes);
      continue;
    }
    std::uint64_t mark = 0;
    std::memcpy(&mark, from, sizeof mark);
    push_tightly(marks_[column.request], mark);
  }
}

std::uint64_t SurfaceBuilder::memory() const {
  std::uint64_t bytes = capacity_bytes(surface_.vertex_numbers) + capacity_bytes(surface_.xyz) +
                        capacity_bytes(surface_.face_begin) + capacity_bytes(surface_.corners) +
                        capacity_bytes(surface_.cell_numbers) + capacity_bytes(surface_.blocks) +
                        capacity_bytes(surface_.sides) + capacity_bytes(ordinals_) +
                        capacity_bytes(positions_);
  for (std::size_t r = 0; r < arrays_.size(); ++r)
    bytes += capacity_bytes(surface_.arrays[r]) + capacity_bytes(marks_[r]);
  return bytes;
}

std::uint64_t SurfaceBuilder::memory_of_sort() const {
  std::uint64_t all = memory(), largest = 0;
  const auto list = [&](std::uint64_t bytes) { largest = std::max(largest, bytes); };
  list(surface_.xyz.size());
  list(surface_.corners.size() * sizeof(std::uint32_t) + faces() * sizeof(std::uint64_t));
  for (std::size_t r = 0; r < arrays_.size(); ++r) {
    if (info(r).per_step) all += std::uint64_t{of_points(r) ? vertices() : faces()} * stride(r);
    list(surface_.arrays[r].size());
  }
  // The std::max() is the memory for sorting: two indices per vertex (order and new index), or one
  // index per face.
  return all + largest +
         std::max(std::uint64_t{vertices()} * 2, std::uint64_t{faces()}) * sizeof(std::uint32_t);
}

// --- coding order

void SurfaceBuilder::sort() {
  sort_vertices();
  sort_faces();
  surface_.face_begin.insert(surface_.face_begin.begin(), 0);
  let_go(positions_);
  for (std::size_t r = 0; r < arrays_.size(); ++r) {
    if (!info(r).per_step) continue;
    const std::vector<std::byte> nothing = no_value(info(r));
    std::vector<std::byte>& values = surface_.arrays[r];
    const std::size_t count = of_points(r) ? vertices() : faces();
    values.reserve(count * nothing.size());
    for (std::size_t i = 0; i < count; ++i)
      values.insert(values.end(), nothing.begin(), nothing.end());
  }
}

void SurfaceBuilder::sort_vertices() {
  if (std::is_sorted(ordinals_.begin(), ordinals_.end())) return;
  const std::vector<std::uint32_t> from = places_by(ordinals_);
  gather(surface_.vertex_numbers, from);
  gather(ordinals_, from);
  gather(surface_.xyz, from, xyz_bytes_);
  for (const RecordLayout::Column& column : vertex_layout_.columns)
    gather(surface_.arrays[column.request], from, column.bytes);
  std::vector<std::uint32_t> place(from.size());
  for (std::uint32_t i = 0; i < from.size(); ++i) place[from[i]] = i;
  for (std::uint32_t& corner : surface_.corners) corner = place[corner];
}

void SurfaceBuilder::sort_faces() {
  const std::vector<std::uint32_t> from = places_by(positions_, surface_.sides);
  if (std::is_sorted(from.begin(), from.end())) return;
  std::vector<std::uint32_t> corners;
  std::vector<std::uint64_t> ends;
  corners.reserve(surface_.corners.size());
  ends.reserve(from.size());
  for (const std::uint32_t face : from) {
    const std::uint64_t begin = face == 0 ? 0 : surface_.face_begin[face - 1];
    corners.insert(
        corners.end(), surface_.corners.begin() + static_cast<std::ptrdiff_t>(begin),
        surface_.corners.begin() + static_cast<std::ptrdiff_t>(surface_.face_begin[face]));
    ends.push_back(corners.size());
  }
  surface_.corners = std::move(corners);
  surface_.face_begin = std::move(ends);
  gather(surface_.cell_numbers, from);
  gather(surface_.blocks, from);
  gather(surface_.sides, from);
  for (const RecordLayout::Column& column : cell_layout_.columns)
    if (column.is_mark)
      gather(marks_[column.request], from);
    else
      gather(surface_.arrays[column.request], from, column.bytes);
}

// --- values of stepped arrays

void SurfaceBuilder::fill(std::uint32_t array, std::uint64_t step, std::uint64_t first,
                          std::span<const std::byte> values) {
  for (std::size_t r = 0; r < arrays_.size(); ++r) {
    if (!wants(r, array, step)) continue;
    filled_[r] = true;
    const std::size_t bytes = stride(r);
    const std::uint64_t end = first + values.size() / bytes;
    const auto& marks = of_points(r) ? ordinals_ : marks_[r];
    const auto element_at = [&](std::size_t i) { return of_points(r) ? marks[i] : marks[i] / 2; };
    auto i = static_cast<std::size_t>(
        std::lower_bound(marks.begin(), marks.end(), of_points(r) ? first : mark_of(first, false)) -
        marks.begin());
    for (; i < marks.size() && element_at(i) < end; ++i)
      if (of_points(r) || marks[i] % 2 == 1)
        std::memcpy(surface_.arrays[r].data() + i * bytes,
                    values.data() + static_cast<std::size_t>(element_at(i) - first) * bytes, bytes);
  }
}

const std::vector<std::uint32_t>& SurfaceBuilder::by_number(bool of_points) {
  auto& places = of_points ? vertices_by_number_ : faces_by_number_;
  const auto& numbers = of_points ? surface_.vertex_numbers : surface_.cell_numbers;
  if (places.size() != numbers.size()) places = places_by(numbers);
  return places;
}

void SurfaceBuilder::fill(std::uint32_t array, std::uint64_t step,
                          std::span<const std::uint64_t> numbers,
                          std::span<const std::byte> values) {
  for (std::size_t r = 0; r < arrays_.size(); ++r) {
    if (!wants(r, array, step)) continue;
    filled_[r] = true;
    const std::size_t bytes = stride(r);
    const auto& places = by_number(of_points(r));
    const auto& own = of_points(r) ? surface_.vertex_numbers : surface_.cell_numbers;
    for (std::size_t i = 0; i < numbers.size() && (i + 1) * bytes <= values.size(); ++i) {
      auto found = std::lower_bound(
          places.begin(), places.end(), numbers[i],
          [&](std::uint32_t place, std::uint64_t number) { return own[place] < number; });
      for (; found != places.end() && own[*found] == numbers[i]; ++found)
        std::memcpy(surface_.arrays[r].data() + std::size_t{*found} * bytes,
                    values.data() + i * bytes, bytes);
    }
  }
}

std::size_t SurfaceBuilder::unfilled() const {
  for (std::size_t r = 0; r < arrays_.size(); ++r) {
    if (!info(r).per_step || filled_[r]) continue;
    const bool any = of_points(r) ? vertices() > 0
                                  : std::any_of(marks_[r].begin(), marks_[r].end(),
                                                [](std::uint64_t mark) { return mark % 2 == 1; });
    if (any) return r;
  }
  return arrays_.size();
}

}  // namespace shm
