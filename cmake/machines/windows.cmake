# Toolchain for 64-bit Windows. Programs run under Wine. Windows is little-endian and has no POSIX
# functions; `long` has 32 bits.
set(SHM_PROCESSOR x86_64)
set(SHM_SYSTEM Windows)
set(SHM_TRIPLET x86_64-w64-mingw32)
set(SHM_EMULATOR "${CMAKE_CURRENT_LIST_DIR}/wine")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
# Debian has two variants of each MinGW compiler. std::thread needs the variant with POSIX threads.
set(CMAKE_C_COMPILER ${SHM_TRIPLET}-gcc-posix)
set(CMAKE_CXX_COMPILER ${SHM_TRIPLET}-g++-posix)
