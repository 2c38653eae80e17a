#include "picture/colours.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace shm::converters {
namespace {

// The palette of M. Okabe and K. Ito without black. The first colour is blue.
constexpr std::array<Rgb, 7> kHues = {{{86, 180, 233},
                                       {230, 159, 0},
                                       {0, 158, 115},
                                       {240, 228, 66},
                                       {204, 121, 167},
                                       {213, 94, 0},
                                       {0, 114, 178}}};

// Every seventeenth colour of viridis (N. Smith, S. van der Walt; CC0). Colours that are
// interpolated linearly differ from viridis by at most 7 of 255.
constexpr std::array<Rgb, 16> kValues = {{{0x44, 0x01, 0x54},
                                          {0x48, 0x1a, 0x6c},
                                          {0x47, 0x2f, 0x7d},
                                          {0x41, 0x44, 0x87},
                                          {0x39, 0x56, 0x8c},
                                          {0x31, 0x68, 0x8e},
                                          {0x2a, 0x78, 0x8e},
                                          {0x23, 0x88, 0x8e},
                                          {0x1f, 0x98, 0x8b},
                                          {0x22, 0xa8, 0x84},
                                          {0x35, 0xb7, 0x79},
                                          {0x54, 0xc5, 0x68},
                                          {0x7a, 0xd1, 0x51},
                                          {0xa5, 0xdb, 0x36},
                                          {0xd2, 0xe2, 0x1b},
                                          {0xfd, 0xe7, 0x25}}};
// Number of steps in the original viridis palette between two consecutive entries of kValues.
constexpr std::uint32_t kSteps = 17;

// Interpolates linearly between two colours. The result is `a` if `part` is 0, and `b` if `part`
// equals `of`.
Rgb between(Rgb a, Rgb b, std::uint32_t part, std::uint32_t of) {
  const auto mixed = [&](std::uint8_t from, std::uint8_t to) {
    return static_cast<std::uint8_t>((from * (of - part) + to * part + of / 2) / of);
  };
  return {mixed(a.red, b.red), mixed(a.green, b.green), mixed(a.blue, b.blue)};
}

}  // namespace

Rgb block_colour(std::uint32_t block) {
  const Rgb hue = kHues[block % kHues.size()];
  switch (block / kHues.size() % 3) {
    case 1: return between(hue, {0, 0, 0}, 2, 5);
    case 2: return between(hue, {255, 255, 255}, 1, 2);
    default: return hue;
  }
}

Rgb value_colour(double share) {
  if (std::isnan(share)) return kNoValue;
  constexpr double kMost = (kValues.size() - 1) * kSteps;  // 255
  const auto place = static_cast<std::uint32_t>(std::clamp(share, 0.0, 1.0) * kMost + .5);
  const std::size_t first = std::min<std::size_t>(place / kSteps, kValues.size() - 2);
  return between(kValues[first], kValues[first + 1],
                 place - static_cast<std::uint32_t>(first) * kSteps, kSteps);
}

Rgb lit(Rgb colour, std::uint32_t light) {
  const auto under = [&](std::uint8_t part) {
    return static_cast<std::uint8_t>((part * std::min<std::uint32_t>(light, 256) + 128) >> 8);
  };
  return {under(colour.red), under(colour.green), under(colour.blue)};
}

}  // namespace shm::converters
