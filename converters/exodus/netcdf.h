// Defines the functions of netCDF and of the Exodus library under their usual names. Calls look as
// in the manuals, but use the libraries that open_netcdf() and open_exodus_library() load at run
// time (see base/loaded_library.h). If the program were linked to these two libraries, every start
// would also load sixty other libraries (HDF5, MPI, libraries that fetch files from servers).
#pragma once

#include <exodusII.h>
#include <netcdf.h>
#include <netcdf_filter.h>

#include <string>

#include "shm/result.h"

namespace shm::converters::exodus {

// The functions of netCDF and of the Exodus library that are used here.
// clang-format off
#define SHM_NETCDF_FUNCTIONS(each)                                                                 \
  each(nc_abort) each(nc_close) each(nc_create) each(nc_def_dim) each(nc_def_var)                  \
  each(nc_def_var_chunking) each(nc_def_var_deflate) each(nc_def_var_endian)                       \
  each(nc_def_var_fill) each(nc_def_var_filter) each(nc_def_var_fletcher32) each(nc_enddef)        \
  each(nc_free_string) each(nc_get_att) each(nc_get_att_string) each(nc_get_var_longlong)          \
  each(nc_get_var_string) each(nc_get_vara) each(nc_get_vara_double) each(nc_get_vara_float)       \
  each(nc_get_vara_longlong) each(nc_inq) each(nc_inq_att) each(nc_inq_attname) each(nc_inq_dim)   \
  each(nc_inq_dimids) each(nc_inq_filter_avail) each(nc_inq_format) each(nc_inq_grpname)           \
  each(nc_inq_grps) each(nc_inq_typeids) each(nc_inq_unlimdim) each(nc_inq_unlimdims)              \
  each(nc_inq_user_type) each(nc_inq_var) each(nc_inq_var_chunking) each(nc_inq_var_deflate)       \
  each(nc_inq_var_endian) each(nc_inq_var_fill) each(nc_inq_var_filter_ids)                        \
  each(nc_inq_var_filter_info) each(nc_inq_var_fletcher32) each(nc_inq_varid) each(nc_open)        \
  each(nc_put_att) each(nc_put_att_string) each(nc_put_var_longlong) each(nc_put_vara)             \
  each(nc_put_vara_double) each(nc_put_vara_float) each(nc_put_vara_longlong)                      \
  each(nc_put_vara_string) each(nc_set_fill) each(nc_set_var_chunk_cache) each(nc_strerror)
#define SHM_EXODUS_FUNCTIONS(each)                                                                 \
  each(ex_close) each(ex_create_int) each(ex_opts) each(ex_put_block) each(ex_put_coord_names)     \
  each(ex_put_init_ext) each(ex_put_map_param) each(ex_put_name) each(ex_put_names)                \
  each(ex_put_partial_coord) each(ex_put_partial_elem_conn) each(ex_put_partial_id_map)            \
  each(ex_put_partial_num_map) each(ex_put_partial_var) each(ex_put_set)                           \
  each(ex_put_set_dist_fact) each(ex_put_set_param) each(ex_put_time) each(ex_put_truth_table)     \
  each(ex_put_var) each(ex_put_variable_names) each(ex_put_variable_param)                         \
  each(ex_set_max_name_length)
// clang-format on

#define SHM_POINTER(name) decltype(&::name) name;
struct NetcdfFunctions {
  NetcdfFunctions();
  SHM_NETCDF_FUNCTIONS(SHM_POINTER)
};
struct ExodusFunctions {
  ExodusFunctions();
  SHM_EXODUS_FUNCTIONS(SHM_POINTER)
};
#undef SHM_POINTER

// netcdf() and exodus_library() return the functions of a library. The first call loads the
// library. If this fails, the call throws Failure without a file name.
const NetcdfFunctions& netcdf();
const ExodusFunctions& exodus_library();

// open_netcdf() and open_exodus_library() load a library. Call them before opening or creating a
// file, and before any other function of the library. They throw Failure with `code` and `file` if
// the library cannot be loaded.
void open_netcdf(const std::string& file, ErrorCode code);
void open_exodus_library(const std::string& file, ErrorCode code);

#define SHM_CALL(library, name) \
  inline constexpr auto name = [](auto... arguments) { return library().name(arguments...); };
#define SHM_CALL_NETCDF(name) SHM_CALL(netcdf, name)
#define SHM_CALL_EXODUS(name) SHM_CALL(exodus_library, name)
SHM_NETCDF_FUNCTIONS(SHM_CALL_NETCDF)
SHM_EXODUS_FUNCTIONS(SHM_CALL_EXODUS)
#undef SHM_CALL_EXODUS
#undef SHM_CALL_NETCDF
#undef SHM_CALL

}  // namespace shm::converters::exodus
