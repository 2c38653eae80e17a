#include "base/loaded_library.h"

#include <dlfcn.h>

#include <string_view>

#include "base/failure.h"

namespace shm::converters {
namespace {

// Throws Failure with the loader's most recent message, e.g. "libx.so.1: cannot open shared object
// file: ...".
[[noreturn]] void not_loaded(const std::string& name) {
  const char* const words = ::dlerror();
  std::string_view why = words != nullptr ? words : "unknown";
  if (why.starts_with(name + ": ")) why.remove_prefix(name.size() + 2);
  throw Failure(ErrorCode::unsupported,
                "needs " + name + ", which does not load: " + std::string(why));
}

}  // namespace

// RTLD_GLOBAL makes the library's symbols visible to all libraries that are loaded later, as if the
// program were linked to the library. HDF5 filters rely on this.
LoadedLibrary::LoadedLibrary(const char* name)
    : name_(name), library_(::dlopen(name, RTLD_LAZY | RTLD_GLOBAL)) {
  if (library_ == nullptr) not_loaded(name_);
}

void* LoadedLibrary::address(const char* function) const {
  void* const found = ::dlsym(library_, function);
  if (found == nullptr) not_loaded(name_);
  return found;
}

}  // namespace shm::converters
