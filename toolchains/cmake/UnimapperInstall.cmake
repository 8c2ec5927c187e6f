# Installation and export of the onboard libraries for find_package(unimapper).
#
# core, free_space, place and onboard for C++, unimapper.h with a shared and a static library for C.
include(CMakePackageConfigHelpers)

install(TARGETS unimapper_c unimapper_c_static
  EXPORT unimapperTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(FILES ports/c/unimapper.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
# Relative, so that the installed tree may be moved.
file(RELATIVE_PATH unimapper_pc_to_prefix "/${CMAKE_INSTALL_LIBDIR}/pkgconfig" "/")
configure_file("${CMAKE_CURRENT_LIST_DIR}/unimapper_c.pc.in"
  "${CMAKE_BINARY_DIR}/unimapper_c.pc" @ONLY)
install(FILES "${CMAKE_BINARY_DIR}/unimapper_c.pc"
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
install(TARGETS unimapper_core unimapper_free_space unimapper_place unimapper_onboard
  EXPORT unimapperTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/unimapper/core include/unimapper/free_space include/unimapper/place
    include/unimapper/onboard
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/unimapper)
install(EXPORT unimapperTargets NAMESPACE unimapper::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/unimapper)
configure_package_config_file(
  "${CMAKE_CURRENT_LIST_DIR}/unimapperConfig.cmake.in"
  "${CMAKE_BINARY_DIR}/unimapperConfig.cmake"
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/unimapper)
write_basic_package_version_file("${CMAKE_BINARY_DIR}/unimapperConfigVersion.cmake"
  COMPATIBILITY SameMinorVersion)
install(FILES "${CMAKE_BINARY_DIR}/unimapperConfig.cmake"
  "${CMAKE_BINARY_DIR}/unimapperConfigVersion.cmake"
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/unimapper)
install(FILES LICENSE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
