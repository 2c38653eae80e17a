// LoadedLibrary: a shared library that is loaded when it is first needed. If the tool were linked
// to the libraries of all formats, loading these libraries and their dependencies would take most
// of the start-up time.
//
// A library is used through a struct with one function pointer per function. The constructor of the
// struct sets the pointers. If the build does not define SHM_..._LIBRARY (cmake/ShmLoaded.cmake),
// the program is linked to the library, and the struct contains the addresses of the linked
// functions.
#pragma once

#include <string>

namespace shm::converters {

// A loaded library, which stays open until the program ends. Several threads may call the functions
// found in it.
class LoadedLibrary {
 public:
  // `name` is the name that the system's loader looks for, e.g. "libnetcdf.so.19". Throws Failure
  // (unsupported, without a file name) if the library or one of its dependencies is missing or has
  // an incompatible version.
  explicit LoadedLibrary(const char* name);

  // Returns a function of the library. Throws Failure (unsupported) if the library does not have
  // it.
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
