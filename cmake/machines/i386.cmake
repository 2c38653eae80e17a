# Toolchain for 32-bit x86. size_t has 32 bits. Programs run on x86-64 without an emulator.
set(SHM_PROCESSOR i686)
set(SHM_TRIPLET i686-linux-gnu)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
