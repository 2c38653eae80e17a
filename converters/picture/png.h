// An image as the bytes of a PNG file.
#pragma once

#include <cstddef>
#include <vector>

#include "picture/image.h"
#include "shm/result.h"

namespace shm::converters {

// Whether this build has libpng.
bool can_make_png();

// Must hold: the image has pixels. With a palette where it has at most 256 colours. Takes 7 bytes
// for each pixel beside the image. The same image gives the same bytes wherever libpng and zlib are
// of one version. ErrorCode::unsupported: this build has no libpng.
Result<std::vector<std::byte>> png_of(const Image& image);

}  // namespace shm::converters
