# Symbol test of the shared C library: only um_ functions are exported.
cmake_policy(VERSION 3.22)

# What the shared C library shows the world: every function of its headers and nothing else; what
# it asks of the world: the C library and its maths.
#
# cmake -DNM=... -DREADELF=... -DHEADERS=ports/c -DLIBRARY=libunimapper_c.so -P exports.cmake
execute_process(COMMAND ${NM} -D --defined-only -P ${LIBRARY}
  OUTPUT_VARIABLE listing RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${NM} could not read ${LIBRARY}")
endif()
string(REGEX MATCHALL "[^\n ]+ [^\n]*\n" lines "${listing}")
set(shown)
foreach(line IN LISTS lines)
  string(REGEX REPLACE " .*" "" name "${line}")
  list(APPEND shown ${name})
endforeach()
list(SORT shown)

file(GLOB files "${HEADERS}/*.h")
set(header "")
foreach(file IN LISTS files)
  file(READ "${file}" text)
  string(APPEND header "${text}")
endforeach()
string(REGEX MATCHALL "UM_API (UM_CHECKED )?[a-z_0-9* ]+ ?\\*?um_[a-z_]+\\(" declarations "${header}")
set(declared)
foreach(declaration IN LISTS declarations)
  string(REGEX REPLACE ".*(um_[a-z_]+)\\($" "\\1" name "${declaration}")
  list(APPEND declared ${name})
endforeach()
list(SORT declared)
list(LENGTH declared count)
if(count LESS 15)
  message(FATAL_ERROR "only ${count} functions found in ${HEADERS}: it was not understood")
endif()
if(NOT shown STREQUAL declared)
  message(FATAL_ERROR "declared: ${declared}\nshown: ${shown}")
endif()

execute_process(COMMAND ${READELF} -d ${LIBRARY} OUTPUT_VARIABLE dynamic RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "${READELF} could not read ${LIBRARY}")
endif()
if(dynamic MATCHES "NEEDED[^\n]*libstdc")
  message(FATAL_ERROR "the library needs a C++ runtime:\n${dynamic}")
endif()
message(STATUS "${count} functions, all of them um_")
