# Check of the programs of docs/examples: 20 to 40 lines each, and linked by docs/using.md.
#
# cmake -DFOLDER=docs -P listed.cmake
cmake_policy(VERSION 3.22)
file(READ "${FOLDER}/using.md" page)
file(GLOB programs RELATIVE "${FOLDER}" "${FOLDER}/examples/*.c" "${FOLDER}/examples/*.cpp")
foreach(program IN LISTS programs)
  file(READ "${FOLDER}/${program}" text)
  string(REGEX MATCHALL "\n" line_ends "${text}")
  list(LENGTH line_ends lines)
  if(lines LESS 20 OR lines GREATER 40)
    message(FATAL_ERROR "docs/${program} has ${lines} lines, not 20 to 40")
  endif()
  string(FIND "${page}" "(${program})" at)
  if(at EQUAL -1)
    message(FATAL_ERROR "docs/using.md does not link ${program}")
  endif()
endforeach()
