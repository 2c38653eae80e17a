# shm_loaded(TARGET IMPORTED [MACRO LIBRARY]...): what TARGET, a static library of this build, uses of IMPORTED
# it opens when it needs it (base/loaded_library), as if programs were linked to it: linked, it would be
# most of what each start of the tool takes. LIBRARY is the file of a shared library, MACRO becomes the name
# by which the loader finds it. TARGET gets the include folders of IMPORTED.
#   Where a loader would not find one of them by its name alone, and with SHM_LOAD_LIBRARIES=OFF, TARGET is
# linked to IMPORTED, and there are no macros.
#   The global property SHM_LOADED_LIBRARIES lists all that are opened so, folder and name: a program does not
# say that it needs them, and packages have to.

option(SHM_LOAD_LIBRARIES "Open libraries of some formats when they are needed; OFF: programs are linked to them" ON)

# Empty where it has none, or the loader does not look where it is.
function(shm_soname library result)
  set(${result} "" PARENT_SCOPE)
  get_filename_component(file "${library}" REALPATH)
  get_filename_component(folder "${library}" DIRECTORY)
  if(NOT file MATCHES "\\.so[.0-9]*$" OR NOT CMAKE_OBJDUMP
     OR NOT folder MATCHES "^(/usr)?/lib(64|32)?(/${CMAKE_CXX_LIBRARY_ARCHITECTURE})?$")
    return()
  endif()
  execute_process(COMMAND "${CMAKE_OBJDUMP}" -p "${file}" OUTPUT_VARIABLE headers ERROR_QUIET)
  if(headers MATCHES "SONAME +([^ \n]+)")
    set(${result} "${CMAKE_MATCH_1}" PARENT_SCOPE)
  endif()
endfunction()

function(shm_loaded target imported)
  set(libraries "")
  set(macros "")
  set(all_found ${SHM_LOAD_LIBRARIES})
  if(NOT CMAKE_SYSTEM_NAME STREQUAL "Linux" OR CMAKE_CROSSCOMPILING)
    set(all_found OFF)
  endif()
  while(ARGN)
    list(POP_FRONT ARGN macro library)
    shm_soname("${library}" name)
    if(NOT name)
      set(all_found OFF)
    endif()
    list(APPEND macros "${macro}=\"${name}\"")
    get_filename_component(folder "${library}" DIRECTORY)
    list(APPEND libraries "${folder}/${name}")
  endwhile()
  if(NOT all_found)
    target_link_libraries(${target} PRIVATE ${imported})
    return()
  endif()
  target_include_directories(
    ${target} SYSTEM PRIVATE $<TARGET_PROPERTY:${imported},INTERFACE_INCLUDE_DIRECTORIES>)
  target_compile_definitions(${target} PRIVATE ${macros})
  target_link_libraries(${target} PRIVATE ${CMAKE_DL_LIBS})
  set_property(GLOBAL APPEND PROPERTY SHM_LOADED_LIBRARIES ${libraries})
endfunction()
