# shm_warnings(TARGET): enables the warnings that our code must not cause. Three warnings are
# disabled: sign conversion, because sizes and offsets of the standard library mix signed and
# unsigned types; missing field initializers, because g++ also warns about members that a
# designated initializer leaves at their defaults; and restrict, because g++ 12 falsely reports
# overlaps in "text" + std::string.
function(shm_warnings target)
  target_compile_options(
    ${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion
                      -Wno-missing-field-initializers
                      $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>)
  if(SHM_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
