# Warnings as an interface target that every target of this project links privately.
add_library(isospline_warnings INTERFACE)
target_compile_options(isospline_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${ISOSPLINE_WARNINGS_AS_ERRORS}>:-Werror>)
# GCC takes what an empty std::optional in a std::variant does not hold for something that is read (GCC bug 80635), and
# GCC 12 the concatenation of a literal and a std::string for an overlapping copy (GCC bug 105651).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(isospline_warnings INTERFACE
    -Wno-maybe-uninitialized $<$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>:-Wno-restrict>)
endif()
