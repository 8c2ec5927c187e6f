# 32-bit ARM with NEON and floats in registers (Cortex-A7 to A15, and the 32-bit mode of newer
# ones), Linux. NEON flushes denormal floats to zero, so the compiler may use it for floats only if
# it is told that this does not matter: it does, never add -funsafe-math-optimizations.
set(CMAKE_SYSTEM_PROCESSOR armv7l)
set(CMAKE_CXX_FLAGS_INIT "-march=armv7-a+simd -mfpu=neon -mfloat-abi=hard -Wno-psabi")
set(unimapper_triplet arm-linux-gnueabihf)
set(unimapper_package_root armhf)
set(unimapper_emulator qemu-arm)
include("${CMAKE_CURRENT_LIST_DIR}/arm/linux.cmake")
