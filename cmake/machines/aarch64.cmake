# Toolchain for 64-bit ARM (aarch64). It is little-endian; char is unsigned; it has fused
# multiply-add and weak memory ordering.
set(SHM_PROCESSOR aarch64)
set(SHM_TRIPLET aarch64-linux-gnu)
set(SHM_EMULATOR qemu-aarch64)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
