#include "compare/coincident_vertices.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>

#include "base/disjoint_sets.h"
#include "base/stored_value.h"
#include "compare/point_tree.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kNoSite = ~std::uint32_t{0};
// Finite numbers that replace NaN and infinity in coordinates, so that all points can be sorted.
constexpr double kNan = 1.7e308, kInfinite = 1.6e308;

double orderly(double x) {
  if (std::isnan(x)) return kNan;
  if (std::isinf(x)) return x < 0 ? -kInfinite : kInfinite;
  return x + 0.0;  // -0.0 becomes 0.0
}

std::vector<PlainPoint> points_of(MeshSource& mesh) {
  constexpr std::uint64_t kPiece = 16384;
  const MeshInfo& info = mesh.info();
  const ScalarType type = info.schema.coordinate_type;
  const std::size_t bytes = scalar_bytes(type);
  std::vector<PlainPoint> points;
  std::vector<std::byte> piece;
  for (std::uint64_t first = 0; first < info.vertices; first += kPiece) {
    const std::uint64_t count = std::min(kPiece, info.vertices - first);
    piece.resize(count * 3 * bytes);
    mesh.read_points(first, count, piece.data());
    for (std::uint64_t i = 0; i < count; ++i) {
      PlainPoint& point = points.emplace_back();
      for (std::size_t c = 0; c < 3; ++c)
        point[c] = orderly(as_double(piece.data() + (3 * i + c) * bytes, type));
    }
  }
  return points;
}

// The vertices of one mesh, sorted by their coordinates. Vertices with equal coordinates are
// adjacent and form a run.
class Places {
 public:
  explicit Places(MeshSource& mesh) : points_(points_of(mesh)), order_(points_.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(), [&](std::uint32_t x, std::uint32_t y) {
      return points_[x] != points_[y] ? points_[x] < points_[y] : x < y;
    });
  }
  std::size_t size() const { return points_.size(); }
  const PlainPoint& point(std::size_t index) const { return points_[order_[index]]; }
  std::uint32_t vertex(std::size_t index) const { return order_[index]; }
  // Returns the end of the run that begins at `index`, i.e. the first index after it at which the
  // coordinates differ.
  std::size_t run_end(std::size_t index) const {
    std::size_t end = index + 1;
    while (end < size() && point(end) == point(index)) ++end;
    return end;
  }

 private:
  std::vector<PlainPoint> points_;
  std::vector<std::uint32_t> order_;
};

// Runs (vertices of one mesh with equal coordinates) that have no exact counterpart: at these
// coordinates, the other mesh has no vertices, or a different number of them.
struct Runs {
  std::vector<PlainPoint> points;
  std::vector<std::uint32_t> begin, end, site;
  void add(const Places& places, std::size_t from, std::size_t to) {
    points.push_back(places.point(from));
    begin.push_back(static_cast<std::uint32_t>(from));
    end.push_back(static_cast<std::uint32_t>(to));
    site.push_back(kNoSite);
  }
};

class SiteFinder {
 public:
  SiteFinder(MeshSource& a, MeshSource& b, double tolerance) : a_(a), b_(b), tolerance_(tolerance) {
    sites_.of_a.assign(a_.size(), kNoSite);
    sites_.of_b.assign(b_.size(), kNoSite);
  }

  CoincidentVertices run() {
    take_equal_places();
    if (tolerance_ > 0 && !left_a_.points.empty() && !left_b_.points.empty()) take_near_places();
    for (Runs* runs : {&left_a_, &left_b_})
      for (std::uint32_t& site : runs->site)
        if (site == kNoSite) site = sites_.count++;
    give_sites(left_a_, a_, sites_.of_a);
    give_sites(left_b_, b_, sites_.of_b);
    return std::move(sites_);
  }

 private:
  void take_equal_places() {
    std::size_t i = 0, k = 0;
    while (i < a_.size() || k < b_.size()) {
      const bool only_a = k == b_.size() || (i < a_.size() && a_.point(i) < b_.point(k));
      const bool only_b = !only_a && (i == a_.size() || b_.point(k) < a_.point(i));
      const std::size_t end_a = only_b ? i : a_.run_end(i), end_b = only_a ? k : b_.run_end(k);
      if (only_a || only_b || (tolerance_ > 0 && end_a - i != end_b - k)) {
        if (end_a > i) left_a_.add(a_, i, end_a);
        if (end_b > k) left_b_.add(b_, k, end_b);
      } else {
        for (std::size_t v = i; v < end_a; ++v) sites_.of_a[a_.vertex(v)] = sites_.count;
        for (std::size_t v = k; v < end_b; ++v) sites_.of_b[b_.vertex(v)] = sites_.count;
        ++sites_.count;
      }
      i = end_a;
      k = end_b;
    }
  }

  void take_near_places() {
    const PointTree tree_a(left_a_.points), tree_b(left_b_.points);
    const auto runs_a = static_cast<std::uint32_t>(left_a_.points.size());
    const std::size_t runs = runs_a + left_b_.points.size();
    DisjointSets groups(runs);
    // crowded[i] is true if the search for runs within the tolerance of run i stopped early,
    // because it had found kCrowd runs.
    std::vector<bool> crowded(runs, false);
    for (std::uint32_t i = 0; i < runs; ++i) {
      std::size_t found = 0;
      const auto unite = [&](std::uint32_t other) {
        groups.unite(i, other);
        return ++found < kCrowd;
      };
      tree_a.visit_near(run_point(i), tolerance_, unite);
      tree_b.visit_near(run_point(i), tolerance_,
                        [&](std::uint32_t other) { return unite(runs_a + other); });
      crowded[i] = found >= kCrowd;
    }
    const std::vector<bool> close = close_groups(groups, crowded);
    std::vector<std::uint32_t> site(runs, kNoSite);  // site of each group
    for (std::uint32_t i = 0; i < runs; ++i) {
      const std::uint32_t group = groups.first(i);
      if (!close[group]) continue;
      if (site[group] == kNoSite) site[group] = sites_.count++;
      run_site(i) = site[group];
    }
    take_nearest(tree_a, tree_b);
  }

  const PlainPoint& run_point(std::uint32_t i) const {
    const std::size_t runs_a = left_a_.points.size();
    return i < runs_a ? left_a_.points[i] : left_b_.points[i - runs_a];
  }
  std::uint32_t& run_site(std::uint32_t i) {
    const std::size_t runs_a = left_a_.points.size();
    return i < runs_a ? left_a_.site[i] : left_b_.site[i - runs_a];
  }

  // Returns a flag for each group of runs. The flag is true if no two runs of the group are further
  // apart than the tolerance, and `crowded` is false for each run of the group.
  std::vector<bool> close_groups(DisjointSets& groups, const std::vector<bool>& crowded) const {
    std::vector<PlainPoint> low(crowded.size()), high(crowded.size());
    std::vector<bool> close(crowded.size(), true);
    for (std::uint32_t i = 0; i < crowded.size(); ++i) {
      const std::uint32_t group = groups.first(i);
      const PlainPoint& point = run_point(i);
      if (crowded[i]) close[group] = false;
      if (i == group) low[group] = high[group] = point;
      for (std::size_t c = 0; c < 3; ++c) {
        low[group][c] = std::min(low[group][c], point[c]);
        high[group][c] = std::max(high[group][c], point[c]);
      }
      if (distance_between(low[group], high[group]) > tolerance_) close[group] = false;
    }
    return close;
  }

  // Assigns a site (a point that both meshes share) to each run that does not have one yet. First,
  // a run of A and a run of B get a common site if each is the run of its mesh that is nearest to
  // the other. Then each remaining run gets the site of the nearest run of the other mesh.
  void take_nearest(const PointTree& tree_a, const PointTree& tree_b) {
    std::vector<std::uint32_t> nearest_a(left_b_.points.size(), kNoSite);
    for (std::size_t k = 0; k < nearest_a.size(); ++k)
      if (left_b_.site[k] == kNoSite)
        nearest_a[k] = tree_a.nearest(left_b_.points[k], tolerance_).value_or(kNoSite);
    std::vector<std::uint32_t> nearest_b(left_a_.points.size(), kNoSite);
    for (std::size_t i = 0; i < nearest_b.size(); ++i) {
      if (left_a_.site[i] != kNoSite) continue;
      nearest_b[i] = tree_b.nearest(left_a_.points[i], tolerance_).value_or(kNoSite);
      if (nearest_b[i] == kNoSite || nearest_a[nearest_b[i]] != i) continue;
      left_a_.site[i] = left_b_.site[nearest_b[i]] = sites_.count++;
    }
    for (std::size_t i = 0; i < nearest_b.size(); ++i)
      if (left_a_.site[i] == kNoSite && nearest_b[i] != kNoSite)
        left_a_.site[i] = left_b_.site[nearest_b[i]];
    for (std::size_t k = 0; k < nearest_a.size(); ++k)
      if (left_b_.site[k] == kNoSite && nearest_a[k] != kNoSite)
        left_b_.site[k] = left_a_.site[nearest_a[k]];
  }

  static void give_sites(const Runs& runs, const Places& places,
                         std::vector<std::uint32_t>& of_vertex) {
    for (std::size_t r = 0; r < runs.points.size(); ++r)
      for (std::uint32_t v = runs.begin[r]; v < runs.end[r]; ++v)
        of_vertex[places.vertex(v)] = runs.site[r];
  }

  static constexpr std::size_t kCrowd = 32;
  const Places a_, b_;
  const double tolerance_;
  Runs left_a_, left_b_;
  CoincidentVertices sites_;
};

}  // namespace

CoincidentVertices find_coincident(MeshSource& a, MeshSource& b, double tolerance) {
  return SiteFinder(a, b, tolerance).run();
}

}  // namespace shm::converters
