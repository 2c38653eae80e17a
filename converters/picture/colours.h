// Colours in pictures: colours of element blocks and of values, and the effect of light.
#pragma once

#include <cstdint>

#include "picture/image.h"

namespace shm::converters {

// Returns the colour of an element block by its index. There are seven hues that people with
// red-green colour blindness can distinguish, then the same hues darker, then lighter; then the
// colours repeat.
Rgb block_colour(std::uint32_t block);

// Returns the colour of a value. `share`: 0 for the least value to 1 for the greatest value.
// Lightness increases monotonically. For NaN, returns kNoValue.
Rgb value_colour(double share);
inline constexpr Rgb kNoValue = {150, 150, 150};

// Returns a colour under light of the intensity `light`, 0..256.
Rgb lit(Rgb colour, std::uint32_t light);

}  // namespace shm::converters
