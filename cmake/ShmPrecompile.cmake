# shm_precompile(TARGET [LIKE]): where SHM_PRECOMPILE is on, the headers that most sources include
# are compiled once for TARGET, or taken from LIKE, which must have the same flags. Builds take a
# sixth less. Off in the release, so that a source that lacks an include is found.
set(SHM_COMMON_HEADERS
    <algorithm> <array> <cmath> <cstddef> <cstdint> <cstring> <functional> <map> <memory> <optional>
    <span> <string> <string_view> <unordered_map> <utility> <variant> <vector>)

function(shm_precompile target)
  if(NOT SHM_PRECOMPILE)
    return()
  endif()
  if(ARGC GREATER 1)
    target_precompile_headers(${target} REUSE_FROM ${ARGV1})
  else()
    target_precompile_headers(${target} PRIVATE ${SHM_COMMON_HEADERS})
  endif()
endfunction()
