#include "picture/raster.h"

#include <algorithm>
#include <cmath>

namespace shm::converters {
namespace {

constexpr std::int64_t kMiddle = kSubSamples / 2;  // centre of a sample

std::int64_t floor_div(std::int64_t a, std::int64_t b) {  // b > 0
  return a / b - (a % b < 0 ? 1 : 0);
}
std::int64_t ceil_div(std::int64_t a, std::int64_t b) { return -floor_div(-a, b); }

// first_sample() returns the index of the first sample whose centre is at or after the position
// `place`. last_sample() returns the index of the last sample whose centre is at or before `place`.
std::int64_t first_sample(std::int64_t place) { return ceil_div(place - kMiddle, kSubSamples); }
std::int64_t last_sample(std::int64_t place) { return floor_div(place - kMiddle, kSubSamples); }

// An edge of a triangle, and the half-plane that it bounds. value(x, y) is 0 on the edge and
// positive on the inner side. All values are below 2^52.
struct Edge {
  std::int64_t of_x, of_y, constant;
  std::int64_t least;         // a sample is inside if value() at its centre is at least this
  std::int64_t outline = -1;  // a sample is on the outline if value() is at most this

  Edge(const RasterPoint& from, const RasterPoint& to)
      : of_x(from.y - to.y), of_y(to.x - from.x), constant(-(of_x * from.x + of_y * from.y)) {
    // Samples on an edge belong to the triangle only if the edge is a left or an upper edge. y
    // increases downwards, and the inside is on the right of the edge's direction. Therefore an
    // edge that goes up is a left edge, and a horizontal edge that goes to the right is an upper
    // edge.
    const bool owns = of_x > 0 || (of_x == 0 && of_y > 0);
    least = owns ? 0 : 1;
  }
  std::int64_t value(std::int64_t x, std::int64_t y) const {
    return of_x * x + of_y * y + constant;
  }
  void set_outline() {
    const double length = std::sqrt(static_cast<double>(of_x) * static_cast<double>(of_x) +
                                    static_cast<double>(of_y) * static_cast<double>(of_y));
    outline = static_cast<std::int64_t>(length * static_cast<double>(kSubSamples));
  }
  // Shortens the range first..last of the samples in the row at `y` to the samples inside the
  // half-plane.
  void cut(std::int64_t y, std::int64_t& first, std::int64_t& last) const {
    // At the centre of sample i of the row, value() is slope * i + rest.
    const std::int64_t slope = of_x * kSubSamples, rest = value(kMiddle, y);
    if (slope > 0)
      first = std::max(first, ceil_div(least - rest, slope));
    else if (slope < 0)
      last = std::min(last, floor_div(rest - least, -slope));
    else if (rest < least)
      last = first - 1;
  }
};

// Interpolates a value linearly over a triangle, from its values at the three corners.
struct Plane {
  double of_x, of_y, constant, least, most;

  // `area` is twice the area of the triangle. It must not be 0.
  Plane(const std::array<RasterPoint, 3>& corners, const std::array<double, 3>& values,
        double area) {
    const auto across = [&](std::size_t i) {
      return static_cast<double>(corners[i].x - corners[0].x);
    };
    const auto down = [&](std::size_t i) {
      return static_cast<double>(corners[i].y - corners[0].y);
    };
    const double b = values[1] - values[0], c = values[2] - values[0];
    of_x = (b * down(2) - c * down(1)) / area;
    of_y = (c * across(1) - b * across(2)) / area;
    constant = values[0] - of_x * static_cast<double>(corners[0].x) -
               of_y * static_cast<double>(corners[0].y);
    least = std::min({values[0], values[1], values[2]});
    most = std::max({values[0], values[1], values[2]});
  }
  // Returns the interpolated value at a position, clamped to the range of the corner values. In a
  // narrow triangle, rounding could otherwise lead to a value far outside this range.
  double at(double x, double y) const {
    return std::clamp(of_x * x + (of_y * y + constant), least, most);
  }
};

}  // namespace

Raster::Raster(std::uint32_t width, std::uint32_t height)
    : across_(std::int64_t{width} * kSamples),
      down_(std::int64_t{height} * kSamples),
      samples_(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_)) {}

bool Raster::add_triangle(const std::array<RasterPoint, 3>& corners, const Paint& paint,
                          unsigned outlines) {
  auto [a, b, c] = corners;
  std::int64_t area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (area == 0) return false;
  if (area < 0) {
    std::swap(b, c);
    area = -area;
    outlines = (outlines & 2) | (outlines & 1) << 2 | (outlines & 4) >> 2;
  }
  std::array<Edge, 3> edges = {Edge(a, b), Edge(b, c), Edge(c, a)};
  for (unsigned e = 0; e < 3; ++e)
    if (outlines >> e & 1) edges[e].set_outline();
  const std::int64_t left = std::max<std::int64_t>(first_sample(std::min({a.x, b.x, c.x})), 0);
  const std::int64_t right = std::min(last_sample(std::max({a.x, b.x, c.x})), across_ - 1);
  const std::int64_t top = std::max<std::int64_t>(first_sample(std::min({a.y, b.y, c.y})), 0);
  const std::int64_t bottom = std::min(last_sample(std::max({a.y, b.y, c.y})), down_ - 1);
  ++work_;
  if (left > right || top > bottom) return true;

  const double size = static_cast<double>(area);
  const Plane depth({a, b, c}, {a.depth, b.depth, c.depth}, size);
  const bool has_values =
      paint.by_value && !std::isnan(a.share) && !std::isnan(b.share) && !std::isnan(c.share);
  const Plane share(
      {a, b, c}, has_values ? std::array{a.share, b.share, c.share} : std::array{0., 0., 0.}, size);
  const Rgb plain = lit(paint.by_value ? kNoValue : paint.colour, paint.light);
  for (std::int64_t row = top; row <= bottom; ++row) {
    const std::int64_t y = row * kSubSamples + kMiddle;
    std::int64_t first = left, last = right;
    for (const Edge& edge : edges) edge.cut(y, first, last);
    ++work_;
    if (first > last) continue;
    work_ += static_cast<std::uint64_t>(last - first + 1);
    Sample* const line = samples_.data() + static_cast<std::size_t>(row * across_);
    for (std::int64_t i = first; i <= last; ++i) {
      const std::int64_t x = i * kSubSamples + kMiddle;
      Sample& sample = line[i];
      const auto near =
          static_cast<float>(depth.at(static_cast<double>(x), static_cast<double>(y)));
      if (!(near > sample.depth + kSameDepth)) continue;
      Rgb colour = plain;
      if (has_values)
        colour = lit(value_colour(share.at(static_cast<double>(x), static_cast<double>(y))),
                     paint.light);
      if (outlines != 0)
        for (const Edge& edge : edges)
          if (edge.value(x, y) <= edge.outline) {
            colour = lit(colour, paint.outline_light);
            break;
          }
      sample = {near, colour};
    }
  }
  return true;
}

void Raster::add_line(const RasterPoint& from, const RasterPoint& to, const Paint& paint) {
  const auto across = static_cast<double>(to.x - from.x), down = static_cast<double>(to.y - from.y);
  const double length = std::sqrt(across * across + down * down);
  if (length < static_cast<double>(kSubSamples)) return add_point(from, paint);
  constexpr double kHalfWidth = static_cast<double>(kSubSamples * kSamples) / 2;
  // Rounds to the nearest integer, and halves away from 0, so that both sides of the line have the
  // same distance from its centre.
  const auto whole = [](double number) {
    return static_cast<std::int64_t>(number < 0 ? number - .5 : number + .5);
  };
  const std::int64_t aside_x = whole(-down / length * kHalfWidth);
  const std::int64_t aside_y = whole(across / length * kHalfWidth);
  const auto aside = [&](RasterPoint point, std::int64_t times) {
    point.x += times * aside_x;
    point.y += times * aside_y;
    return point;
  };
  const RasterPoint a = aside(from, 1), b = aside(to, 1), c = aside(to, -1), d = aside(from, -1);
  add_triangle({a, b, c}, paint);
  add_triangle({a, c, d}, paint);
}

void Raster::add_point(const RasterPoint& point, const Paint& paint) {
  constexpr std::int64_t kRadius = kSubSamples * kSamples;
  const Rgb colour = lit(paint.by_value ? value_colour(point.share) : paint.colour, paint.light);
  for (std::int64_t row = first_sample(point.y - kRadius); row <= last_sample(point.y + kRadius);
       ++row)
    for (std::int64_t i = first_sample(point.x - kRadius); i <= last_sample(point.x + kRadius);
         ++i) {
      ++work_;
      const std::int64_t across = i * kSubSamples + kMiddle - point.x;
      const std::int64_t down = row * kSubSamples + kMiddle - point.y;
      if (across * across + down * down > kRadius * kRadius) continue;
      if (row < 0 || row >= down_ || i < 0 || i >= across_) continue;
      put(samples_[static_cast<std::size_t>(row * across_ + i)], static_cast<float>(point.depth),
          colour);
    }
}

bool Raster::is_empty() const {
  return std::all_of(samples_.begin(), samples_.end(),
                     [](const Sample& sample) { return sample.depth == kFar; });
}

Image Raster::image(std::uint64_t& covered) const {
  Image image(static_cast<std::uint32_t>(across_ / kSamples),
              static_cast<std::uint32_t>(down_ / kSamples));
  covered = 0;
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      std::uint32_t red = 0, green = 0, blue = 0;
      bool is_covered = false;
      for (std::uint32_t s = 0; s < kSamples * kSamples; ++s) {
        const std::size_t row = std::size_t{y} * kSamples + s / kSamples;
        const Sample& sample = samples_[row * static_cast<std::size_t>(across_) +
                                        std::size_t{x} * kSamples + s % kSamples];
        red += sample.colour.red;
        green += sample.colour.green;
        blue += sample.colour.blue;
        is_covered = is_covered || sample.depth != kFar;
      }
      const auto mean = [](std::uint32_t sum) {
        return static_cast<std::uint8_t>((sum + kSamples * kSamples / 2) / (kSamples * kSamples));
      };
      image.set(x, y, {mean(red), mean(green), mean(blue)});
      if (is_covered) ++covered;
    }
  return image;
}

}  // namespace shm::converters
