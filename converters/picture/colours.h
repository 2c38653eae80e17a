// What is shown in which colour: element blocks, values, light.
#pragma once

#include <cstdint>

#include "picture/image.h"

namespace shm::converters {

// Of an element block by its index: seven hues that people tell apart who see no red or no green,
// then the same ones darker, then lighter, and over again.
Rgb block_colour(std::uint32_t block);

// Of a value in 0..1 from the least to the greatest; lightness grows all the way. NaN: kNoValue.
Rgb value_colour(double share);
inline constexpr Rgb kNoValue = {150, 150, 150};

// A colour under so much light, 0..256.
Rgb lit(Rgb colour, std::uint32_t light);

}  // namespace shm::converters
