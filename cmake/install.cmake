# Installs the library, its public headers and the package that find_package(isospline) reads.
include(CMakePackageConfigHelpers)

set(ISOSPLINE_PACKAGE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/isospline)

# The public headers are those that isospline.h includes, directly or indirectly. No other header is installed.
# They compile without Embree, TBB, Highway and OpenEXR.
function(isospline_add_public_header header)
  get_property(known GLOBAL PROPERTY isospline_public_headers)
  if(header IN_LIST known)
    return()
  endif()
  set_property(GLOBAL APPEND PROPERTY isospline_public_headers ${header})
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS core/${header})
  file(STRINGS core/${header} includes REGEX "^#include \"")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE "^#include \"(.*)\"$" "\\1" include ${include})
    isospline_add_public_header(${include})
  endforeach()
endfunction()

isospline_add_public_header(isospline/isospline.h)
get_property(public_headers GLOBAL PROPERTY isospline_public_headers)
foreach(header IN LISTS public_headers)
  cmake_path(GET header PARENT_PATH folder)
  install(FILES core/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder} COMPONENT development)
endforeach()

install(TARGETS isospline EXPORT isospline-targets COMPONENT development)
install(EXPORT isospline-targets NAMESPACE isospline:: DESTINATION ${ISOSPLINE_PACKAGE_DIR} COMPONENT development)

configure_package_config_file(
  cmake/isospline-config.cmake.in
  ${PROJECT_BINARY_DIR}/isospline-config.cmake
  INSTALL_DESTINATION ${ISOSPLINE_PACKAGE_DIR}
)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/isospline-config-version.cmake COMPATIBILITY SameMinorVersion)
install(
  FILES ${PROJECT_BINARY_DIR}/isospline-config.cmake ${PROJECT_BINARY_DIR}/isospline-config-version.cmake
  DESTINATION ${ISOSPLINE_PACKAGE_DIR}
  COMPONENT development
)
