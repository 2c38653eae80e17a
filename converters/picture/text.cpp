#include "picture/text.h"

#include <array>

namespace shm::converters {
namespace {

constexpr char kFirst = ' ', kLast = '~';

// The glyphs. Each glyph has 35 bits, one per pixel, row by row from the upper left corner.
constexpr std::array<std::uint64_t, kLast - kFirst + 1> kGlyphs = {
    0x000000000, 0x108421004, 0x294a00000, 0x295f57d4a, 0x11f4717c4, 0x672222273, 0x325264e4d,
    0x108400000, 0x088842082, 0x208210888, 0x009575480, 0x0084f9080, 0x000001844, 0x0000f8000,
    0x00000018c, 0x042222210, 0x3a33ae62e, 0x11842108e, 0x3a211111f, 0x3a213062e, 0x08ca97c42,
    0x7e1e0862e, 0x1910f462e, 0x7c2221084, 0x3a317462e, 0x3a317844c, 0x018c03180, 0x018c03088,
    0x044441041, 0x001f07c00, 0x410411110, 0x3a2111004, 0x3a37ada0f, 0x3a31fc631, 0x7a31f463e,
    0x3a308422e, 0x7a318c63e, 0x7e10f421f, 0x7e10f4210, 0x3a30bc62f, 0x4631fc631, 0x38842108e,
    0x1c4210a4c, 0x4654c5251, 0x42108421f, 0x4775ac631, 0x4739ace71, 0x3a318c62e, 0x7a31f4210,
    0x3a318d64d, 0x7a31f5251, 0x3e107043e, 0x7c8421084, 0x46318c62e, 0x46318a944, 0x4631ad771,
    0x462a22a31, 0x462a21084, 0x7c222221f, 0x39084210e, 0x420820821, 0x38421084e, 0x115100000,
    0x00000001f, 0x208200000, 0x000e0be2f, 0x421e8c63e, 0x000f8420f, 0x042f8c62f, 0x000e8fe0e,
    0x1928f2108, 0x000f8bc2e, 0x421e8c631, 0x100c2108e, 0x080610a4c, 0x4212a6292, 0x30842108e,
    0x001aad6b5, 0x001e8c631, 0x000e8c62e, 0x001e8fa10, 0x000f8bc21, 0x0016cc210, 0x000f8383e,
    0x211e42126, 0x00118c66d, 0x00118c544, 0x0011ad6aa, 0x001151151, 0x00118bc2e, 0x001f1111f,
    0x0c8441083, 0x108421084, 0x608411098, 0x0008a8800,
};

bool has_glyph(char c) { return c >= kFirst && c <= kLast; }

}  // namespace

std::string shown_text(std::string_view text) {
  std::string shown;
  for (const char c : text) {
    const bool goes_on = (static_cast<unsigned char>(c) & 0xc0) == 0x80;
    if (has_glyph(c))
      shown += c;
    else if (!goes_on)
      shown += '?';
  }
  return shown;
}

std::uint32_t text_width(std::size_t characters, std::uint32_t scale) {
  if (characters == 0) return 0;
  return static_cast<std::uint32_t>(characters * kGlyphStep - (kGlyphStep - kGlyphWidth)) * scale;
}

void draw_text(Image& image, std::int64_t left, std::int64_t top, std::string_view text,
               std::uint32_t scale, Rgb colour) {
  for (const char c : text) {
    const std::uint64_t glyph =
        kGlyphs[static_cast<std::size_t>((has_glyph(c) ? c : '?') - kFirst)];
    for (std::uint32_t bit = 0; bit < kGlyphWidth * kGlyphHeight; ++bit)
      if (glyph >> (kGlyphWidth * kGlyphHeight - 1 - bit) & 1)
        image.fill(left + bit % kGlyphWidth * scale, top + bit / kGlyphWidth * scale, scale, scale,
                   colour);
    left += std::int64_t{kGlyphStep} * scale;
  }
}

}  // namespace shm::converters
