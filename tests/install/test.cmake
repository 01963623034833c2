# Installs the library to an empty prefix, then configures, builds and runs programs against it: the consumer beside
# this file, and the example of the documentation, docs/howto/cpp.md. Each link optimizes the whole library, so the
# example is only compiled, unless the tests are long.
set(work ${BUILD_DIR}/installed_package)
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGV} COMMAND_ERROR_IS_FATAL ANY)
endfunction()

# Where the machine has fused multiply-adds, the consumer is told to use them.
if(EXISTS /proc/cpuinfo)
  file(STRINGS /proc/cpuinfo flags REGEX "^flags.* fma " LIMIT_COUNT 1)
  if(flags)
    string(APPEND CXX_FLAGS " -mfma")
  endif()
endif()

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${work}/prefix --component development)
foreach(source ${CMAKE_CURRENT_LIST_DIR} ${CMAKE_CURRENT_LIST_DIR}/../../examples/cpp)
  get_filename_component(name ${source} NAME)
  run(${CMAKE_COMMAND} -S ${source} -B ${work}/${name} -G Ninja -D CMAKE_PREFIX_PATH=${work}/prefix
    -D ISOSPLINE_VERSION=${VERSION}
    -D CMAKE_CXX_COMPILER=${CXX_COMPILER} "-DCMAKE_CXX_FLAGS=${CXX_FLAGS} -O2"
  )
endforeach()
run(${CMAKE_COMMAND} --build ${work}/install)
run(${work}/install/consumer)
if(DEFINED ENV{ISOSPLINE_LONG_TESTS})
  run(${CMAKE_COMMAND} --build ${work}/cpp)
  run(${work}/cpp/gyroid WORKING_DIRECTORY ${work})
  if(NOT EXISTS ${work}/gyroid.exr)
    message(FATAL_ERROR "gyroid: expected the picture gyroid.exr")
  endif()
else()
  run(${CMAKE_COMMAND} --build ${work}/cpp --target CMakeFiles/gyroid.dir/gyroid.cpp.o)
endif()

# No installed header needs any of the libraries that isospline is made with.
file(GLOB_RECURSE headers RELATIVE ${work}/prefix/include ${work}/prefix/include/*.h)
list(LENGTH headers count)
if(count LESS 20)
  message(FATAL_ERROR "headers: expected the public ones, got ${count}")
endif()
list(TRANSFORM headers REPLACE "(.+)" "#include <\\1>\n")
list(JOIN headers "" includes)
file(WRITE ${work}/headers.cpp "${includes}")
execute_process(
  COMMAND
    ${CXX_COMPILER} -std=c++20 -Wall -Wextra -Werror -fsyntax-only -H -I ${work}/prefix/include ${work}/headers.cpp
  RESULT_VARIABLE result
  ERROR_VARIABLE included
)
if(result OR included MATCHES "/(hwy|tbb|oneapi|embree[34]|OpenEXR|Imath|pybind11)/[^\n]*")
  message(FATAL_ERROR "headers: expected that they compile with glm alone, got ${CMAKE_MATCH_0}\n${included}")
endif()
