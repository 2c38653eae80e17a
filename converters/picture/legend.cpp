#include "picture/legend.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <string_view>

#include "picture/colours.h"
#include "picture/text.h"

namespace shm::converters {
namespace {

constexpr std::uint32_t kLeastWidth = 96, kLeastHeight = 72;
constexpr std::uint32_t kGap = 2, kBar = 5;  // sizes in pixels of the font

std::uint32_t scale_for(std::uint32_t width, std::uint32_t height) {
  return std::max<std::uint32_t>(std::min(width, height) / 320, 1);
}

// Shortens a text to at most `most` characters.
std::string shortened(std::string text, std::size_t most) {
  constexpr std::string_view kMore = "...";
  if (text.size() <= most) return text;
  text.resize(most - std::min(most, kMore.size()));
  return text + std::string(kMore.substr(0, most));
}

}  // namespace

std::string legend_number(double value) {
  std::array<char, 32> text{};
  const double shown = value == 0 ? 0 : value;  // replaces -0 with 0
  const auto end =
      std::to_chars(text.data(), text.data() + text.size(), shown, std::chars_format::general, 6);
  return {text.data(), end.ptr};
}

std::uint32_t legend_height(std::uint32_t width, std::uint32_t height) {
  if (width < kLeastWidth || height < kLeastHeight) return 0;
  return (2 * kGlyphHeight + kBar + 4 * kGap) * scale_for(width, height);
}

void draw_legend(Image& image, const Legend& legend) {
  const std::uint32_t strip = legend_height(image.width, image.height);
  if (strip == 0) return;
  const std::uint32_t scale = scale_for(image.width, image.height);
  const std::uint32_t left = image.width / 8, across = image.width - 2 * left;
  const std::size_t characters = across / (kGlyphStep * scale);
  std::uint32_t top = image.height - strip + kGap * scale;
  const auto put = [&](const std::string& text, std::uint32_t from) {
    draw_text(image, from, top, text, scale, kInk);
  };
  const auto centred = [&](const std::string& text) {
    put(text, (image.width - text_width(text.size(), scale)) / 2);
  };
  centred(shortened(shown_text(legend.name), characters));
  top += (kGlyphHeight + kGap) * scale;
  if (!legend.range) {
    image.fill(left, top, across, std::int64_t{kBar} * scale, kNoValue);
  } else {
    for (std::uint32_t x = 0; x < across; ++x)
      image.fill(left + x, top, 1, std::int64_t{kBar} * scale,
                 value_colour(static_cast<double>(x) / (across - 1)));
  }
  top += (kBar + kGap) * scale;
  if (!legend.range) return centred(shortened("no numbers", characters));
  const std::string least = legend_number(legend.range->least);
  const std::string greatest = legend_number(legend.range->greatest);
  const std::uint32_t width = text_width(greatest.size(), scale);
  put(least, left);
  if (text_width(least.size(), scale) + kGlyphStep * scale + width <= across)
    put(greatest, left + across - width);
}

}  // namespace shm::converters
