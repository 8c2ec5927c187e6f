# 64-bit ARM (Cortex-A53 and newer, Jetson, Raspberry Pi 3 and newer), Linux.
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(unimapper_triplet aarch64-linux-gnu)
set(unimapper_package_root arm64)
set(unimapper_emulator qemu-aarch64)
include("${CMAKE_CURRENT_LIST_DIR}/arm/linux.cmake")
