# Installs the library, its headers and the package that find_package(isospline) reads.
include(CMakePackageConfigHelpers)

set(ISOSPLINE_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/isospline)

install(TARGETS isospline EXPORT isospline-targets COMPONENT development)
install(DIRECTORY core/isospline DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development
  FILES_MATCHING PATTERN "*.h")
install(EXPORT isospline-targets NAMESPACE isospline:: DESTINATION ${ISOSPLINE_PACKAGE_DIR} COMPONENT development)

configure_package_config_file(cmake/isospline-config.cmake.in ${PROJECT_BINARY_DIR}/isospline-config.cmake
  INSTALL_DESTINATION ${ISOSPLINE_PACKAGE_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/isospline-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/isospline-config.cmake ${PROJECT_BINARY_DIR}/isospline-config-version.cmake
  DESTINATION ${ISOSPLINE_PACKAGE_DIR} COMPONENT development)
