// A shared library that is loaded when it is first needed, but otherwise behaves as if the program
// were linked to it. If the tool were linked to the libraries of all formats, loading them and
// their dependencies would take most of its start-up time.
//
// A library is used through a struct with one function pointer per function. The constructor of the
// struct sets the pointers. A build without SHM_..._LIBRARY (cmake/ShmLoaded.cmake) is linked to
// the library, and the struct contains the addresses of its functions.
#pragma once

#include <string>

namespace shm::converters {

// A loaded library, which stays open until the program ends. Several threads may call the functions
// found in it.
class LoadedLibrary {
 public:
  // `name` is the name that the system's loader looks for, e.g. "libnetcdf.so.19". Throws Failure
  // (unsupported, without a file name) if the library or one of its dependencies is missing or does
  // not match.
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
