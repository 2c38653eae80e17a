#include "picture/png.h"

#ifdef SHM_HAS_PNG
#include <png.h>

#include <algorithm>
#include <array>
#include <csetjmp>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>
#endif

namespace shm::converters {

#ifdef SHM_HAS_PNG

namespace {

std::uint32_t number_of(Rgb colour) {
  return std::uint32_t{colour.red} << 16 | std::uint32_t{colour.green} << 8 | colour.blue;
}

// Returns the distinct colours of an image in ascending order, or an empty list if there are too
// many for a palette.
std::vector<std::uint32_t> palette_of(const Image& image) {
  std::vector<std::uint32_t> palette;
  const Rgb* before = nullptr;
  for (const Rgb& pixel : image.pixels) {
    if (before != nullptr && *before == pixel) continue;
    before = &pixel;
    const std::uint32_t number = number_of(pixel);
    const auto position = std::lower_bound(palette.begin(), palette.end(), number);
    if (position != palette.end() && *position == number) continue;
    if (palette.size() == PNG_MAX_PALETTE_LENGTH) return {};
    palette.insert(position, number);
  }
  return palette;
}

// Returns the index of a colour, which must be in the palette.
std::uint8_t place_in(std::span<const std::uint32_t> palette, Rgb colour) {
  const auto position = std::lower_bound(palette.begin(), palette.end(), number_of(colour));
  return static_cast<std::uint8_t>(position - palette.begin());
}

// Buffer into which libpng writes. The size of `bytes` is the maximum size of the file; `size` is
// the number of bytes written so far.
struct Target {
  std::vector<std::byte> bytes;
  std::size_t size = 0;
};

void add_bytes(png_structp png, png_bytep from, png_size_t count) {
  Target& to = *static_cast<Target*>(png_get_io_ptr(png));
  if (count > to.bytes.size() - to.size) png_error(png, "larger than it may be");
  std::memcpy(to.bytes.data() + to.size, from, count);
  to.size += count;
}
void stay_silent(png_structp, png_const_charp) {}
[[noreturn]] void give_up(png_structp png, png_const_charp) { png_longjmp(png, 1); }

// Options for writing an image.
struct Form {
  std::span<const std::uint32_t> palette;  // empty: pixels are stored as RGB
  int filters;                             // filters of libpng
  std::uint8_t* row;                       // buffer for the palette indices of a row
};

// Writes all rows of the image. Returns false if libpng fails. In that case libpng returns to this
// function by longjmp(), so no local variable may have a destructor.
bool write_rows(png_structp png, png_infop about, const Image& image, const Form& form) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  const std::span<const std::uint32_t> palette = form.palette;
  png_set_IHDR(png, about, image.width, image.height, 8,
               palette.empty() ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  if (!palette.empty()) {
    std::array<png_color, PNG_MAX_PALETTE_LENGTH> colours;
    for (std::size_t i = 0; i < palette.size(); ++i)
      colours[i] = {static_cast<png_byte>(palette[i] >> 16),
                    static_cast<png_byte>(palette[i] >> 8 & 255),
                    static_cast<png_byte>(palette[i] & 255)};
    png_set_PLTE(png, about, colours.data(), static_cast<int>(palette.size()));
  }
  png_set_sRGB(png, about, PNG_sRGB_INTENT_PERCEPTUAL);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, form.filters);
  png_write_info(png, about);
  for (std::size_t y = 0; y < image.height; ++y) {
    const Rgb* const pixels = image.pixels.data() + y * image.width;
    if (palette.empty()) {
      png_write_row(png, reinterpret_cast<png_const_bytep>(pixels));
      continue;
    }
    for (std::size_t x = 0; x < image.width; ++x)
      form.row[x] =
          x > 0 && pixels[x] == pixels[x - 1] ? form.row[x - 1] : place_in(palette, pixels[x]);
    png_write_row(png, form.row);
  }
  png_write_end(png, nullptr);
  return true;
}

// Returns the PNG file, or an empty result if libpng ran out of memory. No other error can occur,
// because the buffer is large enough for every image.
std::vector<std::byte> file_of(const Image& image, const Form& form) {
  png_image size{};  // used to compute the maximum size
  size.width = image.width;
  size.height = image.height;
  size.format = PNG_FORMAT_RGB;
  Target to{std::vector<std::byte>(PNG_IMAGE_PNG_SIZE_MAX(size)), 0};
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, give_up, stay_silent);
  png_infop about = png == nullptr ? nullptr : png_create_info_struct(png);
  if (about != nullptr) png_set_write_fn(png, &to, add_bytes, nullptr);
  const bool written = about != nullptr && write_rows(png, about, image, form);
  png_destroy_write_struct(&png, &about);
  to.bytes.resize(written ? to.size : 0);
  return std::move(to.bytes);
}

}  // namespace

bool can_make_png() { return true; }

Result<std::vector<std::byte>> png_of(const Image& image) {
  static_assert(sizeof(Rgb) == 3);
  const std::vector<std::uint32_t> palette = palette_of(image);
  std::vector<std::uint8_t> row(palette.empty() ? 0 : image.width);
  // A picture of faces with uniform colours compresses best without filters. A picture with colour
  // gradients compresses best with filters. Therefore both are tried if the picture has no palette.
  std::vector<std::byte> file = file_of(image, {palette, PNG_FILTER_NONE, row.data()});
  if (palette.empty() && !file.empty()) {
    std::vector<std::byte> filtered = file_of(image, {palette, PNG_ALL_FILTERS, row.data()});
    if (filtered.size() < file.size()) file = std::move(filtered);
  }
  if (file.empty())
    return Error{.code = ErrorCode::over_limit,
                 .detail = "there is not enough memory for the picture"};
  return file;
}

#else

bool can_make_png() { return false; }

Result<std::vector<std::byte>> png_of(const Image&) {
  return Error{.code = ErrorCode::unsupported, .detail = "this build has no libpng"};
}

#endif

}  // namespace shm::converters
