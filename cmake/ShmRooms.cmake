# A room is a folder of sources; its CMakeLists.txt is one call of shm_room. The sources of a room are
# compiled as one translation unit, with common headers that are compiled once: a build from nothing
# takes a third of the time. Names in their unnamed namespaces must therefore differ.
# Rooms that SHM_SMALL_ROOMS lists are compiled for size, each source alone.
# With SHM_SEPARATE_SOURCES each source is compiled alone, so that one that lacks an include is found.

set(SHM_COMMON_HEADERS
    <algorithm> <array> <cmath> <cstddef> <cstdint> <cstring> <functional> <map> <memory> <optional>
    <span> <string> <string_view> <unordered_map> <utility> <variant> <vector>)

# shm_precompile(TARGET [LIKE]): the common headers are compiled once for TARGET, or taken from LIKE,
# which must have the same flags.
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
  # g++ takes sources that are included for headers, whose classes should have no members of unnamed
  # namespaces.
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# shm_room(TARGET [ONLY SOURCE...] [WITHOUT SOURCE...] [ALONE SOURCE...]): the sources of this folder
# belong to TARGET, or these only. ALONE: these are translation units of their own.
function(shm_room target)
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
  file(RELATIVE_PATH room "${PROJECT_SOURCE_DIR}" "${CMAKE_CURRENT_SOURCE_DIR}")
  string(REPLACE "/" "_" room "${room}")
  set_source_files_properties(${sources} TARGET_DIRECTORY ${target} PROPERTIES UNITY_GROUP ${room})
  get_filename_component(name "${CMAKE_CURRENT_SOURCE_DIR}" NAME)
  if(name IN_LIST SHM_SMALL_ROOMS)
    set_source_files_properties(${sources} TARGET_DIRECTORY ${target}
                                PROPERTIES COMPILE_OPTIONS -Oz SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()
