# Installs the library from BUILD below WORK and builds the example against each of TARGETS.
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
find_package(shmformat 0.9 REQUIRED)
add_executable(user \"${SOURCE}/readme_example.cpp\")
target_link_libraries(user PRIVATE shmformat::${target})
")
  run("${CMAKE_COMMAND}" -S "${project}" -B "${project}/build" -G Ninja
      "-DCMAKE_PREFIX_PATH=${WORK}/root" "-DCMAKE_CXX_COMPILER=${COMPILER}"
      "-DCMAKE_CXX_FLAGS=${FLAGS}")
  run("${CMAKE_COMMAND}" --build "${project}/build")
  run("${project}/build/user")
endforeach()
