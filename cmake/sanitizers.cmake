# Sanitizers as an interface target that the library hands on to whatever links it inside this project.
set(ISOSPLINE_SANITIZE "" CACHE STRING "Sanitizers to build with, as in -fsanitize=: \"address,undefined\" or \"thread\"")

add_library(isospline_sanitizers INTERFACE)
if(ISOSPLINE_SANITIZE)
  set(sanitizer_options -fsanitize=${ISOSPLINE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_compile_options(isospline_sanitizers INTERFACE ${sanitizer_options})
  target_link_options(isospline_sanitizers INTERFACE ${sanitizer_options})
  # GCC warns without cause where the sanitizers' code stands between a value and its use.
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    target_compile_options(isospline_sanitizers INTERFACE -Wno-maybe-uninitialized)
  endif()
endif()
