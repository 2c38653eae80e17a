# Toolchain for browsers and Node.js: WebAssembly, with only those features that all engines have
# had since 2021. size_t has 32 bits. Programs run in one thread, without exceptions and without
# access to files.
set(SHM_PROCESSOR wasm32)
set(SHM_SYSTEM Generic)
set(SHM_TRIPLET wasm32-wasi)
include("${CMAKE_CURRENT_LIST_DIR}/cross.cmake")
# Debian's compilers for WebAssembly do not have the triplet in their names.
set(CMAKE_C_COMPILER clang-19)
set(CMAKE_CXX_COMPILER clang++-19)
set(CMAKE_AR llvm-ar-19)
set(CMAKE_RANLIB llvm-ranlib-19)
set(CMAKE_C_COMPILER_TARGET ${SHM_TRIPLET})
set(CMAKE_CXX_COMPILER_TARGET ${SHM_TRIPLET})
# All code, including third-party libraries, is linked into a single program.
set(CMAKE_C_FLAGS_INIT "-flto -mbulk-memory -mnontrapping-fptoint")
# No code catches exceptions. A throw expression calls a function in bindings/web/src/machine.cpp
# that ends the WebAssembly instance.
set(CMAKE_CXX_FLAGS_INIT "${CMAKE_C_FLAGS_INIT} -fignore-exceptions -fno-rtti")
set(CMAKE_EXE_LINKER_FLAGS_INIT "")
