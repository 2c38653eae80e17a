# shm_warnings(TARGET): the warnings that all code of ours is clean of.
# Off, with reasons: sign conversions, because sizes and offsets of the standard library mix both
# signs; missing field initializers, because g++ counts members that a designated initializer
# leaves to their defaults; restrict, because g++ 12 sees overlaps in "text" + std::string.
function(shm_warnings target)
  target_compile_options(
    ${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                      -Wno-missing-field-initializers
                      $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  if(SHM_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
