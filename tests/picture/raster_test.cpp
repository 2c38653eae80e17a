// Tests of the raster: which samples a triangle covers, which of several triangles is visible,
// lines and points, and positions outside the picture.
#include "picture/raster.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "support/feature_files.h"

namespace shm::converters {
namespace {

constexpr std::int64_t kPixel = kSamples * kSubSamples;  // positions per pixel
constexpr Rgb kRed = {200, 0, 0}, kGreen = {0, 200, 0};

RasterPoint at(std::int64_t x, std::int64_t y, double depth = 0, double share = 0) {
  return {x, y, depth, share};
}

Image image_of(const Raster& raster) {
  std::uint64_t covered = 0;
  return raster.image(covered);
}

std::uint64_t covered_by(const Raster& raster) {
  std::uint64_t covered = 0;
  (void)raster.image(covered);
  return covered;
}

TEST(Raster, ATriangleCoversThePixelsInIt) {
  Raster raster(8, 8);
  EXPECT_TRUE(raster.is_empty());
  // The triangle is half of a square of 4 x 4 pixels. The pixels along its long edge are half
  // covered.
  EXPECT_TRUE(raster.add_triangle(
      {at(kPixel, kPixel), at(5 * kPixel, kPixel), at(kPixel, 5 * kPixel)}, {kRed}));
  const Image image = image_of(raster);
  for (std::uint32_t y = 0; y < 8; ++y)
    for (std::uint32_t x = 0; x < 8; ++x) {
      const bool in_square = x >= 1 && x < 5 && y >= 1 && y < 5;
      const Rgb found = image.at(x, y);
      if (in_square && x + y < 5)
        EXPECT_EQ(found, kRed) << x << ' ' << y;
      else if (in_square && x + y == 5)
        EXPECT_TRUE(found != kRed && found != kBackground) << x << ' ' << y;
      else
        EXPECT_EQ(found, kBackground) << x << ' ' << y;
    }
  EXPECT_EQ(covered_by(raster), 10u);
  EXPECT_FALSE(raster.is_empty());
}

TEST(Raster, CornersGoRoundEitherWay) {
  Raster one(8, 8), other(8, 8);
  one.add_triangle({at(300, 200), at(3700, 900), at(1500, 3900)}, {kRed});
  other.add_triangle({at(300, 200), at(1500, 3900), at(3700, 900)}, {kRed});
  EXPECT_EQ(image_of(one).pixels, image_of(other).pixels);
}

/// Draws each triangle into a separate raster and counts the samples that it covers. Together, the
/// triangles must cover each sample of the square exactly once.
TEST(Raster, SharedEdgesLeaveNoGapAndNoDouble) {
  constexpr std::uint32_t kSide = 12;
  PlainRandom random(7);
  for (int turn = 0; turn < 40; ++turn) {
    // The triangles form a fan around an inner point. The outer points are the four corners of the
    // raster and one point on each of its sides.
    const auto on = [&] { return static_cast<std::int64_t>(random.below(kSide * kPixel - 1)) + 1; };
    const std::int64_t end = kSide * kPixel;
    const std::vector<RasterPoint> border = {at(0, 0),     at(on(), 0),   at(end, 0), at(end, on()),
                                             at(end, end), at(on(), end), at(0, end), at(0, on())};
    const RasterPoint middle = turn % 4 == 0 ? at(end / 2, end / 2) : at(on(), on());
    std::uint64_t samples = 0;
    Raster all(kSide, kSide);
    for (std::size_t i = 0; i < border.size(); ++i) {
      const std::array<RasterPoint, 3> corners = {middle, border[i],
                                                  border[(i + 1) % border.size()]};
      // work() returns the number of covered samples, plus the number of rows that may contain
      // samples, plus one per triangle.
      Raster alone(kSide, kSide);
      alone.add_triangle(corners, {kRed});
      all.add_triangle(corners, {kRed});
      std::int64_t top = corners[0].y, bottom = corners[0].y;
      for (const RasterPoint& corner : corners) {
        top = std::min(top, corner.y);
        bottom = std::max(bottom, corner.y);
      }
      const auto rows =
          (bottom + kSubSamples / 2) / kSubSamples - (top + kSubSamples / 2 - 1) / kSubSamples;
      if (alone.work() > 1) samples += alone.work() - 1 - static_cast<std::uint64_t>(rows);
    }
    EXPECT_EQ(samples, kSide * kSide * kSamples * kSamples) << turn;
    EXPECT_EQ(image_of(all).pixels, std::vector<Rgb>(kSide * kSide, kRed)) << turn;
  }
}

TEST(Raster, WhatIsNearerIsSeen) {
  const std::array<RasterPoint, 3> far = {at(0, 0, 0), at(16 * kPixel, 0, 0),
                                          at(0, 16 * kPixel, 0)};
  std::array<RasterPoint, 3> near = far;
  for (RasterPoint& corner : near) corner.depth = .5;
  for (const bool near_first : {false, true}) {
    Raster raster(8, 8);
    raster.add_triangle(near_first ? near : far, {near_first ? kGreen : kRed});
    raster.add_triangle(near_first ? far : near, {near_first ? kRed : kGreen});
    EXPECT_EQ(image_of(raster).at(3, 3), kGreen);
  }
  // Two triangles intersect. Each of them is visible in the region in which it is nearer to the
  // viewer.
  Raster crossing(8, 8);
  crossing.add_triangle({at(0, 0, -1), at(16 * kPixel, 0, 3), at(0, 16 * kPixel, -1)}, {kRed});
  crossing.add_triangle({at(0, 0, 0), at(16 * kPixel, 0, 0), at(0, 16 * kPixel, 0)}, {kGreen});
  EXPECT_EQ(image_of(crossing).at(1, 1), kGreen);
  EXPECT_EQ(image_of(crossing).at(7, 1), kRed);
}

TEST(Raster, OfFacesInOnePlaceTheFirstStays) {
  Raster raster(4, 4);
  for (const Rgb colour : {kRed, kGreen})
    raster.add_triangle({at(-9, -9, .1), at(9 * kPixel, 0, .7), at(0, 9 * kPixel, .3)}, {colour});
  EXPECT_EQ(image_of(raster).at(1, 1), kRed);
}

TEST(Raster, ValuesGoFromCornerToCorner) {
  Raster raster(64, 8);
  const Paint paint = {{}, 256, true};
  const RasterPoint a = at(0, 0, 0, 0), b = at(64 * kPixel, 0, 0, 1),
                    c = at(64 * kPixel, 8 * kPixel, 0, 1), d = at(0, 8 * kPixel, 0, 0);
  raster.add_triangle({a, b, c}, paint);
  raster.add_triangle({a, c, d}, paint);
  const Image image = image_of(raster);
  for (std::uint32_t x = 0; x < 64; ++x) {
    const Rgb wanted = value_colour((x + .5) / 64), found = image.at(x, 4);
    EXPECT_NEAR(found.red, wanted.red, 4) << x;
    EXPECT_NEAR(found.green, wanted.green, 4) << x;
    EXPECT_NEAR(found.blue, wanted.blue, 4) << x;
  }
  // A triangle whose value is NaN is grey.
  Raster grey(8, 8);
  grey.add_triangle({at(0, 0), at(20 * kPixel, 0, 0, std::nan("")), at(0, 20 * kPixel)}, paint);
  EXPECT_EQ(image_of(grey).at(2, 2), kNoValue);
}

TEST(Raster, OutlinesAreDarkOnTheirEdgesAlone) {
  Raster raster(16, 16);
  const Paint paint = {kRed, 256, false, 128};
  // Outlines the upper edge and the left edge of the triangle, but not its long edge.
  raster.add_triangle({at(0, 0), at(16 * kPixel, 0), at(0, 16 * kPixel)}, paint, 1 | 4);
  const Image image = image_of(raster);
  const Rgb dark = lit(kRed, 128);
  EXPECT_EQ(image.at(5, 0).red, (dark.red + kRed.red + 1) / 2);
  EXPECT_EQ(image.at(0, 5).red, (dark.red + kRed.red + 1) / 2);
  EXPECT_EQ(image.at(5, 1), kRed);
  EXPECT_EQ(image.at(7, 7), kRed);
}

TEST(Raster, LinesAreAPixelWideAndPointsTwo) {
  Raster raster(16, 16);
  raster.add_line(at(2 * kPixel, 8 * kPixel + kPixel / 2), at(14 * kPixel, 8 * kPixel + kPixel / 2),
                  {kRed});
  EXPECT_EQ(covered_by(raster), 12u);
  EXPECT_EQ(image_of(raster).at(8, 8), kRed);
  Raster point(16, 16);
  point.add_point(at(8 * kPixel, 8 * kPixel), {kRed});
  EXPECT_EQ(covered_by(point), 4u);
  // A line of length 0 is drawn as a point.
  Raster none(16, 16);
  none.add_line(at(8 * kPixel, 8 * kPixel), at(8 * kPixel, 8 * kPixel), {kRed});
  EXPECT_EQ(image_of(none).pixels, image_of(point).pixels);
}

TEST(Raster, WhatHasNoAreaIsNotThere) {
  Raster raster(8, 8);
  EXPECT_FALSE(raster.add_triangle({at(0, 0), at(0, 0), at(0, 0)}, {kRed}));
  EXPECT_FALSE(raster.add_triangle({at(0, 0), at(500, 500), at(1000, 1000)}, {kRed}));
  EXPECT_TRUE(raster.is_empty());
}

TEST(Raster, PlacesBeyondThePictureAreCut) {
  constexpr std::int64_t kFar = std::int64_t{1} << 24;
  Raster raster(8, 8);
  raster.add_triangle({at(-kFar, -kFar), at(kFar, -kFar), at(0, kFar)}, {kRed});
  EXPECT_EQ(image_of(raster).pixels, std::vector<Rgb>(64, kRed));
  for (const std::int64_t place : {-kFar, kFar}) {
    Raster none(8, 8);
    none.add_point(at(place, 0), {kRed});
    none.add_point(at(0, place), {kRed});
    none.add_line(at(place, 0), at(place, kFar), {kRed});
    none.add_triangle({at(place, place), at(place + 9, place), at(place, place + 9)}, {kRed});
    EXPECT_TRUE(none.is_empty());
  }
  // The work for a triangle is proportional to the number of its rows, however narrow the triangle
  // is.
  Raster narrow(8, 8);
  narrow.add_triangle({at(0, -kFar), at(1, -kFar), at(4000, kFar)}, {kRed});
  EXPECT_LT(narrow.work(), 300u);
}

}  // namespace
}  // namespace shm::converters
