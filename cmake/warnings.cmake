# Warnings as an interface target that every target of this project links privately.
add_library(isospline_warnings INTERFACE)
target_compile_options(isospline_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${ISOSPLINE_WARNINGS_AS_ERRORS}>:-Werror>)
# GCC 12 takes the concatenation of a literal and a std::string for an overlapping copy (GCC bug 105651), and what an
# empty std::optional in a std::variant does not hold for something that is read (GCC bug 80635).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  target_compile_options(isospline_warnings INTERFACE -Wno-restrict -Wno-maybe-uninitialized)
endif()
