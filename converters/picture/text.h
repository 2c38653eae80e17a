// Draws text in pictures, with a built-in font. The font contains the printable ASCII characters,
// which are 5 pixels wide and 7 pixels high.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "picture/image.h"

namespace shm::converters {

inline constexpr std::uint32_t kGlyphWidth = 5, kGlyphHeight = 7, kGlyphStep = 6;

// Converts UTF-8 text to characters of the font. Replaces each character that is not in the font
// with "?".
std::string shown_text(std::string_view text);

// Returns the width in pixels of a text with this number of characters. Each pixel of a glyph is
// drawn `scale` pixels wide.
std::uint32_t text_width(std::size_t characters, std::uint32_t scale);

// Draws `text`, which must be a result of shown_text(). The upper left corner of the text is at
// (left, top), in pixels.
void draw_text(Image& image, std::int64_t left, std::int64_t top, std::string_view text,
               std::uint32_t scale, Rgb colour);

}  // namespace shm::converters
