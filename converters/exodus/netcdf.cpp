#include "exodus/netcdf.h"

#include <utility>

#include "base/failure.h"
#include "base/loaded_library.h"

namespace shm::converters::exodus {
namespace {

template <class Open>
void open_for(const std::string& file, ErrorCode code, const Open& open) {
  try {
    open();
  } catch (const Failure& failure) {
    Error error = failure.error();
    error.code = code;
    error.file = file;
    throw Failure(std::move(error));
  }
}

}  // namespace

#define SHM_ADDRESS(name) name = &::name;
#define SHM_FIND(name) name = library.find<decltype(::name)>(#name);

NetcdfFunctions::NetcdfFunctions() {
#ifdef SHM_NETCDF_LIBRARY
  const LoadedLibrary library(SHM_NETCDF_LIBRARY);
  SHM_NETCDF_FUNCTIONS(SHM_FIND)
#else
  SHM_NETCDF_FUNCTIONS(SHM_ADDRESS)
#endif
}

ExodusFunctions::ExodusFunctions() {
#ifdef SHM_EXODUS_LIBRARY
  const LoadedLibrary library(SHM_EXODUS_LIBRARY);
  SHM_EXODUS_FUNCTIONS(SHM_FIND)
#else
  SHM_EXODUS_FUNCTIONS(SHM_ADDRESS)
#endif
}

#undef SHM_FIND
#undef SHM_ADDRESS

const NetcdfFunctions& netcdf() {
  static const NetcdfFunctions functions;
  return functions;
}

const ExodusFunctions& exodus_library() {
  static const ExodusFunctions functions;
  return functions;
}

void open_netcdf(const std::string& file, ErrorCode code) { open_for(file, code, netcdf); }

void open_exodus_library(const std::string& file, ErrorCode code) {
  open_for(file, code, exodus_library);
}

}  // namespace shm::converters::exodus
