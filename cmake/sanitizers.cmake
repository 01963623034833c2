# Sanitizers as an interface target. All targets of this project that link the library get it.
set(
  ISOSPLINE_SANITIZE
  ""
  CACHE STRING
  "Sanitizers to build with, as in -fsanitize=: \"address,undefined\" or \"thread\""
)

add_library(isospline_sanitizers INTERFACE)
if(ISOSPLINE_SANITIZE)
  set(sanitizer_options -fsanitize=${ISOSPLINE_SANITIZE} -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_compile_options(isospline_sanitizers INTERFACE ${sanitizer_options})
  target_link_options(isospline_sanitizers INTERFACE ${sanitizer_options})
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
    # Code that sanitizers insert between a value and its use causes false warnings.
    target_compile_options(isospline_sanitizers INTERFACE -Wno-maybe-uninitialized -fno-var-tracking)
  endif()
endif()
