# Tests: GoogleTest programs that CTest sees case by case.

include_guard(GLOBAL)

include(GoogleTest)

# What every test program shares: GoogleTest, the helpers of tests/support and one precompiled header.
add_library(blockid_test_support OBJECT "${PROJECT_SOURCE_DIR}/tests/support/pch.cpp"
                                        "${PROJECT_SOURCE_DIR}/tests/support/source_dir.cpp")
blockid_set_compile_flags(blockid_test_support)
target_compile_features(blockid_test_support PUBLIC cxx_std_20)
target_include_directories(blockid_test_support PUBLIC "${PROJECT_SOURCE_DIR}/tests")
target_link_libraries(blockid_test_support PUBLIC blockid::data GTest::gmock GTest::gtest Eigen3::Eigen Ceres::ceres
                                                  Threads::Threads)
target_precompile_headers(blockid_test_support PRIVATE "${PROJECT_SOURCE_DIR}/tests/pch.hpp")
set_source_files_properties(
  "${PROJECT_SOURCE_DIR}/tests/support/source_dir.cpp"
  PROPERTIES COMPILE_DEFINITIONS "BLOCKID_SOURCE_DIR=\"${PROJECT_SOURCE_DIR}\"" SKIP_PRECOMPILE_HEADERS ON)
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND NOT CMAKE_DISABLE_PRECOMPILE_HEADERS)
  # Lets ccache see through the precompiled header.
  target_compile_options(blockid_test_support PUBLIC -fpch-preprocess)
endif()

# blockid_add_test(<name>
#   SOURCES <file>...
#   [LIBS <target>...]
#   [LABELS <label>...]     `slow` for what takes more than a few seconds
#   [DEFINITIONS <def>...]
#   [TIMEOUT <seconds>]     of one case; default 300
#   [OWN_MAIN])             the sources hold main()
#
# A test program. Each of its cases is a CTest test `<name>.<Suite>.<Case>`, run in a scratch folder of the build
# tree; a case that calls GTEST_SKIP() shows as skipped.
function(blockid_add_test name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "OWN_MAIN" "TIMEOUT" "SOURCES;LIBS;LABELS;DEFINITIONS")
  if(arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "blockid_add_test(${name}): unknown arguments ${arg_UNPARSED_ARGUMENTS}")
  endif()
  if(NOT arg_TIMEOUT)
    set(arg_TIMEOUT 300)
  endif()

  blockid_add_program(${name} SOURCES ${arg_SOURCES} LIBS ${arg_LIBS} blockid_test_support)
  if(NOT arg_OWN_MAIN)
    target_link_libraries(${name} PRIVATE GTest::gmock_main)
  endif()
  target_compile_definitions(${name} PRIVATE ${arg_DEFINITIONS})
  target_precompile_headers(${name} REUSE_FROM blockid_test_support)

  set(scratch "${CMAKE_CURRENT_BINARY_DIR}/${name}_scratch")
  file(MAKE_DIRECTORY "${scratch}")
  set(properties TIMEOUT ${arg_TIMEOUT})
  if(arg_LABELS)
    list(APPEND properties LABELS "${arg_LABELS}")
  endif()
  gtest_discover_tests(
    ${name}
    TEST_PREFIX "${name}."
    NO_PRETTY_VALUES
    WORKING_DIRECTORY "${scratch}"
    DISCOVERY_MODE PRE_TEST
    DISCOVERY_TIMEOUT 120
    PROPERTIES ${properties})
endfunction()
