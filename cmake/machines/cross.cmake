# Common part of the toolchain files in this folder. Each toolchain file sets SHM_PROCESSOR and
# SHM_TRIPLET. It also sets SHM_EMULATOR if the build machine cannot run programs of the target
# machine directly, and SHM_SYSTEM if the target system is not Linux. scripts/other-machines
# installs libraries for the target machine (zstd, xxHash, GoogleTest) into build/machines. The C
# and C++ libraries come with Debian's cross compilers.
get_filename_component(SHM_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../../build/machines" ABSOLUTE)
string(APPEND SHM_SYSROOT /${SHM_TRIPLET})
if(NOT SHM_SYSTEM)
  set(SHM_SYSTEM Linux)
endif()
set(CMAKE_SYSTEM_NAME ${SHM_SYSTEM})
set(CMAKE_SYSTEM_PROCESSOR ${SHM_PROCESSOR})
set(CMAKE_C_COMPILER ${SHM_TRIPLET}-gcc)
set(CMAKE_CXX_COMPILER ${SHM_TRIPLET}-g++)
set(CMAKE_LIBRARY_ARCHITECTURE ${SHM_TRIPLET})
# Programs are linked statically, so that they need no files of SHM_SYSROOT at run time.
set(CMAKE_EXE_LINKER_FLAGS_INIT -static)
set(CMAKE_FIND_LIBRARY_SUFFIXES .a)
if(SHM_EMULATOR)
  set(CMAKE_CROSSCOMPILING_EMULATOR ${SHM_EMULATOR})
endif()

set(CMAKE_FIND_ROOT_PATH "${SHM_SYSROOT}" /usr/${SHM_TRIPLET})
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(ENV{PKG_CONFIG_PATH} "")
set(ENV{PKG_CONFIG_LIBDIR} "${SHM_SYSROOT}/usr/lib/${SHM_TRIPLET}/pkgconfig")
set(ENV{PKG_CONFIG_SYSROOT_DIR} "${SHM_SYSROOT}")
