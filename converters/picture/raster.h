// Raster: samples with a depth each, four to a pixel, and what is drawn on them. Places are whole
// numbers, 256 to a sample, and which samples a triangle covers follows from them exactly:
// triangles that share an edge leave no sample between them out, and cover none twice.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "picture/colours.h"
#include "picture/image.h"

namespace shm::converters {

inline constexpr std::uint32_t kSamples = 2;        // of a pixel, across and down
inline constexpr std::int64_t kSubSamples = 256;    // places to a sample
inline constexpr std::uint32_t kMostPixels = 4096;  // of a picture, across and down

// Where something is on the raster.
struct RasterPoint {
  // Places from the left and from the top, -2^24..2^24.
  std::int64_t x = 0, y = 0;
  double depth = 0;  // the larger, the nearer; finite
  double share = 0;  // of a value, for Paint::by_value: 0..1, or NaN
};

// What samples become.
struct Paint {
  Rgb colour;
  std::uint32_t light = 256;  // as lit() takes it
  bool by_value = false;      // value_colour() of the points' shares instead of `colour`
  // Of samples that are at most one sample from an edge which is an outline: 0..256.
  std::uint32_t outline_light = 256;
};

class Raster {
 public:
  // Of an image of that size in pixels, each 1..kMostPixels. Takes 32 bytes for each pixel.
  Raster(std::uint32_t width, std::uint32_t height);

  // A sample belongs to a triangle where its middle is inside, or on an edge that is the upper or
  // the left one. Corners go round either way. `outlines`: bit e for the edge from corner e to the
  // next one. False where the triangle has no area.
  bool add_triangle(const std::array<RasterPoint, 3>& corners, const Paint& paint,
                    unsigned outlines = 0);
  // One pixel wide, its ends cut off square; from a point to itself: as add_point.
  void add_line(const RasterPoint& from, const RasterPoint& to, const Paint& paint);
  // A disc of two pixels.
  void add_point(const RasterPoint& at, const Paint& paint);

  // Samples and rows that have been looked at: what drawing takes, in all.
  std::uint64_t work() const { return work_; }
  bool is_empty() const;
  // Pixels are the means of their samples; `covered`: those of which something is drawn.
  Image image(std::uint64_t& covered) const;

 private:
  // Nothing is drawn yet at depth kFar. What is nearer by less than kSameDepth is not nearer: of
  // faces in one place the first one stays.
  static constexpr float kFar = -1e30F;
  static constexpr float kSameDepth = 1e-6F;
  struct Sample {
    float depth = kFar;
    Rgb colour = kBackground;
  };
  static void put(Sample& sample, float depth, Rgb colour) {
    if (depth > sample.depth + kSameDepth) sample = {depth, colour};
  }

  std::int64_t across_, down_;  // samples
  std::vector<Sample> samples_;
  std::uint64_t work_ = 0;
};

}  // namespace shm::converters
