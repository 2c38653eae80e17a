#include "vtk/legacy/lattice.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "base/stored_value.h"
#include "base/text_input.h"
#include "vtk/values.h"

namespace shm::converters::vtk {
namespace {

// Parses the words of an entry as numbers. Returns false if a word is not a number.
template <class T, std::size_t kCount>
bool parse_words(std::string_view words, std::array<T, kCount>& numbers) {
  for (T& number : numbers) {
    const std::size_t end = words.find(' ');
    if (!TextInput::parse(words.substr(0, end), number)) return false;
    words.remove_prefix(end == std::string_view::npos ? words.size() : end + 1);
  }
  return words.empty();
}

std::vector<double> wide_values(const Extra& extra) {
  std::vector<double> values;
  with_scalar(extra.type, [&](auto value) {
    values.resize(extra.data.size() / sizeof value);
    for (std::size_t i = 0; i < values.size(); ++i) {
      std::memcpy(&value, extra.data.data() + i * sizeof value, sizeof value);
      values[i] = static_cast<double>(value);
    }
  });
  return values;
}

// Sets `ranges` to the numbers of the first and the last point along each axis. EXTENT a b ...
// means points a to b; DIMENSIONS n ... means points 0 to n - 1.
bool axis_ranges(const Entry& entry, std::array<std::int64_t, 6>& ranges) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int32_t>::max();
  if (entry.kind == EntryKind::extent) {
    if (!parse_words(entry.type, ranges)) return false;
  } else {
    std::array<std::int64_t, 3> sizes{};
    if (!parse_words(entry.type, sizes)) return false;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (sizes[axis] < 0 || sizes[axis] > kMost) return false;
      ranges[2 * axis + 1] = sizes[axis] - 1;
    }
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::int64_t first = ranges[2 * axis], last = ranges[2 * axis + 1];
    if (first < -kMost || last > kMost || first > kMost || last < first - 1) return false;
  }
  return true;
}

// Sets one property of three evenly spaced axes from an entry of the file: the number of the first
// point (EXTENT), the origin (ORIGIN) or the spacing (SPACING, ASPECT_RATIO). Other entries change
// nothing.
void place_axes(const Entry& entry, std::array<Axis, 3>& axes) {
  std::array<std::int64_t, 6> ranges{};
  std::array<double, 3> words{};
  if (entry.kind == EntryKind::extent && axis_ranges(entry, ranges)) {
    for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].first = ranges[2 * axis];
  } else if (entry.kind == EntryKind::origin && parse_words(entry.type, words)) {
    for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].origin = words[axis];
  } else if ((entry.kind == EntryKind::spacing || entry.kind == EntryKind::aspect_ratio) &&
             parse_words(entry.type, words)) {
    for (std::size_t axis = 0; axis < 3; ++axis) axes[axis].spacing = words[axis];
  }
}

}  // namespace

std::optional<Lattice> lattice_of(const Entry& entry) {
  std::array<std::int64_t, 6> ranges{};
  if (!axis_ranges(entry, ranges)) return std::nullopt;
  std::array<std::uint64_t, 3> sizes{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    sizes[axis] = static_cast<std::uint64_t>(ranges[2 * axis + 1] - ranges[2 * axis] + 1);
  return Lattice::of(sizes);
}

std::optional<LatticePoints> lattice_points_of(const Skeleton& skeleton, const FindExtra& extra,
                                               std::string& problem) {
  LatticePoints points;
  std::optional<Lattice> lattice;
  std::size_t narrow_axes = 0;
  for (const Entry& entry : skeleton.entries) {
    if (entry.kind == EntryKind::dimensions || entry.kind == EntryKind::extent)
      lattice = lattice_of(entry);
    if (entry.kind < EntryKind::x_coordinates || entry.kind > EntryKind::z_coordinates) {
      place_axes(entry, points.axes);
    } else if (skeleton.dataset != Dataset::rectilinear_grid) {
      continue;
    } else if (const Extra* values = extra(data_key(entry.index)); values != nullptr) {
      const auto axis =
          static_cast<std::size_t>(entry.kind) - static_cast<std::size_t>(EntryKind::x_coordinates);
      points.axes[axis].values = wide_values(*values);
      narrow_axes += values->type == ScalarType::float32;
    }
  }
  if (narrow_axes == 3) points.type = ScalarType::float32;
  problem = "states no dimensions";
  if (!lattice) return std::nullopt;
  if (skeleton.dataset != Dataset::rectilinear_grid || lattice->points() == 0) return points;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t values = points.axes[axis].values.size();
    problem = std::string(1, "XYZ"[axis]) + "_COORDINATES has " + std::to_string(values) +
              " values, but the dimensions state " + std::to_string(lattice->dimension(axis));
    if (values != lattice->dimension(axis)) return std::nullopt;
  }
  return points;
}

std::optional<Lattice> Lattice::of(const std::array<std::uint64_t, 3>& dimensions) {
  constexpr std::uint64_t kMostPoints = std::numeric_limits<std::int64_t>::max() / 64;
  Lattice lattice;
  lattice.dimensions_ = dimensions;
  if (std::find(dimensions.begin(), dimensions.end(), 0U) != dimensions.end()) return lattice;
  lattice.points_ = lattice.cells_ = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::uint64_t size = dimensions[axis];
    const std::uint64_t stride = lattice.points_;
    if (size > kMostPoints / lattice.points_) return std::nullopt;
    lattice.points_ *= size;
    lattice.cell_dimensions_[axis] = std::max<std::uint64_t>(size - 1, 1);
    lattice.cells_ *= lattice.cell_dimensions_[axis];
    if (size == 1) continue;
    // Each axis doubles the number of corners: the existing corners are copied and shifted along
    // the axis. For the second axis, the two corners are copied in reverse order, so that the four
    // corners go around a face. For the third axis, the four corners are copied in the same order,
    // and form the opposite face.
    const std::size_t n = lattice.nodes_;
    for (std::size_t i = 0; i < n; ++i)
      lattice.offsets_[n + i] = lattice.offsets_[n == 2 ? 1 - i : i] + stride;
    lattice.nodes_ = 2 * n;
  }
  return lattice;
}

BlockInfo Lattice::block() const {
  switch (nodes_) {
    case 1: return {1, {}, CellShape::vertex, 1};
    case 2: return {3, {}, CellShape::line, 2};
    case 4: return {9, {}, CellShape::quad, 4};
    default: return {12, {}, CellShape::hexahedron, 8};
  }
}

std::span<const std::uint64_t> Lattice::corners(std::uint64_t cell) {
  const std::uint64_t i = cell % cell_dimensions_[0];
  const std::uint64_t row = cell / cell_dimensions_[0];
  const std::uint64_t j = row % cell_dimensions_[1], k = row / cell_dimensions_[1];
  const std::uint64_t first = i + dimensions_[0] * (j + dimensions_[1] * k);
  for (std::size_t c = 0; c < nodes_; ++c) corners_[c] = first + offsets_[c];
  return {corners_.data(), nodes_};
}

void LatticePoints::read(const Lattice& lattice, std::uint64_t first, std::uint64_t count,
                         std::byte* out) const {
  if (count == 0) return;
  std::array<std::uint64_t, 3> index{first % lattice.dimension(0),
                                     first / lattice.dimension(0) % lattice.dimension(1),
                                     first / lattice.dimension(0) / lattice.dimension(1)};
  std::array<double, 3> xyz{0, axes[1](index[1]), axes[2](index[2])};
  while (count-- > 0) {
    xyz[0] = axes[0](index[0]);
    for (const double wide : xyz) {
      const auto narrow = static_cast<float>(wide);
      const bool is_narrow = type == ScalarType::float32;
      const std::size_t bytes = is_narrow ? sizeof narrow : sizeof wide;
      std::memcpy(out, is_narrow ? static_cast<const void*>(&narrow) : &wide, bytes);
      out += bytes;
    }
    if (++index[0] < lattice.dimension(0)) continue;
    index[0] = 0;
    if (++index[1] == lattice.dimension(1)) {
      index[1] = 0;
      ++index[2];
    }
    // Return after the last point, because the next row may be outside the lattice.
    if (count == 0) return;
    xyz[1] = axes[1](index[1]);
    xyz[2] = axes[2](index[2]);
  }
}

}  // namespace shm::converters::vtk
