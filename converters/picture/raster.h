// Raster: a grid of samples, four per pixel, each with a colour and a depth, and functions that
// draw on it. Positions are integers in units of 1/256 of the distance between samples, so that the
// set of samples that a triangle covers is computed exactly. If two triangles share an edge, each
// sample on the edge belongs to exactly one of them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "picture/colours.h"
#include "picture/image.h"

namespace shm::converters {

inline constexpr std::uint32_t kSamples = 2;        // samples per pixel in each direction
inline constexpr std::int64_t kSubSamples = 256;    // number of position units per sample
inline constexpr std::uint32_t kMostPixels = 4096;  // maximum width and height of a picture

// A position on the raster.
struct RasterPoint {
  // Distances from the left and from the top of the picture, -2^24..2^24 (kSubSamples units per
  // sample).
  std::int64_t x = 0, y = 0;
  double depth = 0;  // finite; larger values are nearer to the viewer
  double share = 0;  // value for Paint::by_value: 0..1, or NaN
};

// How samples are coloured.
struct Paint {
  Rgb colour;
  std::uint32_t light = 256;  // intensity of light, see lit()
  // If true, the colour is value_colour() of the interpolated RasterPoint::share, and `colour` is
  // not used.
  bool by_value = false;

  // Intensity of light (0..256) for samples whose distance from an outline is at most one sample.
  std::uint32_t outline_light = 256;
};

class Raster {
 public:
  // Creates a raster for an image of this size in pixels. Width and height must be 1..kMostPixels.
  // Needs 32 bytes per pixel.
  Raster(std::uint32_t width, std::uint32_t height);

  // Draws a triangle, whose corners may be clockwise or counter-clockwise. A sample belongs to the
  // triangle if its centre is inside, or on an upper or left edge. Bit e of `outlines` is set if
  // the edge from corner e to the next corner is an outline. Returns false if the triangle has no
  // area.
  bool add_triangle(const std::array<RasterPoint, 3>& corners, const Paint& paint,
                    unsigned outlines = 0);
  // Draws a line, one pixel wide, with square ends. If the line is shorter than the distance
  // between two samples, a point is drawn.
  void add_line(const RasterPoint& from, const RasterPoint& to, const Paint& paint);
  // Draws a disc with a diameter of two pixels.
  void add_point(const RasterPoint& point, const Paint& paint);

  // Returns the number of samples and rows visited so far, as a measure of the time spent drawing.
  std::uint64_t work() const { return work_; }
  bool is_empty() const;
  // Returns the image, in which the colour of each pixel is the mean of its samples. Sets `covered`
  // to the number of pixels on which something was drawn.
  Image image(std::uint64_t& covered) const;

 private:
  // kFar is the depth of samples on which nothing was drawn. A new sample replaces an old sample
  // only if it is nearer by more than kSameDepth. Therefore, if two faces coincide, the face that
  // is drawn first stays visible.
  static constexpr float kFar = -1e30F;
  static constexpr float kSameDepth = 1e-6F;
  struct Sample {
    float depth = kFar;
    Rgb colour = kBackground;
  };
  static void put(Sample& sample, float depth, Rgb colour) {
    if (depth > sample.depth + kSameDepth) sample = {depth, colour};
  }

  std::int64_t across_, down_;  // size in samples
  std::vector<Sample> samples_;
  std::uint64_t work_ = 0;
};

}  // namespace shm::converters
