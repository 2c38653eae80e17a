# s390x is big-endian and has 64 bits, unsigned char, and fused multiply-add.
set(SHM_PROCESSOR s390x)
set(SHM_TRIPLET s390x-linux-gnu)
set(SHM_EMULATOR qemu-s390x)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
