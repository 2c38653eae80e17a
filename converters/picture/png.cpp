#include "picture/png.h"

#ifdef SHM_HAS_PNG
#include <png.h>
#endif

namespace shm::converters {

#ifdef SHM_HAS_PNG

bool can_make_png() { return true; }

Result<std::vector<std::byte>> png_of(const Image& image) {
  static_assert(sizeof(Rgb) == 3);
  png_image about{};
  about.version = PNG_IMAGE_VERSION;
  about.width = image.width;
  about.height = image.height;
  about.format = PNG_FORMAT_RGB;
  std::vector<std::byte> bytes(PNG_IMAGE_PNG_SIZE_MAX(about));
  png_alloc_size_t size = bytes.size();
  const int written =
      png_image_write_to_memory(&about, bytes.data(), &size, 0, image.pixels.data(), 0, nullptr);
  png_image_free(&about);
  if (written == 0)
    return Error{ErrorCode::output, "the picture cannot be written", {}, kNoOffset, {}};
  bytes.resize(size);
  return bytes;
}

#else

bool can_make_png() { return false; }

Result<std::vector<std::byte>> png_of(const Image&) {
  return Error{ErrorCode::unsupported, "this build has no libpng", {}, kNoOffset, {}};
}

#endif

}  // namespace shm::converters
