// Colours of a picture: of element blocks, of values, and with light.
#pragma once

#include <cstdint>

#include "picture/image.h"

namespace shm::converters {

// Colour of an element block by its index: seven hues that people with red-green colour blindness
// can distinguish, then the same hues darker, then lighter, and so on from the beginning.
Rgb block_colour(std::uint32_t block);

// Colour of a value, given as 0..1 from the least to the greatest value. Lightness increases
// monotonically. NaN: kNoValue.
Rgb value_colour(double share);
inline constexpr Rgb kNoValue = {150, 150, 150};

// A colour under light of the intensity `light`, 0..256.
Rgb lit(Rgb colour, std::uint32_t light);

}  // namespace shm::converters
