# Sizes of 32 bits. Runs on x86-64 as it is. Its first floating-point unit rounds twice: SSE2 instead.
set(SHM_PROCESSOR i686)
set(SHM_TRIPLET i686-linux-gnu)
set(CMAKE_CXX_FLAGS_INIT "-msse2 -mfpmath=sse")
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
