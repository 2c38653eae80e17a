# A module is a folder of sources whose CMakeLists.txt calls shm_module. All sources of a module are
# compiled as one translation unit, with a precompiled header that contains common headers. This
# reduces the time of a full build to a third. Because of the single translation unit, names in
# unnamed namespaces must be unique within a module.
#
# Modules listed in SHM_SMALL_MODULES are optimized for size, and their sources are compiled
# separately. With SHM_SEPARATE_SOURCES, all sources are compiled separately, to find missing
# includes.

set(SHM_COMMON_HEADERS
    <algorithm> <array> <cmath> <cstddef> <cstdint> <cstring> <functional> <map> <memory> <optional>
    <span> <string> <string_view> <unordered_map> <utility> <variant> <vector>)

# shm_precompile(TARGET [LIKE]): precompiles the common headers for TARGET. If the target LIKE is
# given, reuses its precompiled headers; both targets must have the same compiler flags.
function(shm_precompile target)
  if(SHM_SEPARATE_SOURCES)
    return()
  endif()
  if(ARGC GREATER 1)
    target_precompile_headers(${target} REUSE_FROM ${ARGV1})
  else()
    target_precompile_headers(${target} PRIVATE ${SHM_COMMON_HEADERS})
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  # In a unity build, one source file includes the other sources of the module. g++ mistakes the
  # included sources for headers, and warns about classes in them whose members have types from
  # unnamed namespaces.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# shm_module(TARGET [ONLY SOURCE...] [WITHOUT SOURCE...] [ALONE SOURCE...]): adds the sources of the
# current folder to TARGET. ONLY: adds only these sources. WITHOUT: leaves out these sources. ALONE:
# compiles each of these sources as a separate translation unit.
function(shm_module target)
  cmake_parse_arguments(arg "" "" "ONLY;WITHOUT;ALONE" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/*.cpp")
  if(arg_ONLY)
    set(sources ${arg_ONLY})
    list(TRANSFORM sources PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  endif()
  list(TRANSFORM arg_WITHOUT PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  list(TRANSFORM arg_ALONE PREPEND "${CMAKE_CURRENT_SOURCE_DIR}/")
  list(REMOVE_ITEM sources ${arg_WITHOUT})
  target_sources(${target} PRIVATE ${sources})
  list(REMOVE_ITEM sources ${arg_ALONE})
  file(RELATIVE_PATH module "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  string(REPLACE "/" "_" module "${module}")
  set_source_files_properties(${sources} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${module})
  get_filename_component(name "${CMAKE_CURRENT_SOURCE_DIR}" NAME)
  if(name IN_LIST SHM_SMALL_MODULES)
    set_source_files_properties(${sources} TARGET_DIRECTORY ${target}
                                PROPERTIES COMPILE_OPTIONS -Oz SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()
