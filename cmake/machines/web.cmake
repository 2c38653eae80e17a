# Browsers and Node.js: WebAssembly with what all engines have since 2021. Sizes of 32 bits, one
# thread, no exceptions, no files.
set(SHM_PROCESSOR wasm32)
set(SHM_SYSTEM Generic)
set(SHM_TRIPLET wasm32-wasi)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
# Debian has no compilers that are called by the triplet.
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(CMAKE_AR llvm-ar-19)
set(CMAKE_RANLIB llvm-ranlib-19)
set(CMAKE_C_COMPILER_TARGET ${SHM_TRIPLET})
set(CMAKE_CXX_COMPILER_TARGET ${SHM_TRIPLET})
# All is one program, foreign libraries included.
set(CMAKE_C_FLAGS_INIT "-flto -mbulk-memory -mnontrapping-fptoint")
# What throws has no handler: it ends in bindings/web/src/machine.cpp.
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -fignore-exceptions -fno-rtti")
set(CMAKE_EXE_LINKER_FLAGS_INIT "")
