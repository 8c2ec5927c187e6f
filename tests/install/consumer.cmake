# Installs the build into a fresh prefix, builds the README's example against it, runs it, and
# checks that the README shows that very example.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(prefix "${WORK}/prefix")
set(build "${WORK}/consumer")
file(REMOVE_RECURSE "${WORK}")
run(${CMAKE_COMMAND} --install "${BUILD}" --prefix "${prefix}")
set(where "-DCMAKE_PREFIX_PATH=${prefix}")
if(TOOLCHAIN)
  # The toolchain confines searches to its package root.
  file(GLOB_RECURSE package "${prefix}/unimapperConfig.cmake")
  get_filename_component(directory "${package}" DIRECTORY)
  set(where "-DCMAKE_TOOLCHAIN_FILE=${TOOLCHAIN}" "-Dunimapper_DIR=${directory}")
endif()
run(${CMAKE_COMMAND} -S "${SOURCE}/tests/install/consumer" -B "${build}" -G Ninja
  ${where} "-DEXAMPLE=${SOURCE}/docs/examples/first_keyframe.cpp"
  "-DCMAKE_CXX_FLAGS=${SANITIZE}")
run(${CMAKE_COMMAND} --build "${build}")
run(${EMULATOR} "${build}/first_keyframe")
if(NOT output MATCHES "keyframe: [1-9][0-9]* static cells")
  message(FATAL_ERROR "the example ran but printed: ${output}")
endif()

file(READ "${SOURCE}/docs/examples/first_keyframe.cpp" example)
file(READ "${SOURCE}/README.md" readme)
string(FIND "${readme}" "${example}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "README.md does not show docs/examples/first_keyframe.cpp as it is")
endif()
