# Script of the test architecture.wide_kernels: object files *_avx2*, *_avx512* define no symbol that another object file
# may share, except in their own namespaces blockid::detail::avx2 and blockid::detail::avx512.
cmake_minimum_required(VERSION 3.25)

set(checked 0)
foreach(object IN LISTS OBJECTS)
  cmake_path(GET object FILENAME name)
  if(NOT name MATCHES "_avx[0-9]+[.]cpp")
    continue()
  endif()
  math(EXPR checked "${checked} + 1")
  execute_process(
    COMMAND "${NM}" --demangle --defined-only "${object}"
    OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE ";" "," symbols "${symbols}")
  string(REPLACE "\n" ";" symbols "${symbols}")
  foreach(symbol IN LISTS symbols)
    if(symbol MATCHES "^[0-9a-f]+ [WVu] " AND NOT symbol MATCHES "blockid::detail::avx[0-9]+::")
      message(FATAL_ERROR "${name} defines a symbol that baseline code may share: ${symbol}")
    endif()
  endforeach()
endforeach()
if(checked EQUAL 0)
  message(FATAL_ERROR "no object file with wide kernels among ${OBJECTS}")
endif()
