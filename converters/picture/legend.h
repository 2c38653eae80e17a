// The legend of a picture that is coloured by values: what is shown, from where to where.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "picture/image.h"
#include "picture/shown_range.h"

namespace shm::converters {

struct Legend {
  std::string name;                 // of the array; UTF-8, or any bytes
  std::optional<ShownRange> range;  // nothing: there are no finite values
};

// Six digits, as printf's %g has them.
std::string legend_number(double value);

// Pixels at the lower edge of a picture of this size that the legend takes; 0 where there is no
// room for one.
std::uint32_t legend_height(std::uint32_t width, std::uint32_t height);

// Draws it there; nothing where there is no room. Names that are too long are cut short.
void draw_legend(Image& image, const Legend& legend);

}  // namespace shm::converters
