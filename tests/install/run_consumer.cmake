# Script of the test install_consumer; its variables are set by CMakeLists.txt beside it.
cmake_minimum_required(VERSION 3.25)

# run(<what> <command>...): stops the script unless the command succeeds.
function(run what)
  message(STATUS "${what}")
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "${what}: failed with ${result}")
  endif()
endfunction()

set(prefix "${WORK_DIR}/prefix")
file(REMOVE_RECURSE "${WORK_DIR}")

run("install" "${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${prefix}" --config "${CONFIG}")

# An installed package must not point back into the trees that it came from.
file(GLOB_RECURSE cmake_files "${prefix}/*.cmake")
if(NOT cmake_files)
  message(FATAL_ERROR "no CMake package was installed")
endif()
foreach(file IN LISTS cmake_files)
  file(READ "${file}" content)
  foreach(tree IN ITEMS "${BUILD_DIR}" "${SOURCE_DIR}")
    string(FIND "${content}" "${tree}/" position)
    if(NOT position EQUAL -1)
      message(FATAL_ERROR "${file} mentions ${tree}")
    endif()
  endforeach()
endforeach()

file(GLOB_RECURSE installed RELATIVE "${prefix}/include" "${prefix}/include/*")
foreach(file IN LISTS installed)
  if(NOT file MATCHES "^blockid/[a-z_]+/[a-z0-9_/]+[.]hpp$")
    message(FATAL_ERROR "unexpected file among the installed headers: ${file}")
  endif()
endforeach()

run("configure"
    "${CMAKE_COMMAND}"
    -S "${SOURCE_DIR}/tests/install/consumer"
    -B "${WORK_DIR}/build"
    -G "${GENERATOR}"
    "-DCMAKE_MAKE_PROGRAM=${MAKE_PROGRAM}"
    "-DCMAKE_CXX_COMPILER=${CXX_COMPILER}"
    "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}"
    "-DCMAKE_BUILD_TYPE=${CONFIG}"
    "-DCMAKE_PREFIX_PATH=${prefix}")
run("build" "${CMAKE_COMMAND}" --build "${WORK_DIR}/build" --config "${CONFIG}")
run("test" "${CMAKE_CTEST_COMMAND}" --test-dir "${WORK_DIR}/build" --build-config "${CONFIG}"
    --output-on-failure --no-tests=error)
