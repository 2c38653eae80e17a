# Finds the Exodus II library, which has no pkg-config file and no CMake package, and the netCDF
# library that it is linked to. Defines the target ExodusII::ExodusII.
#
# Debian builds Exodus with the MPI variant of netCDF. A program must not also load the serial
# variant of netCDF, because the two variants define the same symbols but use different HDF5
# libraries. The development package of the MPI variant is not needed, because both variants have
# the same header, and the run-time library can be linked by its file name.
find_path(ExodusII_INCLUDE_DIR exodusII.h)
find_path(ExodusII_NETCDF_INCLUDE_DIR netcdf.h)
find_library(ExodusII_LIBRARY NAMES exoIIv2c exodus)
find_library(ExodusII_NETCDF_LIBRARY NAMES netcdf_mpi libnetcdf_mpi.so.19 netcdf)
mark_as_advanced(ExodusII_INCLUDE_DIR ExodusII_NETCDF_INCLUDE_DIR ExodusII_LIBRARY
                 ExodusII_NETCDF_LIBRARY)

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  ExodusII REQUIRED_VARS ExodusII_LIBRARY ExodusII_INCLUDE_DIR ExodusII_NETCDF_LIBRARY
                         ExodusII_NETCDF_INCLUDE_DIR)

if(ExodusII_FOUND AND NOT TARGET ExodusII::ExodusII)
  add_library(ExodusII::ExodusII UNKNOWN IMPORTED)
  set_target_properties(
    ExodusII::ExodusII
    PROPERTIES IMPORTED_LOCATION "${ExodusII_LIBRARY}"
               INTERFACE_INCLUDE_DIRECTORIES
               "${ExodusII_INCLUDE_DIR};${ExodusII_NETCDF_INCLUDE_DIR}"
               INTERFACE_LINK_LIBRARIES "${ExodusII_NETCDF_LIBRARY}")
endif()
