# shm_loaded(TARGET IMPORTED [MACRO LIBRARY]...): TARGET, a static library of this build, will open
# the libraries of the imported target IMPORTED at run time, when they are needed
# (base/loaded_library), instead of linking to them. Loading linked libraries would take most of the
# start-up time of the tool. LIBRARY is the file of a shared library. In TARGET, the macro MACRO is
# defined as the name by which the loader finds LIBRARY. TARGET receives the include folders of
# IMPORTED.
#
# If the loader cannot find one of the libraries by its name, or if SHM_LOAD_LIBRARIES is OFF,
# TARGET is linked to IMPORTED, and the macros are not defined.
#
# The global property SHM_LOADED_LIBRARIES lists the paths of the libraries that are opened on
# demand. Packages need this list, because programs do not record such libraries as dependencies.

option(SHM_LOAD_LIBRARIES "Open libraries of some formats on demand; OFF: link programs to them" ON)

# Stores the soname of a library in the variable `result`. Stores an empty string if the library has
# no soname, or if the loader does not search the folder of the library.
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
