# User options, the default build type and the compiler flags of our own targets.

include_guard(GLOBAL)

option(BLOCKID_BUILD_TESTS "Build the tests" ${PROJECT_IS_TOP_LEVEL})
option(BLOCKID_BUILD_EXAMPLES "Build the examples" ${PROJECT_IS_TOP_LEVEL})
option(BLOCKID_BUILD_BENCH "Build the benchmarks" OFF)
option(BLOCKID_BUILD_CLI "Build the program blockid" ON)
option(BLOCKID_UNITY_BUILD "Compile the sources of library and program in batches: whole builds are faster" OFF)
option(BLOCKID_INSTALL "Generate the install rules" ${PROJECT_IS_TOP_LEVEL})
option(BLOCKID_WARNINGS_AS_ERRORS "Treat warnings in our own targets as errors" OFF)
option(BLOCKID_COVERAGE "Instrument for gcov" OFF)
option(BLOCKID_NATIVE "Tune for the building machine (benchmarks only)" OFF)
option(BUILD_SHARED_LIBS "Build shared instead of static libraries" OFF)
set(BLOCKID_SANITIZE "" CACHE STRING "Sanitizers: 'address,undefined', 'thread' or empty")
set_property(CACHE BLOCKID_SANITIZE PROPERTY STRINGS "" "address,undefined" "thread")

if(PROJECT_IS_TOP_LEVEL)
  get_property(is_multi_config GLOBAL PROPERTY GENERATOR_IS_MULTI_CONFIG)
  if(NOT is_multi_config AND NOT CMAKE_BUILD_TYPE)
    set(CMAKE_BUILD_TYPE Release CACHE STRING "Build type" FORCE)
  endif()

  set(CMAKE_EXPORT_COMPILE_COMMANDS ON)

  if(NOT DEFINED CMAKE_CXX_COMPILER_LAUNCHER)
    find_program(BLOCKID_CCACHE_PROGRAM ccache)
    mark_as_advanced(BLOCKID_CCACHE_PROGRAM)
    if(BLOCKID_CCACHE_PROGRAM)
      # The sloppiness is what ccache asks for when precompiled headers are in use.
      set(CMAKE_CXX_COMPILER_LAUNCHER
          "${CMAKE_COMMAND};-E;env;CCACHE_SLOPPINESS=pch_defines,time_macros;${BLOCKID_CCACHE_PROGRAM}")
    endif()
  endif()
endif()

# Instrumentation must reach every object and every link of the tree, so it is set for the directory; it is
# deliberately absent from the exported targets.
set(BLOCKID_INSTRUMENTATION_FLAGS "")
if(BLOCKID_SANITIZE)
  list(APPEND BLOCKID_INSTRUMENTATION_FLAGS "-fsanitize=${BLOCKID_SANITIZE}" -fno-omit-frame-pointer)
  if(BLOCKID_SANITIZE MATCHES "address")
    # Eigen would align by hand under AddressSanitizer; the installed Ceres does not, and matrices cross the border.
    add_compile_definitions(EIGEN_MALLOC_ALREADY_ALIGNED=1)
  endif()
  if(BLOCKID_SANITIZE MATCHES "undefined")
    list(APPEND BLOCKID_INSTRUMENTATION_FLAGS -fno-sanitize-recover=undefined)
  endif()
endif()
if(BLOCKID_COVERAGE)
  list(APPEND BLOCKID_INSTRUMENTATION_FLAGS --coverage -fprofile-update=atomic)
endif()
if(BLOCKID_NATIVE)
  list(APPEND BLOCKID_INSTRUMENTATION_FLAGS -march=native)
endif()
add_compile_options(${BLOCKID_INSTRUMENTATION_FLAGS})
add_link_options(${BLOCKID_INSTRUMENTATION_FLAGS})

# blockid_set_compile_flags(<target>): language level and warnings of one of our own targets.
function(blockid_set_compile_flags target)
  set_target_properties(${target} PROPERTIES CXX_EXTENSIONS OFF)
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wconversion -Wshadow)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    # False alarms of GCC 12 on std::string (GCC bugs 105329, 105651, 105762): "text" + string, string(n, c) + "text".
    target_compile_options(${target} PRIVATE -Wno-restrict -Wno-array-bounds -Wno-stringop-overflow)
  endif()
  if(BLOCKID_WARNINGS_AS_ERRORS)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
endfunction()
