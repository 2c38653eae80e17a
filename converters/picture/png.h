// Converts an image to a PNG file in memory.
#pragma once

#include <cstddef>
#include <vector>

#include "picture/image.h"
#include "shm/result.h"

namespace shm::converters {

// Returns true if this build has libpng.
bool can_make_png();

// Encodes an image. Uses a palette if the image has at most 256 colours. The image must not be
// empty. Needs 7 bytes per pixel in addition to the image. The file depends only on the image and
// the versions of libpng and zlib. Returns ErrorCode::unsupported if this build has no libpng.
Result<std::vector<std::byte>> png_of(const Image& image);

}  // namespace shm::converters
