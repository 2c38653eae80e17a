# aarch64 is little-endian and has 64 bits, unsigned char, fused multiply-add, and weak memory
# ordering.
set(SHM_PROCESSOR aarch64)
set(SHM_TRIPLET aarch64-linux-gnu)
set(SHM_EMULATOR qemu-aarch64)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
