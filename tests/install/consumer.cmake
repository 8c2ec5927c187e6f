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
run(${CMAKE_COMMAND} -S "${SOURCE}/tests/install/consumer" -B "${build}" -G Ninja
  "-DCMAKE_PREFIX_PATH=${prefix}" "-DEXAMPLE=${SOURCE}/docs/examples/first_keyframe.cpp"
  "-DEXAMPLE_C=${SOURCE}/docs/examples/first_keyframe.c"
  "-DCMAKE_CXX_FLAGS=${SANITIZE}" "-DCMAKE_C_FLAGS=${SANITIZE}")
run(${CMAKE_COMMAND} --build "${build}")
run("${build}/first_keyframe")
if(NOT output MATCHES "keyframe: [1-9][0-9]* static cells")
  message(FATAL_ERROR "the example ran but printed: ${output}")
endif()
foreach(example first_keyframe_c first_keyframe_c_static)
  run("${build}/${example}")
  if(NOT output MATCHES "keyframe 0: [1-9][0-9]* static cells")
    message(FATAL_ERROR "${example} ran but printed: ${output}")
  endif()
endforeach()

# What a Makefile would use instead of CMake, if pkg-config is there.
find_program(PKG_CONFIG pkg-config)
if(PKG_CONFIG)
  file(GLOB_RECURSE pc "${prefix}/*/unimapper_c.pc")
  get_filename_component(pc_directory "${pc}" DIRECTORY)
  run(${CMAKE_COMMAND} -E env "PKG_CONFIG_PATH=${pc_directory}"
    ${PKG_CONFIG} --cflags --libs unimapper_c)
  if(NOT output MATCHES "-lunimapper_c")
    message(FATAL_ERROR "pkg-config said: ${output}")
  endif()
endif()

file(READ "${SOURCE}/docs/examples/first_keyframe.cpp" example)
file(READ "${SOURCE}/README.md" readme)
string(FIND "${readme}" "${example}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "README.md does not show docs/examples/first_keyframe.cpp as it is")
endif()
