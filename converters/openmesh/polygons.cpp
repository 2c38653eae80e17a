#include "openmesh/polygons.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <tuple>

#include "base/disjoint_sets.h"
#include "picture/camera.h"

namespace shm::converters {
namespace {

// Maximum number of corners of all faces of a surface together. OpenMesh stores the number of a
// halfedge in an int. A polygon with n corners becomes n - 2 triangles, and each side of a triangle
// needs two halfedges.
constexpr std::size_t kMostCorners = (std::size_t{1} << 30) / 3;

Vector place_of(const Surface& surface, std::uint32_t vertex) {
  return {surface.coordinate(vertex, 0), surface.coordinate(vertex, 1),
          surface.coordinate(vertex, 2)};
}

bool is_in_float32(const Vector& place) {
  constexpr double kMost = std::numeric_limits<float>::max();
  return std::all_of(place.begin(), place.end(), [](double x) { return std::fabs(x) <= kMost; });
}

// Converts the faces of a surface to polygons, one by one. The corners of the resulting polygons
// are vertices of the surface. Later, CornerJoiner duplicates some of these vertices.
class PolygonMaker {
 public:
  PolygonMaker(const Surface& surface, bool triangles, Polygons& out)
      : surface_(surface), triangles_(triangles), out_(out) {}

  void add(std::size_t f) {
    const auto face = surface_.face(f);
    if (face.size() < 3) {
      ++out_.lines_and_points;
      return;
    }
    ring_.assign(face.begin(), face.end());
    ring_.erase(std::unique(ring_.begin(), ring_.end()), ring_.end());
    while (ring_.size() > 1 && ring_.front() == ring_.back()) ring_.pop_back();
    if (different(ring_) < 3) {
      ++out_.collapsed;
      return;
    }
    places_.clear();
    for (const std::uint32_t vertex : ring_) places_.push_back(place_of(surface_, vertex));
    if (!std::all_of(places_.begin(), places_.end(), is_in_float32)) {
      ++out_.not_finite;
      return;
    }
    const std::size_t before = out_.faces.size();
    if (ring_.size() == 3 || (!triangles_ && ring_.size() <= kMostPolygonCorners))
      add_polygon(f, ring_);
    else
      add_fan(f, fan_corner());
    if (out_.faces.size() == before) ++out_.collapsed;
  }

 private:
  std::size_t different(std::span<const std::uint32_t> ring) {
    sorted_.assign(ring.begin(), ring.end());
    std::sort(sorted_.begin(), sorted_.end());
    return static_cast<std::size_t>(std::unique(sorted_.begin(), sorted_.end()) - sorted_.begin());
  }

  // Chooses the corner that all triangles share when the face is split into a fan.
  std::size_t fan_corner() const {
    if (ring_.size() != 4)
      return static_cast<std::size_t>(std::min_element(places_.begin(), places_.end()) -
                                      places_.begin());
    const auto length = [&](std::size_t a, std::size_t b) {
      const Vector way = minus(places_[b], places_[a]);
      return dot(way, way);
    };
    const auto leaves_none_turned = [&](std::size_t a) {
      const Vector along = minus(places_[a + 2], places_[a]);
      const Vector one = cross(minus(places_[a + 1], places_[a]), along);
      return dot(one, cross(along, minus(places_[(a + 3) % 4], places_[a]))) > 0;
    };
    const bool first = leaves_none_turned(0), second = leaves_none_turned(1);
    if (first != second) return first ? 0 : 1;
    return length(1, 3) < length(0, 2) ? 1 : 0;
  }

  void add_fan(std::size_t f, std::size_t turn) {
    const std::size_t count = ring_.size();
    for (std::size_t i = 1; i + 1 < count; ++i) {
      const std::array<std::uint32_t, 3> triangle = {ring_[turn], ring_[(turn + i) % count],
                                                     ring_[(turn + i + 1) % count]};
      // If a polygon contains a vertex twice, some of its triangles may have two equal corners.
      // These triangles are omitted.
      if (different(triangle) == 3) add_polygon(f, triangle);
    }
  }

  void add_polygon(std::size_t f, std::span<const std::uint32_t> ring) {
    out_.corners.insert(out_.corners.end(), ring.begin(), ring.end());
    out_.face_begin.push_back(out_.corners.size());
    out_.faces.push_back(static_cast<std::uint32_t>(f));
  }

  const Surface& surface_;
  bool triangles_;
  Polygons& out_;
  std::vector<std::uint32_t> ring_, sorted_;
  std::vector<Vector> places_;
};

// Assigns a vertex to each corner of the polygons. At first, each corner has its own vertex. If two
// faces stay connected along an edge, their corners at each end of this edge are merged into one
// vertex. Each face at a vertex is connected to at most one previous and one next face, so the
// faces around a merged vertex form one fan.
class CornerJoiner {
 public:
  explicit CornerJoiner(Polygons& polygons) : polygons_(polygons) {}

  void join() {
    list_edges();
    taken_out_.assign(polygons_.face_count(), false);
    join_along_edges();
    // If a fan contains two corners of the same face, which is not allowed, this face is removed
    // from its fans, and all fans are computed again without it.
    if (take_out_rejoined()) join_along_edges();
    number();
  }

 private:
  // A side of a face, from one corner to the next.
  struct Side {
    std::uint32_t low, high;  // vertices of the side: the lower and the higher number
    std::uint32_t from, to;   // corners at the ends of the side
    std::uint32_t face;
  };

  void list_edges() {
    const auto& corners = polygons_.corners;
    sides_.reserve(corners.size());
    for (std::size_t f = 0; f < polygons_.face_count(); ++f) {
      const std::size_t begin = polygons_.face_begin[f], end = polygons_.face_begin[f + 1];
      for (std::size_t from = begin; from < end; ++from) {
        const std::size_t to = from + 1 < end ? from + 1 : begin;
        const auto [low, high] = std::minmax(corners[from], corners[to]);
        sides_.push_back({low, high, static_cast<std::uint32_t>(from),
                          static_cast<std::uint32_t>(to), static_cast<std::uint32_t>(f)});
      }
    }
    std::sort(sides_.begin(), sides_.end(), [](const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.from) < std::tie(b.low, b.high, b.from);
    });
  }

  void join_along_edges() {
    fans_ = DisjointSets(polygons_.corners.size());
    for (std::size_t s = 0, end = 0; s < sides_.size(); s = end) {
      for (end = s + 1; end < sides_.size() && is_same_edge(sides_[s], sides_[end]);) ++end;
      if (end - s != 2) continue;
      const Side &a = sides_[s], &b = sides_[s + 1];
      const bool are_opposite = polygons_.corners[a.from] == polygons_.corners[b.to];
      if (!are_opposite || a.face == b.face || taken_out_[a.face] || taken_out_[b.face]) continue;
      fans_.unite(a.from, b.to);
      fans_.unite(a.to, b.from);
    }
  }
  static bool is_same_edge(const Side& a, const Side& b) {
    return a.low == b.low && a.high == b.high;
  }

  bool take_out_rejoined() {
    bool any = false;
    std::vector<std::uint32_t> firsts;
    for (std::size_t f = 0; f < polygons_.face_count(); ++f) {
      firsts.clear();
      for (std::size_t c = polygons_.face_begin[f]; c < polygons_.face_begin[f + 1]; ++c)
        firsts.push_back(fans_.first(static_cast<std::uint32_t>(c)));
      std::sort(firsts.begin(), firsts.end());
      if (std::adjacent_find(firsts.begin(), firsts.end()) == firsts.end()) continue;
      taken_out_[f] = any = true;
    }
    return any;
  }

  void number() {
    sides_ = {};
    auto& corners = polygons_.corners;
    constexpr std::uint32_t kNone = ~std::uint32_t{0};
    std::vector<std::uint32_t> numbers(corners.size(), kNone);  // vertex of each first corner
    std::vector<std::uint32_t> uses;                            // first corner of each vertex
    for (std::uint32_t c = 0; c < corners.size(); ++c) {
      if (corners[c] >= uses.size()) uses.resize(std::size_t{corners[c]} + 1, kNone);
      if (uses[corners[c]] == kNone) uses[corners[c]] = c;
    }
    const auto add = [&](std::uint32_t c) {
      numbers[c] = static_cast<std::uint32_t>(polygons_.vertices.size());
      polygons_.vertices.push_back(corners[c]);
    };
    for (const std::uint32_t c : uses)
      if (c != kNone) add(c);
    for (std::uint32_t c = 0; c < corners.size(); ++c) {
      if (fans_.first(c) != c || numbers[c] != kNone) continue;
      add(c);
      ++polygons_.copies;
    }
    for (std::uint32_t c = 0; c < corners.size(); ++c) corners[c] = numbers[fans_.first(c)];
  }

  Polygons& polygons_;
  std::vector<Side> sides_;
  std::vector<bool> taken_out_;
  DisjointSets fans_;
};

}  // namespace

Result<Polygons> polygons_of(const Surface& surface, const PolygonOptions& options) {
  if (surface.corners.size() > kMostCorners || surface.faces() > kMostCorners)
    return Error{.code = ErrorCode::over_limit,
                 .detail = "the surface has " + std::to_string(surface.corners.size()) +
                           " corners; the maximum is " + std::to_string(kMostCorners)};
  Polygons polygons;
  PolygonMaker maker(surface, options.triangles, polygons);
  for (std::size_t f = 0; f < surface.faces(); ++f) maker.add(f);
  CornerJoiner(polygons).join();
  return polygons;
}

}  // namespace shm::converters
