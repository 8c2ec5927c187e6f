# Installs the build into a fresh prefix, by its packages where they can be made, and builds against
# it, as other projects would: a robot's programs in C and C++, which write encoded keyframes to
# files, and a base station's, which merges them. Checks that the README shows its example as it is
# compiled here.
function(run)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE status OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed: ${ARGN}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE "${WORK}")
find_program(DPKG_DEB dpkg-deb)
find_program(DPKG_SHLIBDEPS dpkg-shlibdeps)
if(DPKG_DEB AND DPKG_SHLIBDEPS AND NOT TOOLCHAIN AND NOT SANITIZE)
  # What the packages of Debian hold, in a root of its own.
  set(prefix "${WORK}/root/usr")
  run(${CPACK} -G DEB --config "${BUILD}/CPackConfig.cmake" -B "${WORK}/packages")
  file(GLOB packages "${WORK}/packages/*.deb")
  foreach(package IN LISTS packages)
    run(${DPKG_DEB} --extract "${package}" "${WORK}/root")
  endforeach()
  if(BASE)
    run("${prefix}/bin/unimapper" --version)
  endif()
else()
  set(prefix "${WORK}/prefix")
  run(${CMAKE_COMMAND} --install "${BUILD}" --prefix "${prefix}")
endif()
set(where "-DCMAKE_PREFIX_PATH=${prefix}")
if(TOOLCHAIN)
  # The toolchain confines searches to its package root.
  file(GLOB_RECURSE package "${prefix}/unimapperConfig.cmake")
  get_filename_component(directory "${package}" DIRECTORY)
  set(where "-DCMAKE_TOOLCHAIN_FILE=${TOOLCHAIN}" "-Dunimapper_DIR=${directory}")
endif()
if(SANITIZE)
  list(APPEND where "-DCMAKE_CXX_FLAGS=${SANITIZE}" "-DCMAKE_C_FLAGS=${SANITIZE}")
endif()

# build(PROJECT): one project of this folder against the prefix.
function(build project)
  run(${CMAKE_COMMAND} -S "${SOURCE}/tests/install/${project}" -B "${WORK}/${project}" -G Ninja
    -DCMAKE_BUILD_TYPE=Release ${where}
    "-DEXAMPLE=${SOURCE}/docs/examples/first_keyframe.cpp"
    "-DEXAMPLE_C=${SOURCE}/docs/examples/first_keyframe.c"
    "-DEXAMPLE_DELIVER=${SOURCE}/docs/examples/deliver.c")
  run(${CMAKE_COMMAND} --build "${WORK}/${project}")
endfunction()

# run_and_find(PATTERN PROGRAM ARGUMENTS...): a program that must print the pattern.
function(run_and_find pattern program)
  run(${EMULATOR} "${WORK}/${program}" ${ARGN})
  if(NOT output MATCHES "${pattern}")
    message(FATAL_ERROR "${program} ran but printed: ${output}")
  endif()
endfunction()

build(robot)
run_and_find("keyframe: [1-9][0-9]* static cells" robot/first_keyframe)
foreach(example first_keyframe_c first_keyframe_c_static)
  run_and_find("keyframe 0: [1-9][0-9]* static cells" robot/${example})
endforeach()
# What a robot's and a deliverer's program load: nothing of the base's.
function(loads_no library program)
  if(NOT TOOLCHAIN)
    run(objdump -p "${WORK}/${program}")
    if(output MATCHES "NEEDED +lib(${library})")
      message(FATAL_ERROR "${program} loads lib${CMAKE_MATCH_1}")
    endif()
  endif()
endfunction()
loads_no("nats|lcm|sqlite3|ceres" robot/record_session_cpp)
foreach(language c cpp)
  file(MAKE_DIRECTORY "${WORK}/session_${language}")
  run(${EMULATOR} "${WORK}/robot/record_session_${language}" "${WORK}/session_${language}")
endforeach()

if(BASE)
  build(base)
  run(${EMULATOR} "${WORK}/base/merge_sessions" "${WORK}/session_c" "${WORK}/session_cpp")
  message(STATUS "${output}")
  run(${EMULATOR} "${WORK}/base/every_component")
  loads_no("nats|sqlite3|ceres" base/deliver_c)
  # Twice: the second start finds what the first left in its spool.
  foreach(start RANGE 1 2)
    run_and_find("2 keyframes, 0 acknowledged" base/deliver_c "memq://" "${WORK}/spool")
  endforeach()
endif()

# What a Makefile would use instead of CMake, if pkg-config is there. compile(COMPILER SOURCE
# COMPONENTS...): a program from one source and the components' flags.
find_program(PKG_CONFIG pkg-config)
file(GLOB_RECURSE pc "${prefix}/*/unimapper_c.pc")
get_filename_component(pc_directory "${pc}" DIRECTORY)
function(compile compiler source)
  list(TRANSFORM ARGN PREPEND unimapper_ OUTPUT_VARIABLE modules)
  run(${CMAKE_COMMAND} -E env "PKG_CONFIG_PATH=${pc_directory}"
    ${PKG_CONFIG} --cflags --libs ${modules})
  separate_arguments(flags UNIX_COMMAND "${output}")
  run(${compiler} "${SOURCE}/${source}" -o "${WORK}/with_pkg_config" ${SANITIZE} ${flags}
    "-Wl,-rpath,${pc_directory}/..")
endfunction()
if(PKG_CONFIG AND NOT TOOLCHAIN)
  compile(${C_COMPILER} docs/examples/first_keyframe.c c)
  run("${WORK}/with_pkg_config")
  compile("${COMPILER};-std=c++20" docs/examples/first_keyframe.cpp onboard)
  run("${WORK}/with_pkg_config")
  if(BASE)
    compile("${COMPILER};-std=c++20" tests/install/programs/merge_sessions.cpp merge wire)
    run("${WORK}/with_pkg_config" "${WORK}/session_c" "${WORK}/session_cpp")
    compile("${COMPILER};-std=c++20" tests/install/programs/every_component.cpp
      delivery lcm datasets evaluate events shared_memory spool store)
    run("${WORK}/with_pkg_config")
  endif()
endif()

file(READ "${SOURCE}/docs/examples/first_keyframe.cpp" example)
file(READ "${SOURCE}/README.md" readme)
string(FIND "${readme}" "${example}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "README.md does not show docs/examples/first_keyframe.cpp as it is")
endif()
