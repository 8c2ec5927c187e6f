# Library targets of the rooms:
# unimapper_library(NAME SOURCES ... [DEPENDS ...] [PRIVATE_DEPENDS ...]
#                   [FREESTANDING] [REPRODUCIBLE] [PORT] [COLD])
#
# One room as one static library with the alias unimapper::NAME. FREESTANDING rooms
# (core, free_space, place, odometry, onboard) also hold without exceptions, RTTI and thread-safe statics.
# They and REPRODUCIBLE ones compute the same bits on every processor. The headers of PORT libraries lie in
# ports/NAME. COLD ones are hardly optimised (unimapper_cold).
function(unimapper_library name)
  cmake_parse_arguments(arg "FREESTANDING;REPRODUCIBLE;PORT;COLD" ""
    "SOURCES;DEPENDS;PRIVATE_DEPENDS" ${ARGN})
  add_library(unimapper_${name} STATIC ${arg_SOURCES})
  add_library(unimapper::${name} ALIAS unimapper_${name})
  set_target_properties(unimapper_${name} PROPERTIES EXPORT_NAME ${name})
  target_include_directories(unimapper_${name} PUBLIC
    $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  if(arg_PORT)
    # "ports/NAME/header.hpp" is what both the tree's and an installed header is included as.
    target_include_directories(unimapper_${name} PUBLIC
      $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
      $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/unimapper>)
  endif()
  set_property(GLOBAL APPEND PROPERTY UNIMAPPER_LIBRARIES ${name})
  if(arg_FREESTANDING)
    set_property(GLOBAL APPEND PROPERTY UNIMAPPER_FREESTANDING_LIBRARIES ${name})
  endif()
  target_link_libraries(unimapper_${name} PUBLIC ${arg_DEPENDS} PRIVATE ${arg_PRIVATE_DEPENDS})
  unimapper_compile_options(unimapper_${name})
  if(arg_COLD)
    unimapper_cold(unimapper_${name})
  endif()
  if(UNIMAPPER_BUILD_FUZZERS)
    target_compile_options(unimapper_${name} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
  if(arg_FREESTANDING AND UNIMAPPER_FREESTANDING_CORE)
    target_compile_options(unimapper_${name} PRIVATE
      -fno-exceptions -fno-rtti -fno-threadsafe-statics)
  endif()
  if(arg_FREESTANDING OR arg_REPRODUCIBLE)
    # Eigen's own vector code sums in an order that depends on the instruction set, fuses multiply
    # and add on aarch64, and estimates roots and quotients on ARMv7. Private: how a user of the
    # library compiles Eigen is independent of it. The alignment is what Eigen has without that:
    # inline functions that several libraries contain are linked once and must agree about layouts.
    target_compile_definitions(unimapper_${name} PRIVATE EIGEN_DONT_VECTORIZE
      EIGEN_MAX_ALIGN_BYTES=16 EIGEN_MAX_STATIC_ALIGN_BYTES=16)
  endif()
  if(arg_FREESTANDING OR UNIMAPPER_PYTHON)
    # The C library's shared form and the Python module are made of the same objects and show none of
    # their symbols.
    set_target_properties(unimapper_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON
      CXX_VISIBILITY_PRESET hidden VISIBILITY_INLINES_HIDDEN ON)
  endif()
  if(arg_FREESTANDING AND UNIMAPPER_CALL_GRAPH)
    # Two equal functions stay two, or one of them is missing in the graph.
    target_compile_options(unimapper_${name} PRIVATE -fcallgraph-info=su,da -fno-ipa-icf)
  endif()
endfunction()

# Options every target of the project is built with.
function(unimapper_compile_options target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # "src/ROOM/header.hpp" is what other rooms include internal headers as.
  target_include_directories(${target} PRIVATE "${PROJECT_SOURCE_DIR}")
  # Fused multiply-add would make x86 and ARM differ in the last bit.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wshadow -Wconversion
    -Wno-sign-conversion -ffp-contract=off)
  set_property(TARGET ${target} PROPERTY UNIMAPPER_COLD OFF)
  target_compile_options(${target} PRIVATE
    $<$<CONFIG:Release>:$<IF:$<BOOL:$<TARGET_PROPERTY:UNIMAPPER_COLD>>,-O1,-O3>>)
  # GCC collects garbage from 128 MB on otherwise: 5 % of its time for no smaller peak.
  target_compile_options(${target} PRIVATE
    $<$<COMPILE_LANG_AND_ID:CXX,GNU>:--param=ggc-min-heapsize=600000>)
  # GCC 12 warns that strings which are put together might overlap (its bug 105651).
  target_compile_options(${target} PRIVATE $<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-restrict>)
  if(UNIMAPPER_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(UNIMAPPER_SANITIZE)
    # LCM's own C++ header calls through a pointer before the object behind it is of that class. What
    # Clang checks of pointers to functions needs a C++ runtime that programs in C do not link.
    target_compile_options(${target} PRIVATE -fsanitize=${UNIMAPPER_SANITIZE}
      -fno-sanitize=vptr$<$<CXX_COMPILER_ID:Clang>:,function> -fno-sanitize-recover=all -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${UNIMAPPER_SANITIZE})
    # Eigen allocates by another scheme under a sanitizer, but Ceres was built without one: what
    # one of them allocates the other could not free.
    target_compile_definitions(${target} PRIVATE EIGEN_MALLOC_ALREADY_ALIGNED=1)
    if(CMAKE_CXX_COMPILER_ID MATCHES Clang AND UNIMAPPER_SANITIZE MATCHES address)
      target_compile_definitions(${target} PRIVATE __SANITIZE_ADDRESS__=1)  # GCC says so itself
    endif()
  endif()
endfunction()

# A target that reads arguments, reads and writes files and JSON, or waits: -O1, since optimising it
# takes the compiler long and gains little.
function(unimapper_cold target)
  set_property(TARGET ${target} PROPERTY UNIMAPPER_COLD ON)
endfunction()
