# Installs the library from the build folder BUILD into the folder WORK, and builds the example
# against each library in TARGETS.
cmake_policy(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

string(REPLACE "," ";" targets "${TARGETS}")
file(REMOVE_RECURSE "${WORK}")
run("${CMAKE_COMMAND}" --install "${BUILD}" --prefix "${WORK}/root" --component library)
foreach(target IN LISTS targets)
  set(project "${WORK}/${target}")
  file(WRITE "${project}/CMakeLists.txt"
       "cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES CXX)
find_package(shmformat 0.10 REQUIRED)
add_executable(user \"${SOURCE}/readme_example.cpp\")
target_link_libraries(user PRIVATE shmformat::${target})
")
  run("${CMAKE_COMMAND}" -S "${project}" -B "${project}/build" -G Ninja
      "-DCMAKE_PREFIX_PATH=${WORK}/root" "-DCMAKE_CXX_COMPILER=${COMPILER}"
      "-DCMAKE_CXX_FLAGS=${FLAGS}")
  run("${CMAKE_COMMAND}" --build "${project}/build")
  run("${project}/build/user")
endforeach()

# Builds a C program that uses the C interface of the installed library.
if("shmformat" IN_LIST targets)
  set(project "${WORK}/c")
  file(WRITE "${project}/CMakeLists.txt"
       "cmake_minimum_required(VERSION 3.25)
project(user LANGUAGES C)
find_package(shmformat 0.10 REQUIRED)
add_executable(user \"${EXAMPLES}/write_steps.c\")
target_link_libraries(user PRIVATE shmformat::c)
")
  run("${CMAKE_COMMAND}" -S "${project}" -B "${project}/build" -G Ninja
      "-DCMAKE_PREFIX_PATH=${WORK}/root")
  run("${CMAKE_COMMAND}" --build "${project}/build")
  run("${project}/build/user" "${WORK}/bar.shm")
endif()

# Moves the installation to another folder and builds a program with pkg-config. If the compiler
# does not use C++20, the first line of the error message must name the missing option.
file(RENAME "${WORK}/root" "${WORK}/moved")
file(GLOB_RECURSE description "${WORK}/moved/*/shmformat.pc")
get_filename_component(folder "${description}" DIRECTORY)
find_program(PKG_CONFIG pkg-config REQUIRED)
execute_process(
  COMMAND "${CMAKE_COMMAND}" -E env "PKG_CONFIG_PATH=${folder}" "${PKG_CONFIG}" --static --cflags --libs
          shmformat
  OUTPUT_VARIABLE words OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
separate_arguments(words UNIX_COMMAND "${words}")
separate_arguments(flags UNIX_COMMAND "${FLAGS}")
run("${COMPILER}" ${flags} "${SOURCE}/readme_example.cpp" ${words} -o "${WORK}/user")
get_filename_component(library "${folder}" DIRECTORY)
run("${CMAKE_COMMAND}" -E env "LD_LIBRARY_PATH=${library}" "${WORK}/user")
execute_process(
  COMMAND "${COMPILER}" ${flags} ${words} -std=c++17 -fsyntax-only "${SOURCE}/readme_example.cpp"
  RESULT_VARIABLE code ERROR_VARIABLE text)
if(code EQUAL 0 OR NOT text MATCHES "libshmformat needs C\\+\\+20")
  message(FATAL_ERROR "C++17 is not refused as it should be: ${text}")
endif()
if("shmformat" IN_LIST targets)
  execute_process(
    COMMAND "${CMAKE_COMMAND}" -E env "PKG_CONFIG_PATH=${folder}" "${PKG_CONFIG}" --cflags --libs
            shmformat-c
    OUTPUT_VARIABLE words OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  separate_arguments(words UNIX_COMMAND "${words}")
  run(cc "${EXAMPLES}/first_array.c" ${words} -o "${WORK}/first_array")
  run("${CMAKE_COMMAND}" -E env "LD_LIBRARY_PATH=${library}" "${WORK}/first_array" "${WORK}/bar.shm")
endif()
file(GLOB_RECURSE licence "${WORK}/moved/share/*/LICENSE")
if(NOT licence)
  message(FATAL_ERROR "no licence is installed")
endif()
