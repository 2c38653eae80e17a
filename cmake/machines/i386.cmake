# Sizes of 32 bits. Runs on x86-64 as it is.
set(SHM_PROCESSOR i686)
set(SHM_TRIPLET i686-linux-gnu)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
