include(CMakePackageConfigHelpers)

install(DIRECTORY include/marrow DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT marrow NAMESPACE marrow:: FILE marrow-targets.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/marrow)
configure_package_config_file(cmake/marrow-config.cmake.in marrow-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/marrow)
write_basic_package_version_file(marrow-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/marrow-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/marrow-config-version.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/marrow)
