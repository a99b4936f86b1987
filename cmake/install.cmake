# Installs the headers and what find_package(marrow) reads.
include(CMakePackageConfigHelpers)

install(DIRECTORY include/marrow DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
install(EXPORT marrow NAMESPACE marrow:: FILE marrow-targets.cmake DESTINATION ${MARROW_CMAKE_FOLDER} COMPONENT development)
configure_package_config_file(cmake/marrow-config.cmake.in marrow-config.cmake INSTALL_DESTINATION ${MARROW_CMAKE_FOLDER})
write_basic_package_version_file(marrow-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/marrow-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/marrow-config-version.cmake
  DESTINATION ${MARROW_CMAKE_FOLDER} COMPONENT development)
