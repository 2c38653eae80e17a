// Tests of complete pictures: the visible part of a mesh, the direction of view, colours, the
// legend, and meshes with extreme or invalid numbers.
#include "picture/picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <tuple>

#include "picture/drawn_surface.h"
#include "picture/text.h"
#include "support/feature_files.h"

namespace shm::converters {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Picture draw(const DrawnSurface& mesh, const PictureOptions& options = {},
             const Colouring* colouring = nullptr) {
  auto picture = draw_picture(mesh.surface(), options, colouring);
  EXPECT_TRUE(picture);
  return picture ? std::move(*picture) : Picture{};
}

PictureOptions small(std::optional<Vector> view = {}) {
  PictureOptions options;
  options.width = 160;
  options.height = 120;
  options.view = view;
  return options;
}

std::size_t colours_of(const Image& image) {
  std::set<std::tuple<int, int, int>> found;
  for (const Rgb pixel : image.pixels) found.insert({pixel.red, pixel.green, pixel.blue});
  return found.size();
}

/// Returns true if the pixel is a lighter or darker shade of this colour, or the colour itself.
bool is_like(Rgb pixel, Rgb colour) {
  const double light = static_cast<double>(pixel.red + pixel.green + pixel.blue) /
                       (colour.red + colour.green + colour.blue);
  return std::fabs(pixel.red - light * colour.red) < 3 &&
         std::fabs(pixel.green - light * colour.green) < 3 &&
         std::fabs(pixel.blue - light * colour.blue) < 3;
}

TEST(Picture, ABoxFillsItsFrameAndNothingElse) {
  const DrawnSurface box = DrawnSurface::box(1, {2, 1, 1});
  const Picture picture = draw(box, small(Vector{0, -1, 0}));
  EXPECT_EQ(picture.drawn, 6u);
  EXPECT_EQ(picture.skipped, 0u);
  // The picture has 160 x 120 pixels, with a margin of 5 pixels. The visible side of the box is
  // twice as wide as high and covers 150 x 75 pixels. Its upper and lower edges are in the middle
  // of a pixel row, so pixels of 76 rows are covered.
  EXPECT_EQ(picture.covered, 150u * 76);
  EXPECT_NE(picture.image.at(5, 60), kBackground);
  EXPECT_NE(picture.image.at(154, 60), kBackground);
  EXPECT_EQ(picture.image.at(4, 60), kBackground);
  EXPECT_EQ(picture.image.at(155, 60), kBackground);
}

TEST(Picture, TheThreeSidesThatAreSeenDiffer) {
  const DrawnSurface box = DrawnSurface::box(1, {1, 1, 1});
  PictureOptions options = small();
  const Image image = draw(box, options).image;
  const Rgb top = image.at(75, 25), front = image.at(65, 75), right = image.at(105, 75);
  EXPECT_TRUE(is_like(top, block_colour(0)));
  EXPECT_TRUE(is_like(front, block_colour(0)));
  EXPECT_TRUE(is_like(right, block_colour(0)));
  EXPECT_NE(top, front);
  EXPECT_NE(front, right);
  EXPECT_NE(top, right);
  EXPECT_GT(std::min({top.green, front.green, right.green}), 70);  // nothing is black
}

TEST(Picture, BlocksHaveColoursOfTheirOwn) {
  std::set<std::tuple<int, int, int>> found;
  for (std::uint32_t block = 0; block < 21; ++block) {
    const Rgb colour = block_colour(block);
    EXPECT_TRUE(found.insert({colour.red, colour.green, colour.blue}).second) << block;
  }
  EXPECT_EQ(block_colour(21), block_colour(0));
  EXPECT_EQ(block_colour(~std::uint32_t{0}), block_colour(~std::uint32_t{0} % 21));
}

TEST(Picture, LightnessOfValuesGrows) {
  const auto lightness = [](int i) {
    const Rgb colour = value_colour(i / 255.0);
    return .2126 * colour.red + .7152 * colour.green + .0722 * colour.blue;
  };
  for (int i = 3; i <= 255; ++i) EXPECT_GT(lightness(i), lightness(i - 3)) << i;
  EXPECT_EQ(value_colour(-5), value_colour(0));
  EXPECT_EQ(value_colour(kInfinity), value_colour(1));
  EXPECT_EQ(value_colour(kNaN), kNoValue);
}

TEST(Picture, FlatMeshesAreLookedAtFromTheirNormal) {
  for (const std::size_t axis : {0, 1, 2}) {
    DrawnSurface sheet;
    sheet.add_sheet(4, axis, 0);
    const Picture picture = draw(sheet, small());
    // A square of the full height.
    EXPECT_EQ(picture.covered, 110u * 110) << axis;
    const Picture asked = draw(sheet, small(Vector{1, 1, 1}));
    EXPECT_LT(asked.covered, 110u * 110) << axis;
  }
  // The face is in an inclined plane, which is not perpendicular to any axis.
  DrawnSurface tilted;
  tilted.add_face({tilted.add_vertex(0, 0, 0), tilted.add_vertex(3, 0, 3),
                   tilted.add_vertex(3, 4, 3), tilted.add_vertex(0, 4, 0)});
  const Picture picture = draw(tilted, small());
  const double wide = 3 * std::sqrt(2.0);
  EXPECT_NEAR(static_cast<double>(picture.covered), 110 * 110 * (4 / wide), 400);
}

TEST(Picture, EdgesAreDrawnWhereFacesAreWide) {
  DrawnSurface coarse, fine;
  coarse.add_sheet(4, 2, 0);
  fine.add_sheet(60, 2, 0);
  PictureOptions with_edges = small();
  with_edges.edges = true;
  EXPECT_GT(colours_of(draw(coarse, small()).image), 2u);
  EXPECT_EQ(draw(coarse, small()).image.pixels, draw(coarse, with_edges).image.pixels);
  EXPECT_EQ(colours_of(draw(fine, small()).image), 2u);
  EXPECT_GT(colours_of(draw(fine, with_edges).image), 2u);
}

TEST(Picture, ValuesOfFacesAndOfVertices) {
  DrawnSurface sheet;
  sheet.add_sheet(2, 2, 0);  // 4 faces, 9 vertices, y varies fastest
  PictureOptions options = small();
  options.height = 200;
  const std::vector<double> of_faces = {-2, 0, kNaN, 6};
  const Colouring flat{"power", false, of_faces};
  const Picture picture = draw(sheet, options, &flat);
  ASSERT_TRUE(picture.range);
  EXPECT_EQ(picture.range->least, -2);
  EXPECT_EQ(picture.range->greatest, 6);
  // The mesh appears as a square of 144 x 144 pixels with its upper left corner at (8, 16). Its y
  // axis points up.
  const auto pixel = [&](double x, double y) {
    return picture.image.at(static_cast<std::uint32_t>(8 + 144 * x),
                            static_cast<std::uint32_t>(16 + 144 * (1 - y)));
  };
  EXPECT_TRUE(is_like(pixel(.25, .25), value_colour(0)));
  EXPECT_TRUE(is_like(pixel(.75, .25), value_colour(.25)));
  EXPECT_TRUE(is_like(pixel(.25, .75), kNoValue));
  EXPECT_TRUE(is_like(pixel(.75, .75), value_colour(1)));

  const std::vector<double> of_points = {0, 1, 2, 0, 1, 2, 0, 1, 2};
  const Colouring smooth{"x", true, of_points};
  const Image image = draw(sheet, options, &smooth).image;
  EXPECT_GT(colours_of(image), 50u);
  EXPECT_LT(image.at(20, 80).green, image.at(80, 75).green);
  EXPECT_LT(image.at(80, 75).green, image.at(140, 80).green);
}

TEST(Picture, RangesThatAreNoneAndHuge) {
  DrawnSurface sheet;
  sheet.add_sheet(2, 2, 0);
  const auto range_of = [&](const std::vector<double>& values) {
    const Colouring colouring{"v", false, values};
    return draw(sheet, small(), &colouring).range;
  };
  EXPECT_FALSE(range_of({kNaN, kInfinity, -kInfinity, kNaN}));
  EXPECT_EQ(range_of({3, 3, 3, kInfinity})->greatest, 3);
  EXPECT_EQ(range_of({-1.7e308, 1.7e308, 0, 5e-324})->least, -1.7e308);
  EXPECT_EQ(range_of({5e-324, 0, 0, 0})->greatest, 5e-324);
}

TEST(Picture, TheLegendHasNameAndRange) {
  EXPECT_EQ(legend_number(0), "0");
  EXPECT_EQ(legend_number(-0.0), "0");
  EXPECT_EQ(legend_number(1.0 / 3), "0.333333");
  EXPECT_EQ(legend_number(-1.5e300), "-1.5e+300");
  Image image(200, 100), other(200, 100), none(200, 100), tiny(60, 60);
  draw_legend(image, {"speed", ShownRange{0, 2}});
  draw_legend(other, {"speed", ShownRange{0, 3}});
  draw_legend(none, {"speed", {}});
  draw_legend(tiny, {"speed", ShownRange{0, 2}});
  EXPECT_NE(image.pixels, other.pixels);
  EXPECT_EQ(colours_of(none), 3u);  // background, ink, grey
  EXPECT_EQ(colours_of(tiny), 1u);
  EXPECT_EQ(legend_height(60, 60), 0u);
  EXPECT_EQ(legend_height(200, 100), 27u);
  // The legend must not change the pixels above it, whatever the name of the array is.
  for (const std::string& name : {std::string(5000, 'x'), std::string("\xff\0\x1b[2J", 6),
                                  std::string("\xc3\xa9t\xc3\xa9")}) {
    Image long_one(200, 100);
    draw_legend(long_one, {name, ShownRange{-1.2345678e-300, 1.2345678e300}});
    for (std::uint32_t y = 0; y < 73; ++y)
      for (std::uint32_t x = 0; x < 200; ++x) ASSERT_EQ(long_one.at(x, y), kBackground);
  }
}

TEST(Picture, TextsAreOfOurFont) {
  EXPECT_EQ(shown_text("T [K]"), "T [K]");
  EXPECT_EQ(shown_text("\xc3\xa9t\xe2\x82\xac\n"), "?t??");
  EXPECT_EQ(text_width(0, 2), 0u);
  EXPECT_EQ(text_width(3, 2), 34u);
  Image image(16, 9);
  draw_text(image, 1, 1, "TI", 1, kInk);
  const char* rows[] = {"#####..###.", "..#.....#..", "..#.....#..", "..#.....#..",
                        "..#.....#..", "..#.....#..", "..#....###."};
  for (std::uint32_t y = 0; y < 7; ++y)
    for (std::uint32_t x = 0; x < 11; ++x)
      EXPECT_EQ(image.at(x + 1, y + 1), rows[y][x] == '#' ? kInk : kBackground) << x << ' ' << y;
  // Clipped at the border.
  draw_text(image, -3, -3, "WWWW", 9, kInk);
  draw_text(image, 1000, 1000, "W", 9, kInk);
  // All printable ASCII characters have different glyphs.
  std::set<std::vector<int>> marks;
  for (char c = ' '; c <= '~'; ++c) {
    Image glyph(5, 7);
    draw_text(glyph, 0, 0, std::string(1, c), 1, kInk);
    std::vector<int> bits;
    for (const Rgb pixel : glyph.pixels) bits.push_back(pixel == kInk ? 1 : 0);
    EXPECT_TRUE(marks.insert(bits).second) << c;
  }
}

/// A polygon that is not planar is divided into a fan of triangles. The picture must not depend on
/// which corner is stored first.
TEST(Picture, FacesLookTheSameFromWhicheverCornerOn) {
  DrawnSurface mesh, turned;
  const std::vector<double> values = {0, 3, 1, 8, 2};
  for (DrawnSurface* one : {&mesh, &turned})
    for (const auto& [x, y, z] :
         {Vector{0, 0, 0}, Vector{2, 0, 1}, Vector{3, 1, -1}, Vector{1, 3, 1}, Vector{-1, 1, 0}})
      one->add_vertex(x, y, z);
  mesh.add_face({0, 1, 2, 3, 4});
  turned.add_face({3, 4, 0, 1, 2});
  const Colouring colouring{"v", true, values};
  const Picture picture = draw(mesh, small(), &colouring);
  EXPECT_GT(picture.covered, 1000u);
  EXPECT_EQ(draw(turned, small(), &colouring).image.pixels, picture.image.pixels);
}

TEST(Picture, EdgesOfNarrowFacesAreNoDarkSpot) {
  const auto green = [](const DrawnSurface& mesh, bool edges) {
    PictureOptions options = small(Vector{0, -1, 0});
    options.edges = edges;
    const Image image = draw(mesh, options).image;
    std::uint64_t sum = 0;
    for (const Rgb pixel : image.pixels) sum += pixel == kBackground ? 0 : pixel.green;
    return sum;
  };
  // Faces of one pixel, two, and four.
  for (const std::uint32_t n : {110, 55, 27}) {
    const DrawnSurface box = DrawnSurface::box(n, {1, 1, 1});
    EXPECT_LT(green(box, true), green(box, false)) << n;
    EXPECT_GT(green(box, true), green(box, false) * 7 / 10) << n;
  }
}

TEST(Picture, PointsAndEdgesAreSeen) {
  DrawnSurface mesh;
  const std::uint32_t a = mesh.add_vertex(0, 0, 0), b = mesh.add_vertex(1, 0, 0),
                      c = mesh.add_vertex(1, 1, 0);
  mesh.add_face({a}, 0);
  EXPECT_EQ(draw(mesh, small()).drawn, 1u);
  EXPECT_GE(draw(mesh, small()).covered, 4u);
  mesh.add_face({b, c}, 3);
  const Picture picture = draw(mesh, small());
  EXPECT_EQ(picture.drawn, 2u);
  EXPECT_GT(picture.covered, 100u);
  // A single point, and no faces.
  DrawnSurface one;
  one.add_face({one.add_vertex(5, 5, 5)});
  EXPECT_GE(draw(one, small()).covered, 4u);
  EXPECT_EQ(draw(DrawnSurface(), small()).covered, 0u);
}

TEST(Picture, FacesTooNarrowForSamplesAreDrawnByTheirEdges) {
  DrawnSurface needle;
  needle.add_face({needle.add_vertex(0, 0, 0), needle.add_vertex(1, 0, 0),
                   needle.add_vertex(1, 1e-5, 0), needle.add_vertex(0, 1e-5, 0)});
  EXPECT_GT(draw(needle, small()).covered, 100u);
  // Seen from within its plane.
  DrawnSurface sheet;
  sheet.add_sheet(3, 2, 0);
  EXPECT_GT(draw(sheet, small(Vector{1, 0, 0})).covered, 50u);
}

TEST(Picture, AnyAxisGoesUp) {
  // If the axes of a box are permuted and the axis that points up is changed accordingly, the
  // picture is the same: 3 units wide and 2 units high.
  const DrawnSurface box = DrawnSurface::box(1, {3, 1, 2});  // seen from -y: 3 wide, 2 high
  const Picture upright = draw(box, small(Vector{0, -1, 0}));
  const auto covered = [](std::array<double, 3> sides, Vector from, std::size_t up) {
    PictureOptions options = small(from);
    options.up = up;
    return draw(DrawnSurface::box(1, sides), options).covered;
  };
  EXPECT_EQ(covered({3, 2, 1}, {0, 0, 1}, 1), upright.covered);
  EXPECT_EQ(covered({2, 3, 1}, {0, 0, 1}, 0), upright.covered);
  EXPECT_NE(covered({2, 3, 1}, {0, 0, 1}, 1), upright.covered);
  // If the view is along the axis that should point up, the y axis points up instead. If the view
  // is along y, the z axis points up.
  EXPECT_EQ(covered({3, 2, 1}, {0, 0, 1}, 2), upright.covered);
  EXPECT_EQ(covered({3, 1, 2}, {0, -1, 0}, 1), upright.covered);
  EXPECT_EQ(covered({1, 2, 3}, {1, 0, 0}, 0), upright.covered);
  // If no direction is given, the box is seen obliquely from above, so that three sides are
  // visible.
  for (std::size_t up = 0; up < 3; ++up) {
    PictureOptions options = small();
    options.up = up;
    DrawnSurface marked = DrawnSurface::box(1, {1, 1, 1});
    for (std::size_t f = 0; f < marked.blocks.size(); ++f)
      marked.blocks[f] = f == 2 * up + 1 ? 1 : 0;  // the upper one of six sides
    const Image image = draw(marked, options).image;
    const Rgb above = image.at(80, 30), below = image.at(60, 80);
    EXPECT_TRUE(is_like(above, block_colour(1))) << up;
    EXPECT_TRUE(is_like(below, block_colour(0))) << up;
  }
}

TEST(Picture, HostileCoordinates) {
  const std::vector<double> numbers = {0,       -0.0,     1,      -1,        1e300,      -1e300,
                                       1.7e308, -1.7e308, 5e-324, kInfinity, -kInfinity, kNaN};
  PlainRandom random(11);
  for (int turn = 0; turn < 300; ++turn) {
    DrawnSurface mesh;
    const auto any = [&] { return numbers[random.below(turn % 3 == 0 ? 9 : numbers.size())]; };
    for (int v = 0; v < 12; ++v) mesh.add_vertex(any(), any(), any());
    for (int f = 0; f < 12; ++f) {
      std::vector<std::uint32_t> corners(random.below(7));
      for (std::uint32_t& corner : corners) corner = static_cast<std::uint32_t>(random.below(12));
      mesh.add_face(corners, static_cast<std::uint32_t>(random.below(1 << 30)));
    }
    std::vector<double> values(12);
    for (double& value : values) value = any();
    const Colouring colouring{"v", turn % 2 == 0, values};
    PictureOptions options = small();
    if (turn % 5 == 0) options.view = Vector{any(), any(), any()};
    options.up = static_cast<std::size_t>(turn) % 3;
    options.edges = turn % 7 == 0;
    const Picture picture = draw(mesh, options, turn % 4 == 0 ? nullptr : &colouring);
    EXPECT_EQ(picture.drawn + picture.skipped, 12u);
    EXPECT_LE(picture.covered, 160u * 120);
  }
}

TEST(Picture, NumbersOfAnySizeGiveTheSamePicture) {
  DrawnSurface plain = DrawnSurface::box(3, {1, 1, 1});
  const Picture picture = draw(plain, small());
  for (const double factor : {0x1p-900, 0x1p900}) {
    DrawnSurface scaled = plain;
    for (double& number : scaled.xyz) number *= factor;
    EXPECT_EQ(draw(scaled, small()).image.pixels, picture.image.pixels);
  }
  // If a coordinate of a vertex is not finite, only the faces that use this vertex are omitted from
  // the picture.
  DrawnSurface holed = plain;
  holed.xyz[0] = kNaN;
  EXPECT_EQ(draw(holed, small()).skipped, 1u);
}

TEST(Picture, CoordinatesOfFourBytes) {
  const DrawnSurface box = DrawnSurface::box(2, {1, 2, 1});
  std::vector<float> narrow(box.xyz.begin(), box.xyz.end());
  Surface surface = box.surface();
  surface.coordinate_type = ScalarType::float32;
  surface.xyz = std::as_bytes(std::span(narrow));
  const auto picture = draw_picture(surface, small());
  ASSERT_TRUE(picture);
  EXPECT_EQ(picture->image.pixels, draw(box, small()).image.pixels);
}

TEST(Picture, FacesOverEachOtherEnd) {
  DrawnSurface mesh;
  const std::uint32_t first = mesh.add_vertex(0, 0, 0);
  mesh.add_vertex(1, 0, 0);
  mesh.add_vertex(1, 1, 0);
  mesh.add_vertex(0, 1, 0);
  // Each covers 48,400 samples.
  for (int f = 0; f < 100; ++f) mesh.add_face({first, first + 1, first + 2, first + 3});
  PictureOptions options = small();
  options.most_work = 5'000'000;
  EXPECT_TRUE(draw_picture(mesh.surface(), options));
  options.most_work = 4'000'000;
  const auto picture = draw_picture(mesh.surface(), options);
  ASSERT_FALSE(picture);
  EXPECT_EQ(picture.error().code, ErrorCode::over_limit);
}

TEST(Picture, SizesFromTheLeastOn) {
  const DrawnSurface box = DrawnSurface::box(2, {1, 1, 1});
  const std::vector<double> values(box.blocks.size(), 1);
  const Colouring colouring{"v", false, values};
  for (const auto& [width, height] :
       {std::pair<std::uint32_t, std::uint32_t>{16, 16}, {16, 300}, {300, 16}, {97, 73}}) {
    PictureOptions options;
    options.width = width;
    options.height = height;
    const Picture picture = draw(box, options, &colouring);
    EXPECT_EQ(picture.image.pixels.size(), std::size_t{width} * height);
    EXPECT_GT(picture.covered, 60u);
  }
}

}  // namespace
}  // namespace shm::converters
