// A library that is opened when it is first needed, as if the program had been linked to it.
// Linked, those of some formats and all that they stand on would be most of what each start of the
// tool takes.
//   What is opened so is a struct with a pointer for each function, filled in its constructor; a
// build without SHM_..._LIBRARY (cmake/ShmLoaded.cmake) is linked, and takes the addresses.
#pragma once

#include <string>

namespace shm::converters {

// Stays open until the program ends. Functions that it has given may be called by several threads.
class LoadedLibrary {
 public:
  // `name`: as the system's loader looks for it, "libnetcdf.so.19". Throws Failure (unsupported),
  // which names no other file: it, or one that it needs, is not there or is another one.
  explicit LoadedLibrary(const char* name);

  // Throws Failure (unsupported) where it has no such function.
  template <class Function>
  Function* find(const char* name) const {
    return reinterpret_cast<Function*>(address(name));
  }

 private:
  void* address(const char* function) const;

  const char* name_;
  void* library_;
};

}  // namespace shm::converters
