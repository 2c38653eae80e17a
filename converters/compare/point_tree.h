// PointTree: a spatial index that finds the points near a given point. Distances are in the maximum
// norm (the largest difference in any coordinate). Needs 5 bytes of memory per point.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <optional>
#include <vector>

namespace shm::converters {

using PlainPoint = std::array<double, 3>;

inline double distance_between(const PlainPoint& a, const PlainPoint& b) {
  return std::max({std::fabs(a[0] - b[0]), std::fabs(a[1] - b[1]), std::fabs(a[2] - b[2])});
}

class PointTree {
 public:
  // Borrows `points`. There must be fewer than 2^32 points, and their coordinates must be finite.
  explicit PointTree(const std::vector<PlainPoint>& points)
      : points_(&points), order_(points.size()), axis_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    build(0, order_.size());
  }

  // Calls visit(index) for each point whose distance from `place` is at most `radius`, until
  // `visit` returns false.
  template <class Visit>
  void visit_near(const PlainPoint& place, double radius, Visit&& visit) const {
    visit_range(0, order_.size(), place, radius, visit);
  }

  // Returns the index of the point nearest to `place`, or nothing if all distances exceed `radius`.
  // If several points are equally near, returns the lowest index.
  std::optional<std::uint32_t> nearest(const PlainPoint& place, double radius) const {
    Nearest best{radius, std::nullopt};
    search(0, order_.size(), place, best);
    return best.number;
  }

 private:
  struct Nearest {
    double distance;
    std::optional<std::uint32_t> number;
  };
  const PlainPoint& at(std::size_t place) const { return (*points_)[order_[place]]; }

  // Splits each range of points at its median along the longest side of its bounding box.
  void build(std::size_t begin, std::size_t end) {
    if (end - begin < 2) return;
    PlainPoint low = at(begin), high = low;
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        low[c] = std::min(low[c], at(i)[c]);
        high[c] = std::max(high[c], at(i)[c]);
      }
    std::size_t axis = 0;
    for (std::size_t c = 1; c < 3; ++c)
      if (high[c] / 2 - low[c] / 2 > high[axis] / 2 - low[axis] / 2) axis = c;
    const std::size_t middle = begin + (end - begin) / 2;
    const auto iterator = [&](std::size_t i) {
      return order_.begin() + static_cast<std::ptrdiff_t>(i);
    };
    std::nth_element(iterator(begin), iterator(middle), iterator(end),
                     [&](std::uint32_t x, std::uint32_t y) {
                       const double p = (*points_)[x][axis], q = (*points_)[y][axis];
                       return p != q ? p < q : x < y;
                     });
    axis_[middle] = static_cast<std::uint8_t>(axis);
    build(begin, middle);
    build(middle + 1, end);
  }

  template <class Visit>
  bool visit_range(std::size_t begin, std::size_t end, const PlainPoint& place, double radius,
                   Visit&& visit) const {
    if (begin == end) return true;
    const std::size_t middle = begin + (end - begin) / 2;
    const PlainPoint& split = at(middle);
    if (distance_between(split, place) <= radius && !visit(order_[middle])) return false;
    const double off = place[axis_[middle]] - split[axis_[middle]];
    if (off <= radius && !visit_range(begin, middle, place, radius, visit)) return false;
    return -off > radius || visit_range(middle + 1, end, place, radius, visit);
  }

  void search(std::size_t begin, std::size_t end, const PlainPoint& place, Nearest& best) const {
    if (begin == end) return;
    const std::size_t middle = begin + (end - begin) / 2;
    const double distance = distance_between(at(middle), place);
    const std::uint32_t number = order_[middle];
    if (distance < best.distance ||
        (distance == best.distance && (!best.number || number < *best.number)))
      best = {distance, number};
    const double off = place[axis_[middle]] - at(middle)[axis_[middle]];
    const bool low_first = off < 0;
    for (const bool low : {low_first, !low_first}) {
      if (low ? off > best.distance : -off > best.distance) continue;
      low ? search(begin, middle, place, best) : search(middle + 1, end, place, best);
    }
  }

  const std::vector<PlainPoint>* points_;
  std::vector<std::uint32_t> order_;
  std::vector<std::uint8_t> axis_;
};

}  // namespace shm::converters
