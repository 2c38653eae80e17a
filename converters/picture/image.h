// Image: the colours of pixels, stored row by row from the upper left corner.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace shm::converters {

struct Rgb {
  std::uint8_t red = 0, green = 0, blue = 0;
  bool operator==(const Rgb&) const = default;
};

inline constexpr Rgb kBackground = {255, 255, 255};
inline constexpr Rgb kInk = {38, 38, 38};  // colour of text

struct Image {
  std::uint32_t width = 0, height = 0;  // size in pixels
  std::vector<Rgb> pixels;              // width * height

  Image() = default;
  Image(std::uint32_t across, std::uint32_t down)
      : width(across), height(down), pixels(std::size_t{across} * down, kBackground) {}

  Rgb at(std::uint32_t x, std::uint32_t y) const { return pixels[std::size_t{y} * width + x]; }
  // Sets a pixel. Does nothing if the pixel is outside of the image.
  void set(std::int64_t x, std::int64_t y, Rgb colour) {
    if (x < 0 || y < 0 || x >= std::int64_t{width} || y >= std::int64_t{height}) return;
    pixels[static_cast<std::size_t>(y) * width + static_cast<std::size_t>(x)] = colour;
  }
  void fill(std::int64_t left, std::int64_t top, std::int64_t across, std::int64_t down,
            Rgb colour) {
    for (std::int64_t y = top; y < top + down; ++y)
      for (std::int64_t x = left; x < left + across; ++x) set(x, y, colour);
  }
};

}  // namespace shm::converters
