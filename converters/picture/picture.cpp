#include "picture/picture.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace shm::converters {
namespace {

class Painter {
 public:
  Painter(const Surface& surface, const PictureOptions& options, const Colouring* colouring,
          const std::optional<ShownRange>& range, const PictureFrame& frame)
      : surface_(surface),
        options_(options),
        colouring_(colouring),
        range_(range),
        camera_(surface, options.view, options.up, frame),
        raster_(options.width, options.height) {
    const Vector &right = camera_.right(), &up = camera_.up(), &view = camera_.view();
    for (std::size_t i = 0; i < 3; ++i) lamp_[i] = -.4 * right[i] + .6 * up[i] + .7 * view[i];
    lamp_ = unit(lamp_).value_or(view);
  }

  const Raster& raster() const { return raster_; }

  // Draws a face. Returns false if the face cannot be drawn because it has no area, or because one
  // of its corners is not finite.
  bool add_face(std::size_t f) {
    if (!see(f)) return false;
    const std::size_t corners = seen_.size();
    Paint paint = paint_of(f);
    if (corners == 0) return false;
    if (corners == 1) {
      raster_.add_point(seen_[0], paint);
      return true;
    }
    if (corners == 2) {
      paint.light = kLightOfLines;
      raster_.add_line(seen_[0], seen_[1], paint);
      return true;
    }
    const auto normal = unit(normal_of(places_));
    if (!normal) return false;
    paint.light = light_on(*normal);
    paint.outline_light = light_of_outline();
    for (std::size_t i = 1; i + 1 < corners; ++i) {
      unsigned outlines = 0;
      if (paint.outline_light < 256)
        outlines = (i == 1 && is_outline(f, 0) ? 1U : 0U) | (is_outline(f, i) ? 2U : 0U) |
                   (i + 2 == corners && is_outline(f, i + 1) ? 4U : 0U);
      raster_.add_triangle({seen_[0], seen_[i], seen_[i + 1]}, paint, outlines);
    }
    return true;
  }

  // Draws the edges of a polygon as lines.
  void add_edges(std::size_t f) {
    if (surface_.face(f).size() < 3 || !see(f)) return;
    Paint paint = paint_of(f);
    paint.light = kLightOfLines;
    for (std::size_t i = 0; i < seen_.size(); ++i)
      if (is_outline(f, i))
        raster_.add_line(seen_[i], seen_[i + 1 < seen_.size() ? i + 1 : 0], paint);
  }

 private:
  static constexpr std::uint32_t kLightOfLines = 200;

  // Projects the corners of a face and stores them in places_ and seen_. Returns false if a corner
  // is not finite. The corners are rotated so that the corner with the lowest x (if equal, the
  // lowest y, then z) comes first. A face therefore looks the same no matter which of its corners
  // comes first in the surface.
  bool see(std::size_t f) {
    const auto face = surface_.face(f);
    if (!camera_.place(face, places_)) return false;
    const auto least = std::min_element(places_.begin(), places_.end());
    turn_ = static_cast<std::size_t>(least - places_.begin());
    std::rotate(places_.begin(), least, places_.end());
    seen_.clear();
    for (std::size_t i = 0; i < face.size(); ++i) {
      seen_.push_back(camera_.seen(places_[i]));
      if (colouring_ == nullptr || !colouring_->of_points) continue;
      const std::uint32_t vertex = face[(i + turn_) % face.size()];
      seen_.back().share = share_of(colouring_->values[vertex], range_);
    }
    return true;
  }

  // Returns true if the edge from corner `i` of seen_ is an outline of a side of a cell.
  // Precondition: see(f) has been called.
  bool is_outline(std::size_t f, std::size_t i) const {
    if (surface_.inner_edges.empty()) return true;
    const std::size_t corner = (i + turn_) % surface_.face(f).size();
    return surface_.inner_edges[static_cast<std::size_t>(surface_.face_begin[f]) + corner] == 0;
  }

  Paint paint_of(std::size_t f) const {
    Paint paint;
    if (colouring_ == nullptr)
      paint.colour = block_colour(surface_.blocks[f]);
    else if (colouring_->of_points)
      paint.by_value = true;
    else
      paint.colour = value_colour(share_of(colouring_->values[f], range_));
    return paint;
  }

  // Returns the intensity of the light on a face. The light has three parts: light from the viewer,
  // a weaker lamp above the viewer's left shoulder, which makes the sides of a box look different,
  // and some ambient light. If colours represent values, shading is weaker.
  std::uint32_t light_on(const Vector& normal) const {
    const double facing = dot(normal, camera_.view());
    const double sideways = std::max(0.0, (facing < 0 ? -1 : 1) * dot(normal, lamp_));
    const double shade = colouring_ == nullptr ? .6 : .4;
    const double light = 1 - shade * (1 - .6 * std::fabs(facing) - .4 * sideways);
    return static_cast<std::uint32_t>(std::clamp(light, 0.0, 1.0) * 256 + .5);
  }

  // Returns the light intensity with which the outline of a face is drawn, or 256 if the face has
  // no outline. If outlines of all faces are requested, those of narrow faces are lighter. With
  // dark outlines, groups of narrow faces would look like dark spots, because most of their samples
  // are on outlines.
  std::uint32_t light_of_outline() const {
    // An outline is darker than its face by up to kDark (of 256), multiplied by a factor that
    // depends on the width of the face in pixels. If all outlines are requested, the factor is
    // width / kNarrow, but at least kLeast and at most 1. Otherwise, it increases from 0 at kNarrow
    // to 1 at kWide.
    constexpr double kDark = 150, kLeast = .25, kNarrow = 4, kWide = 8;
    std::int64_t area = 0;  // twice the area
    double longest = 0;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      const RasterPoint &a = seen_[i], &b = seen_[i + 1 < seen_.size() ? i + 1 : 0];
      area += (a.x - seen_[0].x) * (b.y - seen_[0].y) - (a.y - seen_[0].y) * (b.x - seen_[0].x);
      const auto across = static_cast<double>(b.x - a.x), down = static_cast<double>(b.y - a.y);
      longest = std::max(longest, across * across + down * down);
    }
    if (longest == 0) return 256;
    const double width = std::fabs(static_cast<double>(area)) / 2 / std::sqrt(longest) /
                         static_cast<double>(kSubSamples * kSamples);
    const double share = options_.edges
                             ? std::clamp(width / kNarrow, kLeast, 1.0)
                             : std::clamp((width - kNarrow) / (kWide - kNarrow), 0.0, 1.0);
    return 256 - static_cast<std::uint32_t>(share * kDark + .5);
  }

  const Surface& surface_;
  const PictureOptions& options_;
  const Colouring* colouring_;
  const std::optional<ShownRange>& range_;
  Camera camera_;
  Raster raster_;
  Vector lamp_{};
  std::vector<Vector> places_;  // positions of the corners of one face
  std::vector<RasterPoint> seen_;
  std::size_t turn_ = 0;  // index in the face of the first corner in places_ and seen_
};

}  // namespace

Result<Picture> draw_picture(const Surface& surface, const PictureOptions& options,
                             const Colouring* colouring, const Progress& progress) {
  constexpr std::size_t kFacesAtOnce = 4096;
  constexpr std::uint64_t kCoverings = 1000, kAnyWork = std::uint64_t{1} << 30;
  const std::uint64_t samples = std::uint64_t{options.width} * options.height * kSamples * kSamples;
  const std::uint64_t most_work = options.most_work.value_or(kCoverings * samples + kAnyWork);
  Picture picture;
  if (colouring != nullptr) picture.range = range_of(colouring->values);
  const std::uint32_t strip =
      colouring == nullptr ? 0 : legend_height(options.width, options.height);
  const std::uint32_t margin =
      std::max<std::uint32_t>(2, std::min(options.width, options.height - strip) / 24);
  Painter painter(
      surface, options, colouring, picture.range,
      {margin, margin, options.width - 2 * margin, options.height - strip - 2 * margin});
  const auto each_face = [&](auto&& draw) -> Result<void> {
    for (std::size_t f = 0; f < surface.faces(); ++f) {
      draw(f);
      if (painter.raster().work() > most_work)
        return Error{.code = ErrorCode::over_limit,
                     .detail = "too many faces overlap: drawing stopped at face " +
                               std::to_string(f) + " of " + std::to_string(surface.faces())};
      if (progress && f % kFacesAtOnce == 0) progress("drawing", f, surface.faces());
    }
    return {};
  };
  if (auto drawn = each_face(
          [&](std::size_t f) { ++(painter.add_face(f) ? picture.drawn : picture.skipped); });
      !drawn)
    return drawn.error();
  if (painter.raster().is_empty())
    if (auto drawn = each_face([&](std::size_t f) { painter.add_edges(f); }); !drawn)
      return drawn.error();
  picture.image = painter.raster().image(picture.covered);
  if (colouring != nullptr) draw_legend(picture.image, {colouring->name, picture.range});
  return picture;
}

}  // namespace shm::converters
