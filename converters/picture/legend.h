// The legend of a picture that is coloured by values: the name of the array and the range of its
// values.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "picture/image.h"
#include "picture/shown_range.h"

namespace shm::converters {

struct Legend {
  std::string name;                 // name of the array, usually UTF-8; may contain any bytes
  std::optional<ShownRange> range;  // range of the values; empty if no value is finite
};

// Formats a number with six digits, like printf's %g.
std::string legend_number(double value);

// Returns the height in pixels of the legend at the lower edge of a picture of this size. Returns 0
// if the picture is too small for a legend.
std::uint32_t legend_height(std::uint32_t width, std::uint32_t height);

// Draws the legend at the lower edge of `image`, unless the picture is too small. Shortens the name
// of the array if it is too long.
void draw_legend(Image& image, const Legend& legend);

}  // namespace shm::converters
