// Computes the colours of faces in pictures. A colour represents an element block or a value, and
// is darkened according to the light on the face.
#pragma once

#include <cstdint>

#include "picture/image.h"

namespace shm::converters {

// Returns the colour of an element block by its index. The first seven colours have hues that
// people with red-green colour blindness can distinguish. The next seven colours have the same hues
// but are darker, and the next seven are lighter. After these 21 colours, the list repeats.
Rgb block_colour(std::uint32_t block);

// Returns the colour of a value. `share` is 0 for the least value and 1 for the greatest value.
// Lightness increases with `share`. Returns kNoValue if `share` is NaN.
Rgb value_colour(double share);
inline constexpr Rgb kNoValue = {150, 150, 150};

// Returns the colour scaled by `light` / 256. `light` is the intensity of the light, 0..256.
Rgb lit(Rgb colour, std::uint32_t light);

}  // namespace shm::converters
