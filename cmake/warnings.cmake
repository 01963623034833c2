# Warnings as an interface target that every target of this project links privately.
add_library(isospline_warnings INTERFACE)
target_compile_options(isospline_warnings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Wold-style-cast
  $<$<BOOL:${ISOSPLINE_WARNINGS_AS_ERRORS}>:-Werror>)
