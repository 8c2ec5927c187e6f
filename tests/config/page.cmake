# Comparison of PAGE with the output of `UNIMAPPER COMMAND`.
execute_process(COMMAND ${CMAKE_CROSSCOMPILING_EMULATOR} ${UNIMAPPER} ${COMMAND}
  OUTPUT_VARIABLE printed COMMAND_ERROR_IS_FATAL ANY)
file(READ "${PAGE}" committed)
if(NOT printed STREQUAL committed)
  message(FATAL_ERROR "${PAGE} is out of date: ${UNIMAPPER} ${COMMAND} > ${PAGE}")
endif()
