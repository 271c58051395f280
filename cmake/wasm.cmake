# Cross-compiles for WebAssembly by clang and the C library for WASI, from the distribution (tools/setup --wasm).
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_CXX_COMPILER clang++-16)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
set(CMAKE_SYSROOT /usr)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
# Without tables for unwinding: what is thrown ends the predictor (wasm/predictor.cpp).
set(CMAKE_CXX_FLAGS_INIT "-Wno-unused-command-line-argument -nostdinc++ -isystem /usr/lib/llvm-16/include/wasm32-wasi/c++/v1 -fignore-exceptions -fno-threadsafe-statics")
