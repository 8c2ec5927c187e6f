# Find module of LCM.
#
# Debian's liblcm-dev has no CMake package, and its pkg-config file wants glib's headers, which
# LCM's own headers do not. Provides LCM::lcm, LCM_GEN and unimapper_lcm_generate().
find_path(LCM_INCLUDE_DIR lcm/lcm-cpp.hpp)
find_library(LCM_LIBRARY lcm)
find_program(LCM_GEN lcm-gen)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LCM REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR)
if(LCM_FOUND AND NOT TARGET LCM::lcm)
  add_library(LCM::lcm SHARED IMPORTED GLOBAL)
  set_target_properties(LCM::lcm PROPERTIES IMPORTED_LOCATION "${LCM_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${LCM_INCLUDE_DIR}")
endif()

# unimapper_lcm_generate(TARGET name PACKAGE package FILES a.lcm ...): an interface library whose
# include directory holds <package>/<type>.hpp for every message, generated when a file changes.
function(unimapper_lcm_generate)
  cmake_parse_arguments(arg "" "TARGET;PACKAGE" "FILES" ${ARGN})
  if(NOT LCM_GEN)
    message(FATAL_ERROR "lcm-gen is missing (Debian: liblcm-bin)")
  endif()
  set(out "${CMAKE_CURRENT_BINARY_DIR}/lcm_messages")
  set(headers)
  foreach(file IN LISTS arg_FILES)
    get_filename_component(type "${file}" NAME_WE)
    set(header "${out}/${arg_PACKAGE}/${type}.hpp")
    add_custom_command(OUTPUT "${header}"
      COMMAND "${LCM_GEN}" --cpp --cpp-hpath "${out}" "${CMAKE_CURRENT_SOURCE_DIR}/${file}"
      DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/${file}"
      COMMENT "Generating ${arg_PACKAGE}/${type}.hpp" VERBATIM)
    list(APPEND headers "${header}")
  endforeach()
  # A header whose message is gone would still be found, here and in no other build.
  file(GLOB outdated "${out}/${arg_PACKAGE}/*.hpp")
  list(REMOVE_ITEM outdated ${headers})
  if(outdated)
    file(REMOVE ${outdated})
  endif()
  add_custom_target(${arg_TARGET}_headers DEPENDS ${headers})
  add_library(${arg_TARGET} INTERFACE)
  add_dependencies(${arg_TARGET} ${arg_TARGET}_headers)
  # System: generated code is not held to the project's warnings.
  target_include_directories(${arg_TARGET} SYSTEM INTERFACE "${out}")
  # LCM's headers read and write floating-point numbers through pointers to integers.
  target_compile_options(${arg_TARGET} INTERFACE -fno-strict-aliasing)
  target_link_libraries(${arg_TARGET} INTERFACE LCM::lcm)
endfunction()
