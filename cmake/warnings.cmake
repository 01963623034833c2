# Warnings as an interface target. Every target of this project links it privately.
add_library(isospline_warnings INTERFACE)
target_compile_options(
  isospline_warnings
  INTERFACE
    -Wall
    -Wextra
    -Wpedantic
    -Wnon-virtual-dtor
    -Wold-style-cast
    $<$<BOOL:${ISOSPLINE_WARNINGS_AS_ERRORS}>:-Werror>
)
# Where several sources are compiled as one, names of one may shadow those of another: -Wshadow is for builds of each
# source alone.
if(CMAKE_UNITY_BUILD)
  target_compile_options(isospline_warnings INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-subobject-linkage>)
else()
  target_compile_options(isospline_warnings INTERFACE -Wshadow)
endif()
# GCC gives false warnings: that the value of an empty std::optional in a std::variant is read (GCC bug 80635) and, in
# GCC 12, that the concatenation of a literal and a std::string is an overlapping copy (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(
    isospline_warnings
    INTERFACE -Wno-maybe-uninitialized $<$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>:-Wno-restrict>
  )
endif()
