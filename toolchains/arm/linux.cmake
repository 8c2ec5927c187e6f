# Common part of both ARM toolchains.
#
# Debian's cross compiler, libraries out of a private package root, and qemu's user-mode emulator,
# so that ctest runs the tests here.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_C_COMPILER ${unimapper_triplet}-gcc)
set(CMAKE_CXX_COMPILER ${unimapper_triplet}-g++)

# Made by toolchains/arm/package-root.sh.
get_filename_component(unimapper_root
  "${CMAKE_CURRENT_LIST_DIR}/../../build/package-roots/${unimapper_package_root}" ABSOLUTE)
set(CMAKE_FIND_ROOT_PATH "${unimapper_root}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)  # generators run on this machine
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_LIBRARY_ARCHITECTURE ${unimapper_triplet})

set(unimapper_libraries
  "${unimapper_root}/usr/lib/${unimapper_triplet}:${unimapper_root}/lib/${unimapper_triplet}")
# Libraries that only other libraries ask for.
set(CMAKE_EXE_LINKER_FLAGS_INIT "-Wl,-rpath-link,${unimapper_libraries}")
set(CMAKE_CROSSCOMPILING_EMULATOR
  ${unimapper_emulator} -L /usr/${unimapper_triplet} -E LD_LIBRARY_PATH=${unimapper_libraries})
