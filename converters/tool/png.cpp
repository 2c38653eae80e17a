// Renders pictures with librsvg and cairo. Both libraries are loaded only when a picture is needed.
// They depend on about fifty other libraries. If the tool were linked to librsvg and cairo, loading
// all these libraries would take most of its start-up time.
#include "base/failure.h"
#include "base/loaded_library.h"
#include "tool/layout.h"

#ifdef SHM_HAS_RSVG
#include <librsvg/rsvg.h>

#include <memory>
#include <new>
#endif

namespace shm::converters {

#ifdef SHM_HAS_RSVG

namespace {

// Pointers to the functions of librsvg and its dependencies that this file uses. The constructor
// loads the libraries. It throws Failure if librsvg cannot be loaded.
struct Rsvg {
  LoadedLibrary library{"librsvg-2.so.2"};
#define SHM_FUNCTION(name) decltype(&::name) name = library.find<decltype(::name)>(#name)
  SHM_FUNCTION(g_object_unref);
  SHM_FUNCTION(rsvg_handle_new_from_data);
  SHM_FUNCTION(rsvg_handle_get_intrinsic_size_in_pixels);
  SHM_FUNCTION(rsvg_handle_render_document);
  SHM_FUNCTION(cairo_surface_destroy);
  SHM_FUNCTION(cairo_destroy);
  SHM_FUNCTION(cairo_image_surface_create);
  SHM_FUNCTION(cairo_create);
  SHM_FUNCTION(cairo_surface_write_to_png_stream);
#undef SHM_FUNCTION
};

const Rsvg& rsvg() {
  static const Rsvg opened;
  return opened;
}

struct Unreferenced {
  void operator()(RsvgHandle* handle) const { rsvg().g_object_unref(handle); }
  void operator()(cairo_surface_t* surface) const { rsvg().cairo_surface_destroy(surface); }
  void operator()(cairo_t* context) const { rsvg().cairo_destroy(context); }
};
template <class T>
using Owned = std::unique_ptr<T, Unreferenced>;

[[noreturn]] void no_picture() { throw Failure(ErrorCode::output, "the picture cannot be drawn"); }

cairo_status_t add_bytes(void* to, const unsigned char* bytes, unsigned count) {
  auto& png = *static_cast<std::vector<std::byte>*>(to);
  const auto* const first = reinterpret_cast<const std::byte*>(bytes);
  try {  // an exception must not pass through cairo
    png.insert(png.end(), first, first + count);
  } catch (...) {
    return CAIRO_STATUS_NO_MEMORY;
  }
  return CAIRO_STATUS_SUCCESS;
}

}  // namespace

bool has_png() {
  try {
    rsvg();
    return true;
  } catch (const Failure&) {
    return false;
  }
}

std::vector<std::byte> png_of_svg(const std::string& svg) {
  const Rsvg& to = rsvg();
  const Owned<RsvgHandle> picture(to.rsvg_handle_new_from_data(
      reinterpret_cast<const guint8*>(svg.data()), svg.size(), nullptr));
  gdouble width = 0, height = 0;
  if (!picture || to.rsvg_handle_get_intrinsic_size_in_pixels(picture.get(), &width, &height) == 0)
    no_picture();
  const Owned<cairo_surface_t> surface(to.cairo_image_surface_create(
      CAIRO_FORMAT_RGB24, static_cast<int>(width), static_cast<int>(height)));
  const Owned<cairo_t> context(to.cairo_create(surface.get()));
  const RsvgRectangle whole = {0, 0, width, height};
  std::vector<std::byte> png;
  if (to.rsvg_handle_render_document(picture.get(), context.get(), &whole, nullptr) == 0)
    no_picture();
  const auto written = to.cairo_surface_write_to_png_stream(surface.get(), add_bytes, &png);
  if (written == CAIRO_STATUS_NO_MEMORY) throw std::bad_alloc();
  if (written != CAIRO_STATUS_SUCCESS) no_picture();
  return png;
}

#else

bool has_png() { return false; }

std::vector<std::byte> png_of_svg(const std::string&) {
  wrong_use("a .png needs librsvg; this shm was built without it");
}

#endif

}  // namespace shm::converters
