// Text in pictures, in a built-in font with printable ASCII characters, 5 pixels wide and 7 high.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "picture/image.h"

namespace shm::converters {

inline constexpr std::uint32_t kGlyphWidth = 5, kGlyphHeight = 7, kGlyphStep = 6;

// Converts a text, which may be UTF-8, to characters of the font. A character that the font lacks
// becomes "?".
std::string shown_text(std::string_view text);

// Returns the width in pixels of a text with this number of characters. `scale`: width in pixels of
// a glyph's pixel.
std::uint32_t text_width(std::size_t characters, std::uint32_t scale);

// Draws a text. `text`: a result of shown_text(). Its upper left corner is at (left, top), in
// pixels.
void draw_text(Image& image, std::int64_t left, std::int64_t top, std::string_view text,
               std::uint32_t scale, Rgb colour);

}  // namespace shm::converters
