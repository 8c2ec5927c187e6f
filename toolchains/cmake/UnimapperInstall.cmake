# Installation and export of the libraries for find_package(unimapper COMPONENTS ...).
#
# Every library with public headers is a component of its own, with a pkg-config file each. What a
# component needs is read off the targets.
include(CMakePackageConfigHelpers)

set(unimapper_cmake_dir ${CMAKE_INSTALL_LIBDIR}/cmake/unimapper)
set(unimapper_components)
set(unimapper_needs "")

# How pkg-config spells what CMake finds as a package: a module, or plain linker flags.
set(unimapper_module_Eigen3 eigen3)
set(unimapper_module_LibArchive libarchive)
set(unimapper_module_SQLite3 sqlite3)
set(unimapper_module_ZLIB zlib)
set(unimapper_module_liblzf liblzf)
set(unimapper_module_nanoflann nanoflann)
set(unimapper_module_nlohmann_json nlohmann_json)
set(unimapper_flags_Threads -pthread)
set(unimapper_flags_LCM -llcm)
set(unimapper_flags_Sodium -lsodium)
set(unimapper_flags_Ceres "-lceres -lglog")
set(unimapper_flags_m -lm)
# Where a package is not called what its targets begin with.
set(unimapper_package_SQLite SQLite3)

# unimapper_component(NAME TARGET): installs and exports TARGET and describes it for CMake and
# pkg-config.
function(unimapper_component name)
  install(TARGETS ${ARGN} EXPORT unimapper_${name}
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library
      NAMELINK_COMPONENT development
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
  install(EXPORT unimapper_${name} NAMESPACE unimapper:: DESTINATION ${unimapper_cmake_dir}
    COMPONENT development)
  list(GET ARGN 0 target)
  get_target_property(links ${target} LINK_LIBRARIES)
  set(components)
  set(packages)
  set(pc_requires)
  set(pc_libs)
  foreach(link IN LISTS links)
    if(link MATCHES "^unimapper::(.+)$")
      list(APPEND components ${CMAKE_MATCH_1})
      list(APPEND pc_requires unimapper_${CMAKE_MATCH_1})
    elseif(link MATCHES "^([A-Za-z0-9_]+)(::.*)?$")
      set(package ${CMAKE_MATCH_1})
      set(is_package "${CMAKE_MATCH_2}")
      if(DEFINED unimapper_package_${package})
        set(package ${unimapper_package_${package}})
      endif()
      if(is_package)
        list(APPEND packages ${package})
      endif()
      list(APPEND pc_requires ${unimapper_module_${package}})
      list(APPEND pc_libs ${unimapper_flags_${package}})
    endif()
  endforeach()
  set(needs "set(unimapper_components_of_${name} ${components})\n")
  string(APPEND needs "set(unimapper_packages_of_${name} ${packages})\n")
  set(unimapper_needs "${unimapper_needs}${needs}" PARENT_SCOPE)
  set(unimapper_components ${unimapper_components} ${name} PARENT_SCOPE)

  list(JOIN pc_requires ", " pc_requires)
  list(JOIN pc_libs " " pc_libs)
  set(pc_include "-I\${includedir}")
  if(EXISTS "${PROJECT_SOURCE_DIR}/ports/${name}" AND NOT name STREQUAL "c")
    string(APPEND pc_include " -I\${includedir}/unimapper")
  endif()
  # Relative, so that the installed tree may be moved.
  file(RELATIVE_PATH pc_to_prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
  configure_file("${CMAKE_CURRENT_FUNCTION_LIST_DIR}/unimapper.pc.in"
    "${CMAKE_BINARY_DIR}/pkgconfig/unimapper_${name}.pc" @ONLY)
  install(FILES "${CMAKE_BINARY_DIR}/pkgconfig/unimapper_${name}.pc"
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()

unimapper_component(c unimapper_c unimapper_c_static)
install(FILES ports/c/unimapper.h ports/c/unimapper_odometry.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)

get_property(unimapper_libraries GLOBAL PROPERTY UNIMAPPER_LIBRARIES)
get_property(unimapper_freestanding GLOBAL PROPERTY UNIMAPPER_FREESTANDING_LIBRARIES)
foreach(library IN LISTS unimapper_libraries)
  if(EXISTS "${PROJECT_SOURCE_DIR}/include/unimapper/${library}")
    install(DIRECTORY include/unimapper/${library}
      DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/unimapper COMPONENT development)
  elseif(EXISTS "${PROJECT_SOURCE_DIR}/ports/${library}")
    install(DIRECTORY ports/${library} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/unimapper/ports
      COMPONENT development FILES_MATCHING PATTERN "*.hpp" PATTERN "*.h")
  elseif(NOT library IN_LIST unimapper_freestanding)
    # Without public headers: a part of the tool (the simulator).
    continue()
  endif()
  unimapper_component(${library} unimapper_${library})
endforeach()
# The encoder's headers are the wire's.
if(NOT TARGET unimapper_wire)
  install(DIRECTORY include/unimapper/wire DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/unimapper
    COMPONENT development)
endif()

configure_package_config_file(
  "${CMAKE_CURRENT_LIST_DIR}/unimapperConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/unimapperConfig.cmake"
  INSTALL_DESTINATION ${unimapper_cmake_dir})
write_basic_package_version_file("${CMAKE_BINARY_DIR}/unimapperConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/unimapperConfig.cmake"
  "${CMAKE_BINARY_DIR}/unimapperConfigVersion.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindLCM.cmake"
  "${CMAKE_CURRENT_LIST_DIR}/FindSodium.cmake"
  DESTINATION ${unimapper_cmake_dir} COMPONENT development)
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR}
  COMPONENT development)
install(FILES package.xml DESTINATION "${CMAKE_INSTALL_DATADIR}/unimapper" COMPONENT development)
if(TARGET unimapper)
  install(TARGETS unimapper RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT tool)
endif()

# Packages of Debian: `cpack -G DEB` in the build folder. A project around this one packs itself.
if(NOT PROJECT_IS_TOP_LEVEL)
  return()
endif()
set(CPACK_PACKAGE_CONTACT "The Uni-Mapper authors <maintainers@unimapper.invalid>")
set(CPACK_RESOURCE_FILE_LICENSE "${PROJECT_SOURCE_DIR}/LICENSE")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL library development)
if(TARGET unimapper)
  list(APPEND CPACK_COMPONENTS_ALL tool)
endif()
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME "libunimapper${PROJECT_VERSION_MAJOR}")
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "Uni-Mapper's onboard library with its C interface")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libunimapper-dev)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers and static libraries of Uni-Mapper")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libeigen3-dev, ${CPACK_DEBIAN_LIBRARY_PACKAGE_NAME} (= ${PROJECT_VERSION})")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SUGGESTS
  "libceres-dev, libnanoflann-dev, liblcm-dev, libsodium-dev, libsqlite3-dev, zlib1g-dev")
set(CPACK_DEBIAN_TOOL_PACKAGE_NAME unimapper)
set(CPACK_COMPONENT_TOOL_DESCRIPTION "Merges LiDAR recordings of several robots into one static map")
include(CPack)
