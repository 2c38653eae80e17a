// Words on pictures: a font of our own, of printable ASCII, 5 pixels wide and 7 high.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "picture/image.h"

namespace shm::converters {

inline constexpr std::uint32_t kGlyphWidth = 5, kGlyphHeight = 7, kGlyphStep = 6;

// What the font can show of a text that may be UTF-8: "?" for each character that it lacks.
std::string shown_text(std::string_view text);

// Pixels from the first to the last one of so many characters, at `scale` pixels for each of a
// glyph's.
std::uint32_t text_width(std::size_t characters, std::uint32_t scale);

// `text`: as shown_text() gives it; its upper left corner is at (left, top), in pixels.
void draw_text(Image& image, std::int64_t left, std::int64_t top, std::string_view text,
               std::uint32_t scale, Rgb colour);

}  // namespace shm::converters
