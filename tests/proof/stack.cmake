# Driver of the stack test: runs stack.awk on the call graphs of OBJECTS below ENTRIES.
cmake_policy(VERSION 3.22)

# Runs stack.awk over the call graphs that lie beside objects.
#
# cmake -DENTRIES=REGEX -DOBJECTS=a.o;b.o -P stack.cmake
set(graphs)
foreach(object IN LISTS OBJECTS)
  string(REGEX REPLACE "[.]o$" ".ci" graph "${object}")
  if(NOT EXISTS "${graph}")
    message(FATAL_ERROR "${graph} is missing: was the object taken from a compiler cache?")
  endif()
  list(APPEND graphs "${graph}")
endforeach()
execute_process(COMMAND awk -v "entries=${ENTRIES}" -v limit=65536
  -f ${CMAKE_CURRENT_LIST_DIR}/stack.awk ${CMAKE_CURRENT_LIST_DIR}/stack_rules.txt ${graphs}
  RESULT_VARIABLE failed OUTPUT_VARIABLE report ERROR_VARIABLE report)
message("${report}")
if(failed)
  message(FATAL_ERROR "the stack has no proven bound")
endif()
