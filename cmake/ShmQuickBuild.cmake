# Where SHM_QUICK_BUILD is on, builds take less than half as long: headers that most sources include
# are precompiled, and sources of a kind are compiled together. Off in the release, so that a source
# that lacks an include is found.

# shm_precompile(TARGET [LIKE]): the common headers are compiled once for TARGET, or taken from LIKE,
# which must have the same flags.
set(SHM_COMMON_HEADERS
    <algorithm> <array> <cmath> <cstddef> <cstdint> <cstring> <functional> <map> <memory> <optional>
    <span> <string> <string_view> <unordered_map> <utility> <variant> <vector>)

function(shm_precompile target)
  if(NOT SHM_QUICK_BUILD)
    return()
  endif()
  if(ARGC GREATER 1)
    target_precompile_headers(${target} REUSE_FROM ${ARGV1})
  else()
    target_precompile_headers(${target} PRIVATE ${SHM_COMMON_HEADERS})
  endif()
endfunction()

# g++ takes sources that are included for headers, whose classes should have no members of unnamed
# namespaces.
function(shm_allow_unnamed_members target)
  target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
endfunction()

# shm_together(TARGET GROUP SOURCE...): these sources of TARGET are one translation unit, so that names
# in their unnamed namespaces must differ.
function(shm_together target group)
  if(SHM_QUICK_BUILD)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
    shm_allow_unnamed_members(${target})
    set_source_files_properties(${ARGN} PROPERTIES UNITY_GROUP ${group})
  endif()
endfunction()

# shm_together_by_kind(TARGET): so are all that share the first word of their names.
function(shm_together_by_kind target)
  get_target_property(sources ${target} SOURCES)
  foreach(source IN LISTS sources)
    if(source MATCHES "^([a-z]+)_[a-z_]*\\.cpp$")
      shm_together(${target} ${CMAKE_MATCH_1} ${source})
    endif()
  endforeach()
endfunction()
