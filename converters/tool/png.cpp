#include "base/failure.h"
#include "tool/layout.h"

#ifdef SHM_HAS_RSVG
#include <librsvg/rsvg.h>

#include <memory>
#endif

namespace shm::converters {

#ifdef SHM_HAS_RSVG

namespace {

struct Unreferenced {
  void operator()(RsvgHandle* handle) const { ::g_object_unref(handle); }
  void operator()(cairo_surface_t* surface) const { ::cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { ::cairo_destroy(context); }
};
template <class T>
using Owned = std::unique_ptr<T, Unreferenced>;

[[noreturn]] void no_picture() {
  throw Failure(Error{ErrorCode::output, "the picture cannot be drawn", {}, kNoOffset, {}});
}

cairo_status_t add_bytes(void* to, const unsigned char* bytes, unsigned count) {
  auto& png = *static_cast<std::vector<std::byte>*>(to);
  const auto* const first = reinterpret_cast<const std::byte*>(bytes);
  png.insert(png.end(), first, first + count);
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

bool has_png() { return true; }

std::vector<std::byte> png_of_svg(const std::string& svg) {
  const Owned<RsvgHandle> picture(::rsvg_handle_new_from_data(
      reinterpret_cast<const guint8*>(svg.data()), svg.size(), nullptr));
  gdouble width = 0, height = 0;
  if (!picture || ::rsvg_handle_get_intrinsic_size_in_pixels(picture.get(), &width, &height) == 0)
    no_picture();
  const Owned<cairo_surface_t> surface(::cairo_image_surface_create(
      CAIRO_FORMAT_RGB24, static_cast<int>(width), static_cast<int>(height)));
  const Owned<cairo_t> context(::cairo_create(surface.get()));
  const RsvgRectangle whole = {0, 0, width, height};
  std::vector<std::byte> png;
  if (::rsvg_handle_render_document(picture.get(), context.get(), &whole, nullptr) == 0 ||
      ::cairo_surface_write_to_png_stream(surface.get(), add_bytes, &png) != CAIRO_STATUS_SUCCESS)
    no_picture();
  return png;
}

#else

bool has_png() { return false; }

std::vector<std::byte> png_of_svg(const std::string&) {
  wrong_use("a .png needs librsvg; this shm was built without");
}

#endif

}  // namespace shm::converters
