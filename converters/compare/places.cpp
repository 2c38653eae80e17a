#include "compare/places.h"

#include <algorithm>
#include <map>
#include <vector>

#include "mesh/cell_cursor.h"

namespace shm::converters {
namespace {

using Point = std::array<double, 3>;

Point point_of(MeshSource& mesh, std::uint64_t vertex) {
  const ScalarType type = mesh.info().schema.coordinate_type;
  std::array<std::byte, 3 * sizeof(double)> bytes;
  mesh.read_points(vertex, 1, bytes.data());
  Point point{};
  for (std::size_t c = 0; c < 3; ++c)
    point[c] = as_double(bytes.data() + c * scalar_bytes(type), type);
  return point;
}

Point centre_of(MeshSource& mesh, std::span<const std::uint64_t> corners) {
  Point centre{};
  for (const std::uint64_t v : corners) {
    const Point point = point_of(mesh, v);
    for (std::size_t c = 0; c < 3; ++c) centre[c] += point[c] / static_cast<double>(corners.size());
  }
  return centre;
}

}  // namespace

DiffPlace place_of(const StepPair& step, const FieldPair& field, std::uint64_t a, std::uint64_t b,
                   const MeshInfo& info_a, const MeshInfo& info_b) {
  DiffPlace place;
  place.element = field.location == Location::point  ? "vertex"
                  : field.location == Location::cell ? "cell"
                                                     : "element";
  place.a = a;
  place.b = b;
  if (field.b.per_step) {
    place.step_b = step.b;
    place.time = info_b.step_times[step.b];
  }
  if (field.a.per_step) {
    place.step_a = step.a;
    place.time = info_a.step_times[step.a];
  }
  return place;
}

ValueRange range_of_points(MeshSource& mesh) {
  constexpr std::uint64_t kPiece = 16384;
  const MeshInfo& info = mesh.info();
  const ScalarType type = info.schema.coordinate_type;
  ValueRange range(3);
  std::vector<std::byte> piece;
  for (std::uint64_t first = 0; first < info.vertices; first += kPiece) {
    const std::uint64_t count = std::min(kPiece, info.vertices - first);
    piece.resize(count * 3 * scalar_bytes(type));
    mesh.read_points(first, count, piece.data());
    range.add(piece.data(), count, type);
  }
  return range;
}

void PlaceFinder::fill(MeshDiff& diff) {
  fill(diff, a_, true);
  fill(diff, b_, false);
}

void PlaceFinder::fill(MeshDiff& diff, MeshSource& mesh, bool is_a) {
  std::multimap<std::uint64_t, DiffPlace*> cells;
  for (Finding& finding : diff.differences)
    for (DiffPlace& place : finding.places) {
      const auto number = is_a ? place.a : place.b;
      if (!number || place.where) continue;
      if (place.element == "vertex") place.where = point_of(mesh, *number);
      if (place.element == "cell") cells.emplace(*number, &place);
    }
  if (cells.empty()) return;
  CellCursor cursor(mesh);
  auto wanted = cells.begin();
  for (std::uint64_t cell = 0; wanted != cells.end() && cursor.next(); ++cell)
    for (; wanted != cells.end() && wanted->first == cell; ++wanted)
      wanted->second->where = centre_of(mesh, cursor.corners());
}

}  // namespace shm::converters
