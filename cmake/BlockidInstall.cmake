# The CMake package: find_package(blockid CONFIG) gives blockid::<folder> and blockid::blockid.

include_guard(GLOBAL)

if(NOT BLOCKID_INSTALL)
  return()
endif()

include(CMakePackageConfigHelpers)

set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/blockid")

configure_package_config_file(
  "${PROJECT_SOURCE_DIR}/cmake/blockidConfig.cmake.in" "${PROJECT_BINARY_DIR}/blockidConfig.cmake"
  INSTALL_DESTINATION "${package_dir}"
  NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file("${PROJECT_BINARY_DIR}/blockidConfigVersion.cmake"
                                 COMPATIBILITY SameMinorVersion)

install(FILES "${PROJECT_BINARY_DIR}/blockidConfig.cmake" "${PROJECT_BINARY_DIR}/blockidConfigVersion.cmake"
        DESTINATION "${package_dir}")
install(
  EXPORT blockidTargets
  NAMESPACE blockid::
  DESTINATION "${package_dir}")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")
