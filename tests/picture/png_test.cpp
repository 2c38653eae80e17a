// Tests of writing images as PNG files, with and without a palette. preview_test.py checks that the
// pixels are read back unchanged.
#include "picture/png.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace shm::converters {
namespace {

/// Returns an image with `colours` different colours, at most 300. Some of them have the same red
/// value, so the red channel alone does not distinguish them.
Image image_of(std::uint32_t colours) {
  Image image(300, 4);
  for (std::uint32_t x = 0; x < image.width; ++x) {
    const std::uint32_t number = x % colours;
    for (std::uint32_t y = 0; y < image.height; ++y)
      image.set(x, y,
                {static_cast<std::uint8_t>(number), static_cast<std::uint8_t>(number >> 4), 77});
  }
  return image;
}

std::string text_of(const Image& image) {
  const auto bytes = png_of(image);
  EXPECT_TRUE(bytes);
  if (!bytes) return {};
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

TEST(Png, FewColoursHaveAPalette) {
  if (!can_make_png()) GTEST_SKIP() << "without libpng";
  constexpr std::size_t kDepth = 24, kKind = 25;  // bytes of a file
  for (const std::uint32_t colours : {1, 2, 17, 255, 256, 257, 300}) {
    const std::string file = text_of(image_of(colours));
    ASSERT_GT(file.size(), kKind);
    EXPECT_EQ(file[kDepth], 8);
    const std::size_t palette = file.find("PLTE");
    EXPECT_EQ(file[kKind], colours <= 256 ? 3 : 2) << colours;
    ASSERT_EQ(palette != std::string::npos, colours <= 256) << colours;
    if (palette == std::string::npos) continue;
    const auto byte = [&](std::size_t at) {
      return static_cast<std::size_t>(static_cast<unsigned char>(file[at]));
    };
    EXPECT_EQ(byte(palette - 2) << 8 | byte(palette - 1), 3 * colours);
  }
}

TEST(Png, FlatColoursAndFlowingOnesAreSmall) {
  if (!can_make_png()) GTEST_SKIP() << "without libpng";
  Image flowing(256, 256), flat(256, 256);
  for (std::uint32_t y = 0; y < 256; ++y)
    for (std::uint32_t x = 0; x < 256; ++x) {
      flowing.set(x, y,
                  {static_cast<std::uint8_t>(x), static_cast<std::uint8_t>(y),
                   static_cast<std::uint8_t>(x + y)});
      // Small tiles in 300 colours, without regularity.
      const std::uint32_t tile = y / 4 * 64 + x / 4, number = tile * 7919 % 4093 % 300;
      flat.set(x, y,
               {static_cast<std::uint8_t>(number * 37), static_cast<std::uint8_t>(number * number),
                static_cast<std::uint8_t>(number)});
    }
  EXPECT_LT(text_of(flowing).size(), 2000u);
  EXPECT_LT(text_of(flat).size(), 4500u);
}

}  // namespace
}  // namespace shm::converters
