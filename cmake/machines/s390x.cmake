# Toolchain for s390x (IBM Z, 64 bits). It is big-endian; char is unsigned; it has fused
# multiply-add.
set(SHM_PROCESSOR s390x)
set(SHM_TRIPLET s390x-linux-gnu)
set(SHM_EMULATOR qemu-s390x)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
