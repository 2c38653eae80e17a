# shm_warnings(TARGET): enables compiler warnings for TARGET. Our code must not cause any of them.
# Three warnings are disabled. -Wsign-conversion: the standard library uses signed offsets and
# unsigned sizes together. -Wmissing-field-initializers: g++ also warns about members that a
# designated initializer leaves at their defaults. -Wrestrict: g++ 12 falsely reports overlaps in
# "text" + std::string.
function(shm_warnings target)
  target_compile_options(
    ${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                      -Wno-missing-field-initializers
                      $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  if(SHM_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
