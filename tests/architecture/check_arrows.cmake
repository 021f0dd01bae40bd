# Script of the tests architecture.<folder>: compiles an include of each other folder's headers with the include path
# of FOLDER. It must be found if FOLDER is that folder itself, must not be found against an arrow; with an arrow both
# are right, for a folder need not use all that it may.
cmake_minimum_required(VERSION 3.25)

file(READ "${DIRECTORIES}" directories)
list(REMOVE_DUPLICATES directories)
list(TRANSFORM directories PREPEND "-I")

foreach(other IN LISTS ALL)
  file(GLOB headers RELATIVE "${SOURCE_DIR}/${other}" "${SOURCE_DIR}/${other}/*.hpp")
  if(NOT headers)
    continue()
  endif()
  list(GET headers 0 header)
  set(probe "${WORK_DIR}/${FOLDER}_includes_${other}.cpp")
  file(
    WRITE "${probe}"
    "#if !__has_include(<blockid/${other}/${header}>)\n" #
    "#error not found\n" #
    "#endif\n")
  execute_process(
    COMMAND "${CXX_COMPILER}" -std=c++20 -fsyntax-only ${directories} "${probe}"
    RESULT_VARIABLE result
    ERROR_VARIABLE messages)
  if(result EQUAL 0)
    set(found TRUE)
  elseif(messages MATCHES "#error not found")
    set(found FALSE)
  else()
    message(FATAL_ERROR "the probe does not compile: ${messages}")
  endif()

  if(other STREQUAL FOLDER)
    if(NOT found)
      message(FATAL_ERROR "${FOLDER}/ does not find its own header <blockid/${other}/${header}>")
    endif()
  elseif(found AND NOT other IN_LIST MAY_USE)
    message(FATAL_ERROR "${FOLDER}/ can include <blockid/${other}/${header}>, against the arrows")
  endif()
endforeach()

# A quoted path that leaves the folder would go around the include path.
file(GLOB_RECURSE sources "${SOURCE_DIR}/${FOLDER}/*.hpp" "${SOURCE_DIR}/${FOLDER}/*.cpp")
foreach(source IN LISTS sources)
  file(STRINGS "${source}" includes REGEX "^[ \t]*#[ \t]*include[ \t]*\"")
  foreach(include IN LISTS includes)
    string(REGEX REPLACE ".*\"(.*)\".*" "\\1" path "${include}")
    cmake_path(GET source PARENT_PATH folder_of_source)
    cmake_path(ABSOLUTE_PATH path BASE_DIRECTORY "${folder_of_source}" NORMALIZE)
    string(FIND "${path}" "${SOURCE_DIR}/${FOLDER}/" position)
    if(NOT position EQUAL 0)
      message(FATAL_ERROR "${source} leaves its folder: ${include}")
    endif()
  endforeach()
endforeach()
