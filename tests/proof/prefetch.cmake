# Driver of the prefetch test: runs prefetch.awk on the disassembled LIBRARIES.
#
# cmake -DOBJDUMP=... -DRULES=FILE -DLIBRARIES=a;b;c -P prefetch.cmake
cmake_policy(VERSION 3.22)

execute_process(COMMAND ${OBJDUMP} -dr --no-show-raw-insn -C ${LIBRARIES}
  COMMAND awk -f ${CMAKE_CURRENT_LIST_DIR}/prefetch.awk ${RULES} -
  RESULTS_VARIABLE results OUTPUT_VARIABLE report ERROR_VARIABLE report)
message("${report}")
if(NOT results STREQUAL "0;0")
  message(FATAL_ERROR "prefetches are missing in the object code")
endif()
