# Search of the SOURCES for prefetches that the compiler may delete (see core/prefetch.hpp).
#
# cmake -DSOURCES=DIRECTORY -P prefetch_sources.cmake
cmake_policy(VERSION 3.22)

file(GLOB_RECURSE files "${SOURCES}/include/*.hpp" "${SOURCES}/src/*.hpp" "${SOURCES}/src/*.cpp")
set(count 0)
foreach(file IN LISTS files)
  file(STRINGS "${file}" lines REGEX "__builtin_prefetch|_mm_prefetch")
  if(NOT lines)
    continue()
  endif()
  math(EXPR count "${count} + 1")
  if(NOT file MATCHES "src/core/prefetch[.]hpp$")
    message(SEND_ERROR "${file} must use core/prefetch.hpp: ${lines}")
  endif()
endforeach()
if(count EQUAL 0)
  message(FATAL_ERROR "no prefetch at all: the sources were not found")
endif()
