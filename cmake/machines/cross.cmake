# Common part of the toolchain files in this folder. Each toolchain file sets SHM_PROCESSOR and
# SHM_TRIPLET. It also sets SHM_EMULATOR if this machine cannot run the programs directly, and
# SHM_SYSTEM if the system is not Linux. Libraries for the target machine (zstd, xxHash,
# GoogleTest) are in build/machines, which scripts/other-machines fills. The C and C++ libraries
# come with Debian's cross compilers.
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
# A statically linked program needs no files from SHM_SYSROOT at run time.
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
